"""When does what a name leaves speak against the name?"""

from dataclasses import replace

import pytest

from identify.effects import catalogue, chain_of
from identify.explain.bench import Bench
from identify.explain.locate import Located
from identify.explain.round import Round
from identify.explain.warrant import warranted
from identify.stage import Place
from identify.unnamed.correction import Correction
from identify.unnamed.maps import ClockMap, LevelMap
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, staircase
from tests.trials import model_of, observed, recorded

NOISE_V, TOLD = 0.010, 1e5
CLOCK, LEVEL = ClockMap(Place.SENSE, (0.0, 0.1, 0.2), "map"), LevelMap(Place.SENSE, (-5.0, 0.0, 5.0), "map")


@pytest.mark.parametrize(
    ("name", "correction", "left", "earned"),
    [
        ("feedthrough", LEVEL, 0.03, True),
        ("feedthrough", LEVEL, 0.1, False),
        ("feedthrough", CLOCK, 0.1, True),  # what goes with the clock is no failing of a law that does not
        ("feedthrough", CLOCK, 0.7, False),  # but it must not be most of it
        ("offset_drift", CLOCK, 0.1, False),
    ],
)
def test_a_name_is_earned_unless_its_own_law_should_have_explained_what_is_left(
    name: str, correction: Correction, left: float, earned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    walk = observed(recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), (), NOISE_V, seed=7), NOISE_V)
    bench = Bench(chain_of(model_of(OP_AMP)), (walk,), (), tuple(catalogue().values()))
    effect = catalogue()[name](Place.SENSE)
    plain = bench.fitted(bench.plain, ())
    final = bench.fitted(bench.with_effects([effect], {}), [effect])
    base, winner = replace(plain, chi2=final.chi2 + (1.0 + left) * TOLD), replace(final, chi2=final.chi2 + left * TOLD)

    def beyond(_: Bench, hypothesis: object) -> Located:
        return Located(winner, ((correction, final),), 1e-12 if hypothesis is winner else 1.0)

    monkeypatch.setattr("identify.explain.warrant.located", beyond)
    found = warranted(bench, base, winner, [Round(base, (), (winner,), settled=winner)])
    assert (found.hypothesis.effects == (effect,)) is earned
