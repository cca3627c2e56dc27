"""Are values that fitted runs leave open told as such, and nothing that is missing or wrong with the readings?

The recordings come from the bench's own integrator; the rig file is 5 % off, so that an open value is off, too.
"""

from dataclasses import replace
from math import inf

import pytest

from identify.effects import chain_of
from identify.explain import explain
from identify.explain.bench import Bench
from identify.explain.left_open import left_open, named_open, told_by_all, told_open
from identify.page.next_steps import next_steps
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP, toleranced
from tests.proof.stimuli import FIG13_LEVELS_V, Stimulus, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
MODEL = model_of(toleranced(OP_AMP, 3, 0.05))
SMALL, WALK = sine("small", 20.0, 2.8, 4, 2), staircase("walk", FIG13_LEVELS_V, 0.02)  # the sine hardly leaves the gap
AGAIN = staircase("again", tuple(-0.9 * level for level in FIG13_LEVELS_V), 0.02)
LOSS = Concealed("missing_samples", {"position": 0.3, "count": 25})


def benched(*physics, stimulus=SMALL):
    bench = Bench(chain_of(MODEL), (seen(stimulus, 1, *physics),), (), ())
    return bench, bench.fitted(bench.plain, ())


def seen(stimulus, seed, *physics, noise_v=NOISE_V):
    return observed(recorded(OP_AMP, stimulus, physics, NOISE_V, seed, fine=8), noise_v, 8)


@pytest.mark.parametrize("amplitude_v", [2.2, 2.8])
def test_a_run_that_tells_little_makes_nothing_missing_of_one_that_moves_farther(amplitude_v: float) -> None:
    """What it leaves open passed for lost readings, named with 0.95."""
    small = recorded(OP_AMP, sine("small", 20.0, amplitude_v, 4, 2), (), NOISE_V, 1, fine=8)
    told = explain(MODEL, [small], [recorded(OP_AMP, WALK, (), NOISE_V, 2, fine=8)])
    assert (told.verdict, told.effects, told.location) == ("consistent", (), None)
    assert told.remaining.over_noise > 5.0
    assert told.remaining.stage is None
    assert "nothing is missing from the model, but the runs that were fitted leave " in told.sentence
    assert "With one set of values all runs, those held out too, agree to the noise" in told.remaining.sentence
    assert next_steps(told)[0].startswith("Fit the held-out runs, too")


def test_open_values_are_told_as_the_fitted_runs_and_as_all_runs_have_them() -> None:
    bench, plain = benched()
    values = left_open(bench, plain, [seen(WALK, 2)], inf)
    assert values is not None
    assert {value.name for value in values} <= {"S_L", "S_U", "D_L", "D_U", "G1.den.s1", "G1.den.s2", "G2.den.s1"}
    border = next(value for value in values if value.name == "D_L")
    assert border.all_runs.low < OP_AMP.d_l_v < border.all_runs.high
    assert border.fitted.high - border.fitted.low > 3.0 * (border.all_runs.high - border.all_runs.low)
    assert "D_L 1.2" in told_open([border])
    assert named_open(values).count(" and ") == 1


def test_what_no_values_explain_is_not_left_open() -> None:
    bench, plain = benched()
    rail = Concealed("saturation", {"lower": -6.0, "upper": 30.0})
    assert left_open(bench, plain, [seen(WALK, 2, rail)], inf) is None


def test_held_out_runs_that_need_values_which_the_fitted_runs_exclude_are_not_explained_by_these() -> None:
    bench, plain = benched(stimulus=WALK)
    other = replace(OP_AMP, d_l_v=1.3)
    test = observed(recorded(other, staircase("again", FIG13_LEVELS_V, 0.02), (), NOISE_V, 2, fine=8), NOISE_V, 8)
    assert left_open(bench, plain, [test], inf) is None


@pytest.mark.parametrize(("freedom", "told"), [(50.0, ()), (inf, None)])
def test_more_than_a_noise_that_is_roughly_known_may_be_chance(freedom: float, told: tuple[()] | None) -> None:
    bench, plain = benched(stimulus=WALK)
    again = seen(staircase("again", FIG13_LEVELS_V, 0.02), 2, noise_v=0.88 * NOISE_V)
    assert left_open(bench, plain, [again], freedom) == told


def test_readings_are_held_against_the_values_of_all_runs_where_those_held_out_leave_more() -> None:
    bench, plain = benched()
    walk = seen(WALK, 2)
    all_runs = told_by_all(bench, plain, [walk]).values
    assert abs(all_runs["F.D_L"] - OP_AMP.d_l_v) < 2e-3 < abs(plain.fit.chain.values["F.D_L"] - OP_AMP.d_l_v)
    assert told_by_all(bench, plain, ()) is plain.fit.chain
    assert told_by_all(bench, plain, [seen(SMALL, 5)]) is plain.fit.chain
    assert told_by_all(bench, replace(plain, swell=2.0), [walk]) is plain.fit.chain


@pytest.mark.parametrize("fitted", [WALK, AGAIN])
def test_readings_that_a_held_out_run_lost_are_put_back_beside_values_that_are_known(fitted: Stimulus) -> None:
    """Fitted to all runs, values would make up for a part of the loss."""
    told = explain(MODEL, [recorded(OP_AMP, fitted, (), NOISE_V, 1, fine=8)],
                   [recorded(OP_AMP, WALK, (LOSS,), NOISE_V, 2, fine=8)])  # fmt: skip
    assert [f.id for f in told.effects] == ["missing_samples"]
    assert told.effects[0].parameters["count"][0].value == 25.0
