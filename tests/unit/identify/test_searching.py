"""Do means of a few readings lead a fit only where that takes long, and is its end that of all readings?"""

from dataclasses import replace
from typing import Any

import pytest

from identify.chain import Chain, plain_chain
from identify.effects import catalogue
from identify.effects.effect import Effect
from identify.explain.searching import Searching
from identify.explain.weights import Carried
from identify.fit import Fit, Pull, fit
from identify.observe import Observation
from identify.stage import Place
from tests.proof.rigs import RC
from tests.proof.stimuli import sine
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
NOISE = catalogue()["process_noise"](Place.G1, "white")
CARRIED = Carried(NOISE, Pull(lambda _: 0.0, 0.0, 1.0))


@pytest.fixture(scope="module")
def seen() -> tuple[tuple[Observation, ...], Chain]:
    """Return a recording and a chain to begin with."""
    wave = recorded(RC, sine("wave", 40.0, 3.0, 2, 4), (), NOISE_V, seed=3)
    return (observed(wave, NOISE_V),), plain_chain(model_of(RC))


@pytest.mark.parametrize(("carried", "effects", "steps", "led"), [
    (None, (), 4, 0), (CARRIED, (), 4, 1), (None, (NOISE,), 4, 1), (CARRIED, (), 0, 0),
])  # fmt: skip
@pytest.mark.parametrize("ended", [True, False])
def test_means_lead_where_something_acts_by_chance_and_all_readings_are_asked_where_they_end(
    carried: Carried | None, effects: tuple[Effect, ...], steps: int, led: int, ended: bool,
    seen: tuple[tuple[Observation, ...], Chain], monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    observations, chain = seen
    ahead, asked = replace(fit(chain, observations, iterations=1), converged=ended), []
    fits: list[dict[str, Any]] = []

    def noted(begun: Chain, those: tuple[Observation, ...], **how: Any) -> Fit:
        fits.append({"begun": begun, "near": how["near"]})
        return fit(begun, those, **how)

    monkeypatch.setattr("identify.explain.searching.gone_ahead", lambda *those: asked.append(those) or ahead)
    monkeypatch.setattr("identify.explain.searching.sizing", lambda *_: None)
    monkeypatch.setattr("identify.explain.searching.fit", noted)
    found = Searching(chain.values, (), carried).led(chain, effects, observations, steps, True)
    assert len(asked) == led
    assert (found is ahead) is bool(led and not ended)
    assert fits == ([] if led and not ended else [{"begun": ahead.chain if led else chain, "near": bool(led)}])
