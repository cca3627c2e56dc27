"""Is physics that only held-out runs reach told as such, and nothing else?"""

import pytest

from identify.effects import chain_of
from identify.explain import explain
from identify.explain.unvisited import told_beyond, unvisited
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
PLAIN = chain_of(model_of(OP_AMP))
LOW = tuple(0.7 * level for level in FIG13_LEVELS_V)  # w within -9.4 to 6.6 V
RAILS = (Concealed("saturation", {"lower": -13.0, "upper": 30.0}),)


def walked(name: str, levels, physics=(), seed=1):
    return recorded(OP_AMP, staircase(name, levels, 0.05, 2), physics, NOISE_V, seed, fine=8)


def test_a_rail_that_only_the_held_out_run_reaches_is_told_to_lie_beyond() -> None:
    found = explain(model_of(OP_AMP), [walked("low", LOW, RAILS)], [walked("high", FIG13_LEVELS_V, RAILS, 2)])
    assert found.effects == ()
    assert found.remaining.over_noise > 3.0
    assert found.remaining.stage == "F"
    assert "lies where no run that was fitted has been: level of" in found.remaining.sentence


def test_the_stretch_is_named_with_its_share() -> None:
    runs = walked("low", LOW), walked("high", FIG13_LEVELS_V, RAILS, 2)
    train, test = (observed(run, NOISE_V, 8) for run in runs)
    beyond = unvisited(PLAIN, [train], [test])
    assert beyond is not None
    assert (beyond.axis, beyond.unit) == ("level of w", "V")
    assert beyond.share > 0.9
    assert beyond.low == pytest.approx(-17.6, abs=0.1)
    assert beyond.high == pytest.approx(-9.35, abs=0.1)
    assert "level of w from -17.6 V to -9.35 V" in told_beyond(beyond)


def test_a_mismatch_where_both_have_been_is_none() -> None:
    slow = observed(walked("low", LOW), NOISE_V, 8)
    leaking = (Concealed("leak", {"rate": 3.0}),)
    assert unvisited(PLAIN, [slow], [observed(walked("low again", LOW, leaking, 2), NOISE_V, 8)]) is None


def test_noise_alone_is_none() -> None:
    train, test = (observed(recorded(OP_AMP, sine("slow", 10.0, v, 5, 4), (), NOISE_V, seed, fine=8), NOISE_V, 8)
                   for v, seed in ((3.0, 1), (3.2, 2)))
    assert unvisited(PLAIN, [train], [test]) is None
