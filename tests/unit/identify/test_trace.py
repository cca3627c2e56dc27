"""Does a trace refuse what cannot be a recording, and stay what it was?"""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.trace import Step, Trace, blocks, frozen_array, part, regrouped
from tests.trials import Shelf


def test_a_trace_is_frozen():
    trace = Trace("a", 1e3, np.zeros(3), np.ones(3))
    with pytest.raises(ValueError, match="read-only"):
        trace.y[0] = 2.0
    assert trace.size == 3
    assert (trace.intersample, trace.start_s, trace.valid, trace.from_rest) == ("held", 0.0, None, True)


def test_freezing_does_not_freeze_the_caller_s_array():
    y = np.zeros(3)
    trace = Trace("a", 1e3, np.zeros(3), y)
    y[0] = 1.0
    assert not trace.y.flags.writeable
    assert y.flags.writeable


def test_lists_and_integers_become_volts():
    assert Trace("a", 1e3, [0, 1], [1, 2]).u.dtype == np.float64


@pytest.mark.parametrize(
    ("rate_hz", "u", "y", "message"),
    [
        (1e3, np.zeros(3), np.zeros(2), "a: u has 3 samples and y has 2; both must be equal and > 0"),
        (1e3, np.zeros(0), np.zeros(0), "a: u has 0 samples and y has 0; both must be equal and > 0"),
        (0.0, np.zeros(2), np.zeros(2), "a: sample rate is 0.0 Hz, it must be > 0"),
        (float("nan"), np.zeros(2), np.zeros(2), "a: sample rate is nan Hz, it must be > 0"),
        (1e3, np.zeros((2, 2)), np.zeros((2, 2)), r"a signal has one dimension, this one has shape \(2, 2\)"),
    ],
)
def test_what_cannot_be_a_recording_is_refused(rate_hz, u, y, message):
    with pytest.raises(ValueError, match=message):
        Trace("a", rate_hz, u, y)


def test_a_frozen_array_shares_its_data():
    values = np.arange(4.0)
    assert np.shares_memory(frozen_array(values), values)


U = np.random.default_rng(0).normal(size=400)


def test_a_stored_signal_is_read_by_slices_or_whole():
    stored = Shelf(U.size, U)
    assert np.array_equal(np.asarray(stored), U)
    assert np.array_equal(stored[10:-20:7], U[10:-20:7])
    assert stored[30:20].size == 0
    with pytest.raises(ValueError, match="read forwards"):
        stored[::-1]


def test_a_part_is_read_where_the_whole_is():
    stretch = part(Shelf(U.size, U), 100, 300)
    assert stretch.size == 200
    assert np.array_equal(stretch[20:40], U[120:140])
    assert np.array_equal(stretch[-10:], U[290:300])
    assert np.array_equal(part(U, 100, 300), U[100:300])


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 30)), st.integers(1, 12))
def test_regrouping_keeps_all_values_in_order(sizes, size):
    bounds = np.cumsum([0, *sizes])
    groups = list(regrouped([U[a:b] for a, b in pairwise(bounds) if b <= U.size], size))
    whole = np.concatenate([np.empty(0), *groups])
    assert np.array_equal(whole, U[: whole.size])
    assert whole.size == max(b for b in bounds if b <= U.size)
    assert all(group.size == size for group in groups[:-1])
    assert all(0 < group.size <= size for group in groups[-1:])


def test_a_run_cut_short_ends_with_the_step_that_is_played():
    steps = (Step("a", "hold", 0, 50), Step("b", "hold", 50, 200), Step("c", "hold", 200, 400))
    trace = Trace("t", 1e3, Shelf(U.size, U), U, steps=steps, valid=U > 0.0)
    short = trace.until(120)
    assert short.size == short.y.size == short.valid.size == 120
    assert np.array_equal(short.u, U[:120])
    assert short.steps == (steps[0], Step("b", "hold", 50, 120))
    assert trace.until(400) is trace


def test_blocks_cover_a_stretch():
    assert list(blocks(3, 10, 3)) == [(3, 6), (6, 9), (9, 10)]
    assert list(blocks(3, 3)) == []
