"""Are readings that are the one before once more told from the readings alone, and nothing that only looks so?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.chain import plain_chain, simulate
from identify.explain.explain import explain
from identify.noise import grid_step_v
from identify.readings.doubled import COARSE, doubled
from identify.readings.received import received
from identify.unnamed.correction import UNNAMED
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, noisy, recorded

NOISE_V = OP_AMP.noise_v
PLAYED = staircase("walk", FIG13_LEVELS_V, 0.05, 2), sine("wave", 10.0, 3.4, 10, 2)
CLEAN = [noisy(recorded(OP_AMP, s, start_s=4.0 * i), NOISE_V, i) for i, s in enumerate(PLAYED)]


def again(trace, share, seed):
    """Return a recording in which a share of the readings, by chance, is the one before once more; and which."""
    late = np.random.default_rng(seed).uniform(size=trace.size) < share
    late[0] = False
    at = np.maximum.accumulate(np.where(late, 0, np.arange(trace.size)))
    return replace(trace, y=trace.y[at]), late


@pytest.mark.parametrize("share", [0.004, 0.05, 0.5])
@pytest.mark.parametrize("lsb", [0.0, 0.1])
def test_their_share_is_told_and_all_of_them_are_left_out(share, lsb):
    step_v = lsb * NOISE_V
    traces = [replace(t, y=step_v * np.rint(t.y / step_v)) if lsb else t for t in CLEAN]
    made = [again(trace, share, seed) for seed, trace in enumerate(traces)]
    seen, told = doubled([trace for trace, _ in made], NOISE_V)
    if lsb and share < 0.01:
        assert not told  # oftener by steps alone
        return
    (blemish,) = told
    assert blemish.values["share"].low <= share <= blemish.values["share"].high * (1.0 if not lsb else 1.1)
    for trace, (_, late) in zip(seen, made, strict=True):
        assert not np.any(trace.valid & late)
        assert np.count_nonzero(~trace.valid & ~late) <= 0.06 * trace.size


@pytest.mark.parametrize("lsb", [0.0, 0.2, COARSE, 2.0])
def test_noise_in_steps_repeats_no_reading_oftener_than_it_does(lsb):
    step_v = lsb * NOISE_V
    traces = [replace(t, y=step_v * np.rint(t.y / step_v)) if lsb else t for t in CLEAN]
    seen, told = doubled(traces, NOISE_V)
    assert not told
    assert all(one is other for one, other in zip(seen, traces, strict=True))


@pytest.mark.parametrize(("lsb", "digits"), [(0.34, 3), (0.72, 3), (3.3, 2)])
def test_steps_that_a_table_gave_with_few_digits_are_steps_all_the_same(lsb, digits):
    """No grid holds them exactly: a converter of 0.343 mV with noise of 0.2 mV has 0.5 % of its readings twice."""
    step_v = lsb * NOISE_V
    traces = [replace(t, y=np.round(step_v * np.rint(t.y / step_v), digits)) for t in CLEAN]
    assert not grid_step_v(traces)
    assert sum(np.count_nonzero(np.diff(t.y) == 0.0) for t in traces) > 0.005 * sum(t.size for t in traces)
    assert not doubled(traces, NOISE_V)[1]


def test_what_rests_without_noise_is_no_reading_once_more():
    quiet = [replace(t, y=simulate(plain_chain(model_of(OP_AMP)), t)) for t in CLEAN]
    still = np.mean(np.concatenate([np.diff(t.y) == 0.0 for t in quiet]))
    held = [replace(t, y=np.repeat(t.y[::50], 50)[: t.size]) for t in CLEAN]  # a converter far slower than its clock
    assert still > 0.05
    for traces in (quiet, held):
        assert not doubled(traces, 1e-6)[1]


def test_they_are_told_once_and_what_is_left_is_noise():
    """Half of them: the others are as good as ever."""
    late = [again(trace, 0.5, seed)[0] for seed, trace in enumerate(CLEAN)]
    told = explain(model_of(OP_AMP), late)
    assert told.verdict == "unexplained"
    assert [(f.form, f.stage) for f in told.effects] == [("doubled readings", "sense")]
    assert told.remaining.over_noise == pytest.approx(1.0, abs=0.05)


def test_nothing_of_it_is_told_where_the_unnamed_is_left_out():
    late = [again(trace, 0.1, seed)[0] for seed, trace in enumerate(CLEAN)]
    assert len(received(late, (), NOISE_V, ())[1]) == 1
    assert received(late, (), NOISE_V, (UNNAMED,))[1] == ()
