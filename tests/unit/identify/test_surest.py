"""Is a name never likelier than not while much of the mismatch is unexplained?"""

import pytest

from identify.effects import catalogue
from identify.explain import explain
from identify.explain.confirm import most_believed
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, staircase
from tests.trials import model_of, recorded


def test_no_name_of_an_answer_is_likelier_than_that(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[float, float]] = []

    def most(met: float, left: float) -> float:
        asked.append((met, left))
        return 0.5

    monkeypatch.setattr("identify.explain.answer.most_believed", most)
    rails = (Concealed("saturation", {"upper": 9.0, "lower": -30.0}),)
    walks = [staircase("walk", tuple(share * v for v in FIG13_LEVELS_V), 0.02, 2) for share in (1.0, 0.9)]
    runs = [recorded(OP_AMP, walk, rails, 0.01, seed, fine=8) for seed, walk in enumerate(walks)]
    others = sorted(set(catalogue()) - {"saturation", "soft_saturation", "diode_clamp", "adc_clipping"})
    (rail,) = explain(model_of(OP_AMP), runs[:1], runs[1:], leave_out=others).effects
    assert (rail.id, rail.probability) == ("saturation", 0.5)
    ((met, left),) = asked
    assert met > 10.0
    assert left < 1.1


@pytest.mark.parametrize(("met", "left", "most"), [
    (18.3, 7.5, 0.5),  # a sixth of the mismatch is left
    (18.3, 1.05, 1.0),
    (1.2, 1.05, 1.0),  # a fifth of it is left, and it is little
    (2.2, 1.2, 0.5),  # a tenth is left, and it stands out
    (400.0, 3.0, 1.0),  # one part in twenty thousand is left
    (3.4, 1.6, 0.5),
])
def test_what_is_left_bounds_what_is_believed(met: float, left: float, most: float) -> None:
    assert most_believed(met, left) == most
