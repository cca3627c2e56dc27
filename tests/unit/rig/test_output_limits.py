"""Is every sample that must not reach the output refused, and named?"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.device import Capabilities
from rig.errors import RefusedError
from rig.output_limits import check_level, check_samples, narrowest
from rig.plan import Limits

CAN = Capabilities(output_low_v=-1.0, output_high_v=4.0, input_low_v=-1.0, input_high_v=1.0, min_rate_hz=1.0,
                   max_rate_hz=1000.0, output_bits=10, input_bits=10)


def limits(low: float = -10.0, high: float = 10.0, slew: float | None = None) -> Limits:
    return Limits(low, high, slew)


def test_the_narrower_of_plan_and_device_counts_on_each_side() -> None:
    assert narrowest(limits(-0.5, 9.0), CAN) == (-0.5, 4.0)
    assert narrowest(limits(-9.0, 3.0), CAN) == (-1.0, 3.0)


def test_limits_beside_the_device_leave_nothing() -> None:
    with pytest.raises(RefusedError, match=r"limits 5 to 6 V; allowed: -1 to 4 V on this device"):
        narrowest(limits(5.0, 6.0), CAN)


@given(st.lists(st.floats(-20, 20), min_size=1, max_size=30), st.floats(-5, 0), st.floats(0, 5))
def test_exactly_the_samples_out_of_range_are_refused(values: list[float], low: float, high: float) -> None:
    u, slack = np.array(values), 0.5 * CAN.output_lsb_v + 1e-12
    bad = (u < max(low, -1.0) - slack) | (u > min(high, 4.0) + slack)
    if not bad.any():
        check_samples(u, 1000.0, limits(low, high), CAN)
        return
    with pytest.raises(RefusedError, match=f"at sample {int(bad.argmax())} "):
        check_samples(u, 1000.0, limits(low, high), CAN)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_no_level_is_refused_before_its_size_is_looked_at(value: float) -> None:
    with pytest.raises(RefusedError, match="sample 2 is"):
        check_samples(np.array([0.0, 1.0, value]), 1000.0, limits(), CAN)


def test_the_message_tells_level_time_and_what_is_allowed() -> None:
    with pytest.raises(RefusedError, match=r"3\.5 V at sample 2 \(0\.2 s\); allowed: -1 to 3 V; lower the level"):
        check_samples(np.array([0.0, 1.0, 3.5]), 10.0, limits(high=3.0), CAN)


def test_too_steep_a_slope_is_refused_where_it_is() -> None:
    u = np.array([0.0, 0.5, 0.5, -0.5])
    check_samples(u, 100.0, limits(slew=100.0), CAN)
    with pytest.raises(RefusedError, match=r"100 V/s at sample 3 \(0\.03 s\); allowed: at most 99 V/s"):
        check_samples(u, 100.0, limits(slew=99.0), CAN)


def test_rounding_to_a_code_does_not_break_a_limit_that_was_kept() -> None:
    lsb_v = CAN.output_lsb_v
    check_samples(np.array([3.0 + 0.49 * lsb_v]), 100.0, limits(high=3.0), CAN)
    check_samples(np.array([0.0, 1.0 + 0.99 * lsb_v]), 100.0, limits(slew=100.0), CAN)
    with pytest.raises(RefusedError):
        check_samples(np.array([3.0 + 0.6 * lsb_v]), 100.0, limits(high=3.0), CAN)
    with pytest.raises(RefusedError):
        check_samples(np.array([0.0, 1.0 + 1.1 * lsb_v]), 100.0, limits(slew=100.0), CAN)


@pytest.mark.parametrize("level", [-1.1, 2.1, np.nan, np.inf])
def test_a_level_out_of_range_is_refused_by_its_name(level: float) -> None:
    with pytest.raises(RefusedError, match="the resting level is out of range"):
        check_level(level, limits(high=2.0), CAN, name="resting level")


def test_without_a_plan_the_device_alone_limits_a_level() -> None:
    check_level(4.0, None, CAN, name="safe level")
    with pytest.raises(RefusedError, match="-1 to 4 V"):
        check_level(4.1, None, CAN, name="safe level")
