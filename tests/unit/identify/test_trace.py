"""Does a trace refuse what cannot be a recording, and stay what it was?"""

import numpy as np
import pytest

from identify.trace import Trace, frozen_array


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
