"""Does a cable tell delay, gain, offset, noise and steps, and claim no more than it shows?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.calibration import Pass, at_once, measured
from identify.interval import Interval
from tests.unit.identify.calibration.cables import Wire

RC = Wire(delay_s=37e-6, constant_s=1e-4, gain=1.003, offset_v=2e-3)


def holds(interval: Interval | None, truth: float) -> bool:
    return interval is not None and interval.low <= truth <= interval.high


def test_a_tail_over_several_samples_tells_the_delay_to_a_part_of_one() -> None:
    told = measured(RC.passes())
    assert holds(told.delay, 37e-6)
    assert told.delay.high - told.delay.low < 1e-7
    assert holds(told.time_constant, 1e-4)
    assert holds(told.skew_ppm, 0.0)
    assert not told.warnings


def test_a_plain_cable_tells_no_more_than_the_sample() -> None:
    told = measured(Wire(delay_s=37e-6).passes())
    assert told.delay.low == pytest.approx(0.0, abs=1e-9)
    assert told.delay.high == pytest.approx(1e-4, rel=1e-3)
    assert told.time_constant.low == 0.0


@pytest.mark.parametrize("delay_s", [2.37e-4, 5.02e-3])
def test_a_delay_of_many_samples_is_found(delay_s: float) -> None:
    told = measured(replace(RC, delay_s=delay_s).passes())
    assert holds(told.delay, delay_s)
    assert told.delay.high - told.delay.low < 1e-7


def test_an_input_read_too_late_has_a_delay_below_0() -> None:
    told = measured(replace(RC, delay_s=-3e-5).passes())
    assert holds(told.delay, -3e-5)
    assert told.delay.high < 0.0


def test_gain_offset_noise_and_step_are_told() -> None:
    told = measured(replace(RC, step_v=2e-5).passes())
    assert holds(told.gain, 1.003)
    assert told.gain.high - told.gain.low < 1e-4
    assert holds(told.offset, 2e-3)
    assert told.offset.high - told.offset.low < 1e-4
    assert holds(told.noise, 1e-3)
    assert holds(told.step, 2e-5)
    assert measured(RC.passes()).step is None


@pytest.mark.parametrize("offset_v", [0.0, 0.004, -0.0049])
def test_steps_that_no_noise_blurs_leave_half_a_step_of_doubt(offset_v: float) -> None:
    """DAC and ADC with the same steps: every pass rounds alike, and their agreement says nothing."""
    wire = Wire(constant_s=0.0, noise_v=0.0, step_v=0.01, offset_v=offset_v)
    passes = [Pass(np.rint(one.u / 0.01) * 0.01, one.y, one.rate_hz) for one in wire.passes()]
    passes = [replace(one, y=np.rint((np.append(0.0, one.u[:-1]) + offset_v) / 0.01) * 0.01) for one in passes]
    told = measured(passes)
    assert holds(told.offset, offset_v)
    assert holds(told.gain, 1.0)


def test_clocks_that_drift_apart_are_told() -> None:
    told = measured(replace(RC, skew=50e-6).passes())
    assert holds(told.skew_ppm, 50.0)
    assert told.skew_ppm.low > 40.0


def test_what_is_no_cable_with_one_time_constant_is_said() -> None:
    told = measured(replace(RC, second_s=7e-5).passes())
    assert any("no dead time with one time constant" in text for text in told.warnings)


def test_starts_that_differ_are_said_and_widen_the_interval() -> None:
    passes = [replace(RC, delay_s=delay).passed(1e4, 2000, index) for index, delay in enumerate(
        37e-6 + 2e-6 * np.random.default_rng(5).standard_normal(8))]
    told = measured(passes)
    assert any("the start is not the same" in text for text in told.warnings)
    assert holds(told.delay, 37e-6)
    assert told.delay.high - told.delay.low > 1e-6


def test_without_a_cable_nothing_is_told() -> None:
    silent = [replace(one, y=1e-3 * np.random.default_rng(7).standard_normal(one.u.size)) for one in RC.passes()]
    with pytest.raises(ValueError, match="is the cable in place"):
        measured(silent)
    assert at_once(silent[0])[1] < 0.1
    gain, share = at_once(RC.passes()[0])
    assert gain == pytest.approx(1.003, rel=1e-3)
    assert share > 0.99


def test_a_run_that_is_too_short_is_refused() -> None:
    with pytest.raises(ValueError, match="too few"):
        measured(RC.passes(size=30))
