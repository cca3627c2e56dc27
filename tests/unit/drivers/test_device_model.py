"""Do clock, FIFOs, flags, ramp and watchdog of the simulated device behave as on a board?"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.emulators.bench import Bench
from drivers.emulators.device_model import DeviceModel, Hardware, Ring, State
from rig.device import Capabilities, Identity
from rig.rigfile import parse_rig
from tests.rigs import GAIN

CAN = Capabilities(output_low_v=-10.0, output_high_v=10.0, input_low_v=-40.0, input_high_v=40.0, min_rate_hz=1.0,
                   max_rate_hz=10_000.0, output_bits=16, input_bits=24)


def model(output_fifo: int = 100, input_fifo: int = 50, history: int = 50, watchdog_s: float = 1.0) -> DeviceModel:
    hardware = Hardware(Identity("test", "1", "1"), CAN, output_fifo, input_fifo, history, 1e6, watchdog_s)
    return DeviceModel(hardware, Bench(parse_rig(GAIN, "test"), CAN))


def codes(*volts: float) -> np.ndarray:
    return model().bench.dac.codes(np.array(volts))


def running(device: DeviceModel, total: int, fed: int, rate_hz: float = 1000.0) -> DeviceModel:
    """Return ``device`` playing ``total`` samples of 2 V from time 0 on, ``fed`` of them in its FIFO."""
    device.arm(total, rate_hz, (1.0, 0.5), 0)
    assert device.push(0, np.full(fed, codes(2.0)[0]))
    device.go(0.0)
    return device


@given(st.integers(1, 20), st.lists(st.tuples(st.integers(0, 15), st.integers(0, 15)), max_size=12))
def test_a_ring_keeps_the_last_samples_under_their_numbers(size: int, puts: list[tuple[int, int]]) -> None:
    ring, at, kept = Ring(size), 0, {}
    for skip, wanted in puts:
        at += skip
        count = min(wanted, size)
        ring.put(at, np.arange(at, at + count) * 3)
        for number in range(at, at + count):
            kept = {k: v for k, v in kept.items() if k % size != number % size} | {number: number * 3}
        at += count
    found = {start + i: int(v) for start, values in ring.get(0, at) for i, v in enumerate(values)}
    assert found == {k: v for k, v in kept.items() if k >= at - size}


def test_sample_k_is_played_at_its_time_and_not_before() -> None:
    device = running(model(), 50, 50)
    for now_s, played in ((0.0, 1), (0.0005, 1), (0.00099, 1), (0.001, 2), (0.0101, 11)):
        device.advance(now_s)
        assert device.played == played


def test_time_does_not_drift_over_a_long_run() -> None:
    device = running(model(10_000, 10_000, watchdog_s=100.0), 10_000, 10_000, 9_000.0)
    rate_hz = device.achievable_rate(9_000.0)
    assert rate_hz == 1e6 / 111
    device.advance(9_999 / rate_hz - 1e-5)
    assert device.played == 9_999
    device.advance(9_999 / rate_hz)
    assert device.done


def test_the_input_reads_before_the_output_acts() -> None:
    device = running(model(), 3, 3)
    device.advance(1.0)
    taken = device.take(10)
    assert taken is not None
    assert device.bench.adc.volts(taken[1]) == pytest.approx([0.0, 6.0, 6.0], abs=1e-3)


def test_a_full_input_fifo_loses_the_newest_and_counts_them() -> None:
    device = running(model(), 100, 100)
    device.advance(0.0795)
    assert device.overrun_samples == 30
    first = device.take(1000)
    assert first is not None
    assert (first[0], first[1].size) == (0, 50)
    device.advance(0.0895)
    second = device.take(1000)
    assert second is not None
    assert (second[0], second[1].size) == (80, 10)
    assert device.overrun_samples == 30


def test_samples_lost_at_the_end_leave_nothing_to_take() -> None:
    device = running(model(), 80, 80)
    device.advance(1.0)
    assert device.take(1000) is not None
    assert device.take(1000) is None
    assert device.sent == 80


def test_what_was_sent_is_kept_for_a_while() -> None:
    device = running(model(), 100, 100)
    for now_s in (0.0395, 0.0795):
        device.advance(now_s)
        device.take(1000)
    assert [(start, values.size) for start, values in device.again(30, 60)] == [(30, 30)]
    device.advance(1.0)
    device.take(1000)
    device.arm(5, 1000.0, (0.0, 0.0), 0)
    assert device.again(30, 60) == []


def test_an_empty_output_fifo_ends_the_run_and_ramps_to_the_safe_level() -> None:
    device = running(model(), 100, 20)
    device.advance(0.0195)
    assert not device.underrun
    device.advance(0.0205)
    assert device.underrun
    assert device.played == 20
    device.advance(0.0205 + 0.25)
    assert device.level_v(0.2705) == pytest.approx(1.5, abs=1e-3)
    device.advance(0.53)
    assert device.level_v(0.53) == pytest.approx(1.0, abs=1e-3)
    assert device.state is State.IDLE


def test_output_blocks_must_follow_and_fit_and_may_be_repeated() -> None:
    device = model(output_fifo=100)
    assert not device.push(0, codes(1.0)), "nothing is armed"
    device.arm(500, 1000.0, (0.0, 0.1), 0)
    assert device.push(0, np.zeros(60, dtype=np.int32))
    assert not device.push(61, np.zeros(5, dtype=np.int32)), "there is a gap before it"
    assert device.push(30, np.zeros(40, dtype=np.int32)), "half of it is known"
    assert device.accepted == 70
    assert device.push(0, np.zeros(10, dtype=np.int32)), "all of it is known"
    assert not device.push(70, np.zeros(31, dtype=np.int32)), "it does not fit"
    assert device.push(70, np.zeros(30, dtype=np.int32))
    assert device.accepted == 100


def test_a_silent_host_brings_the_output_to_the_safe_level() -> None:
    device = running(model(output_fifo=5000, input_fifo=5000), 5000, 5000)
    device.heard(0.3)
    device.advance(1.25)
    assert device.level_v(1.25) == pytest.approx(2.0, abs=1e-3)
    device.advance(1.35)
    assert device.watchdog_tripped
    device.advance(1.9)
    assert device.level_v(1.9) == pytest.approx(1.0, abs=1e-3)
    assert device.state is State.IDLE


def test_a_held_level_is_watched_too_but_a_safe_one_is_left_alone() -> None:
    device = running(model(), 50, 50)
    device.halt(0.02)
    device.safe(-3.0, 0.1, 0.03)
    device.advance(10.0)
    assert device.level_v(10.0) == pytest.approx(-3.0, abs=1e-3)
    assert not device.watchdog_tripped
    running(device, 50, 50)
    device.heard(10.0)
    device._start_s = 10.0
    device.halt(10.02)
    device.advance(11.1)
    assert device.watchdog_tripped


def test_a_device_never_used_stays_without_a_level() -> None:
    device = model()
    device.advance(100.0)
    assert device.level_v(100.0) is None
    assert not device.watchdog_tripped


def test_a_ramp_can_be_turned_round() -> None:
    device = model()
    device.safe(4.0, 0.0, 0.0)
    device.safe(0.0, 1.0, 0.0)
    device.advance(0.5)
    device.safe(4.0, 1.0, 0.5)
    assert device.level_v(0.5) == pytest.approx(2.0, abs=1e-3)
    assert device.level_v(1.0) == pytest.approx(3.0, abs=1e-3)
