"""Does every registered driver keep the device contract?

A new driver is tested by being registered and naming its emulator (``Device.emulator``), or overriding ``simulated``.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from drivers import ngspice
from identify.trace import Step
from rig.device import POLL_S, Array, Device, Flag
from rig.errors import DeviceError, RefusedError
from rig.plan import Limits, Plan
from rig.recording import Writer
from rig.registry import connect, driver, driver_at, drivers
from rig.runner import run
from rig.session import equipment
from tests.rigs import GAIN, QUIET
from tests.wire.simavr.bench import on_simavr
from tests.wire.simavr.built import missing
from tests.wire.waiting import in_time

LIMITS = Limits(-10.0, 10.0, None)
RATE_HZ, LONG_RATE_HZ = 10_000.0, 20_000.0
LONG_RUN_S = 2.0
RATES_HZ = (1000.0, 9_999.0, 10_000.0, 33_333.3)
Bench = Callable[[str], AbstractContextManager[str]]


def waves(size: int = 3000) -> Array:
    """Return u that drives the gap of QUIET through both borders: about 6 Hz, and fast ripple on it."""
    return 8.0 * np.sin(np.arange(size) * 0.004) + 0.5 * np.sin(np.arange(size) * 1.1)


def pulses() -> Array:
    """Return u that is 0 V but for three single samples."""
    u = np.zeros(200)
    u[[0, 7, 150]] = 2.0, -1.0, 3.0
    return u


HALF, HIGH, HIGHER = np.full(10, 0.5), np.full(20, 4.0), np.full(100, 9.0)
RISE, LONG_RISE = np.linspace(0.0, 3.0, 50), np.linspace(0.0, 9.0, 60_000)
PLAYED = (
    *((u, RATE_HZ) for u in (waves(20_000), -waves(60_000), pulses(), HALF, HIGH, HIGHER, RISE, LONG_RISE)),
    (0.35 * waves(100_000), LONG_RATE_HZ), (np.zeros(4), 1.0), *((np.zeros(4), rate_hz) for rate_hz in RATES_HZ),
)
"""All that this suite plays, with its rates; a stimulus may also be the beginning of one of these."""


def fitting(device: Device, u: Array) -> Array:
    """Return as much of ``u`` as the device plays in one run."""
    return u[:device.capabilities().max_samples]


SPEED = 5.0
"""Of the clocks of emulated devices."""
FIRMWARE_SPEED = 4.0
"""Of the processor's clock in simavr, at most; more of it is more than a computer does."""


@contextmanager
def by_existing(scheme: str, folder: Path, rig: str) -> Iterator[str]:
    """Give the address of a device of a registered kind, simulated by its own emulator: being a driver is enough."""
    path = folder / f"{abs(hash(rig))}.yaml"
    path.write_text(rig)
    with driver(scheme).simulated(str(path), SPEED) as where:
        yield f"{scheme}:{where}"


@contextmanager
def replayed(folder: Path, rig: str) -> Iterator[str]:
    """Give the address of what the loopback recorded of all that is played here: a replay answers nothing else."""
    kept = folder / f"{abs(hash(rig))}"
    if not kept.exists():
        with by_existing("loopback", folder, rig) as address, connect(address) as device:
            keep(device, kept)
    yield f"replay:{kept}"


def keep(device: Device, folder: Path) -> None:
    """Record every stimulus of this suite into ``folder``."""
    folder.mkdir()
    for index, (u, rate_hz) in enumerate(PLAYED):
        plan = Plan("contract", device.quantise(u), rate_hz, (Step("all", "table", 0, u.size),), LIMITS)
        with Writer(folder / f"{index}.h5", plan, equipment("loopback:", device, rate_hz)) as writer:
            outcome = run(plan, device, writer)
            writer.finish(outcome.complete, outcome.reason, outcome.events)


@contextmanager
def firmware(folder: Path, rig: str) -> Iterator[str]:
    """Give the address of the firmware of the serial DAQ, run by simavr: the same driver, not our device model."""
    with on_simavr(rig, speed=FIRMWARE_SPEED) as board:
        yield board.address


BENCHES: dict[str, Callable[[Path, str], AbstractContextManager[str]]] = {
    **{scheme: partial(by_existing, scheme) for scheme in drivers()},
    **({"replay": replayed} if "replay" in drivers() else {}),
    "firmware": firmware,
}
NEEDS = {
    "firmware": pytest.mark.skipif(bool(missing()), reason=missing()),
    "spice": pytest.mark.skipif(bool(ngspice.missing()), reason=ngspice.missing()),
}
"""What keeps a bench from being tried."""


@pytest.fixture(scope="module", params=[pytest.param(name, marks=NEEDS.get(name, ())) for name in sorted(BENCHES)])
def bench(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return partial(BENCHES[request.param], tmp_path_factory.mktemp(request.param))


@pytest.fixture(scope="module")
def quiet(bench: Bench) -> Iterator[str]:
    with bench(QUIET) as address:
        yield address


@pytest.fixture(scope="module")
def gain(bench: Bench) -> Iterator[str]:
    with bench(GAIN) as address:
        yield address


@pytest.fixture
def device(quiet: str) -> Iterator[Device]:
    with connect(quiet) as device:
        yield device
        device.safe(0.0, 0.0)


@pytest.fixture
def amplifier(gain: str) -> Iterator[Device]:
    with connect(gain) as device:
        yield device
        device.safe(0.0, 0.0)


def rate_of(device: Device, rate_hz: float = RATE_HZ) -> float:
    """Return the rate nearest to ``rate_hz`` that the device can make."""
    can = device.capabilities()
    return device.achievable_rate(min(max(rate_hz, can.min_rate_hz), can.max_rate_hz))


def record(device: Device, u: Array, rate_hz: float = RATE_HZ) -> Array:
    """Return what was read, at ``rate_hz`` or near it; every sample must come once and in order."""
    y, expected = np.full(u.size, np.nan), 0
    for block in device.stream(u, rate_of(device, rate_hz), LIMITS):
        assert block.start == expected
        y[block.start:block.stop] = block.y
        expected = block.stop
    assert expected == u.size
    assert np.isfinite(y).all()
    return y


def test_identity_is_told_and_stays(quiet: str) -> None:
    with connect(quiet) as one:
        first = one.identity()
        assert all((first.model, first.serial, first.firmware))
    with connect(quiet) as two:
        assert two.identity() == first == two.identity()


def test_capabilities_are_possible(device: Device) -> None:
    can = device.capabilities()
    assert can.output_low_v < can.output_high_v
    assert can.input_low_v < can.input_high_v
    assert 0 < can.min_rate_hz <= can.max_rate_hz
    assert can.output_bits >= 8
    assert can.input_bits >= 8
    assert can.buffer_samples is None or can.buffer_samples > 0


def test_connecting_leaves_the_output_alone(quiet: str) -> None:
    with connect(quiet) as device:
        before = device.level_v()
    with connect(quiet) as device:
        device.identity()
        device.capabilities()
        assert device.level_v() == before


def test_quantising_rounds_to_the_nearest_code_and_only_once(device: Device) -> None:
    u = np.linspace(-9.9, 9.9, 1001)
    rounded = device.quantise(u)
    assert np.abs(rounded - u).max() <= 0.501 * device.capabilities().output_lsb_v
    assert np.array_equal(device.quantise(rounded), rounded)
    assert device.quantise(np.zeros(1))[0] == 0.0


def test_the_ends_of_the_range_can_be_put_out(device: Device) -> None:
    can = device.capabilities()
    ends = np.array([can.output_low_v, can.output_high_v])
    assert np.allclose(device.quantise(ends), ends, atol=1.01 * can.output_lsb_v, rtol=0)


def test_levels_beyond_the_range_are_refused_not_clipped(device: Device) -> None:
    can = device.capabilities()
    with pytest.raises(RefusedError, match="out of the device's range"):
        device.quantise(np.array([0.0, can.output_high_v + 2 * can.output_lsb_v]))


def test_a_rate_the_clock_makes_is_made_exactly(device: Device) -> None:
    can = device.capabilities()
    possible = [rate_hz for rate_hz in RATES_HZ if can.min_rate_hz <= rate_hz <= can.max_rate_hz]
    assert possible
    for wanted in possible:
        made = device.achievable_rate(wanted)
        assert made == pytest.approx(wanted, rel=1e-3)
        assert device.achievable_rate(made) == made


def test_a_rate_beyond_the_clock_is_refused(device: Device) -> None:
    can = device.capabilities()
    for rate_hz in (can.max_rate_hz * 1.01, can.min_rate_hz * 0.5, float("nan"), 0.0):
        with pytest.raises(RefusedError, match="cannot sample at this rate"):
            device.achievable_rate(rate_hz)


@pytest.mark.parametrize(("u", "limits", "safe_level_v", "message"), [
    (np.array([0.0, 5.1]), Limits(-5.0, 5.0, None), 0.0, "5.1 V at sample 1"),
    (np.array([0.0, np.nan]), LIMITS, 0.0, "sample 1 is nan"),
    (np.array([0.0, 1.0]), Limits(-5.0, 5.0, 100.0), 0.0, "V/s at sample 1"),
    (np.empty(0), LIMITS, 0.0, "nothing to output"),
    (np.zeros((2, 2)), LIMITS, 0.0, "nothing to output"),
    (np.zeros(3), Limits(-5.0, 5.0, None), 6.0, "safe level"),
    (np.zeros(3), LIMITS, float("nan"), "safe level"),
    (np.zeros(3), Limits(20.0, 30.0, None), 25.0, "no output level is allowed"),
])
def test_what_must_not_be_played_is_refused_before_any_output(
    device: Device, u: Array, limits: Limits, safe_level_v: float, message: str,
) -> None:
    record(device, HALF)
    with pytest.raises(RefusedError, match=message):
        device.stream(u, rate_of(device), limits, safe_level_v)
    assert device.level_v() == device.quantise(np.array([0.5]))[0]


def test_checking_returns_what_would_be_put_out_and_outputs_nothing(device: Device) -> None:
    record(device, HALF)
    u = waves(50)
    assert np.array_equal(device.check(u, rate_of(device), LIMITS), device.quantise(u))
    assert device.level_v() == device.quantise(np.array([0.5]))[0]


def test_an_impossible_safe_level_or_ramp_is_refused(device: Device) -> None:
    with pytest.raises(RefusedError, match="safe level"):
        device.safe(device.capabilities().output_high_v * 1.1)
    with pytest.raises(RefusedError, match="ramp"):
        device.safe(0.0, -1.0)


def test_y_is_read_just_before_u_acts(amplifier: Device) -> None:
    u = pulses()
    y = record(amplifier, u)
    expected = 3.0 * np.concatenate([[0.0], amplifier.quantise(u)[:-1]])
    assert np.abs(y - expected).max() <= 0.501 * amplifier.capabilities().input_lsb_v


def test_a_long_run_comes_back_whole(amplifier: Device) -> None:
    size = min(100_000, round(LONG_RUN_S * amplifier.capabilities().max_rate_hz))
    u = amplifier.quantise(fitting(amplifier, 0.35 * waves(size)))
    y = in_time(lambda: record(amplifier, u, LONG_RATE_HZ))
    assert np.abs(y[1:] - 3.0 * u[:-1]).max() <= 0.501 * amplifier.capabilities().input_lsb_v


def test_all_inputs_are_read_at_the_same_instants_or_as_the_device_says(amplifier: Device) -> None:
    """Simulated devices have their second input at their own output, where the first reads three times as much.

    A multiplexer comes to the second between the first and the next first: it sees the level that y answers to then.
    """
    can = amplifier.capabilities()
    if can.inputs < 2:
        pytest.skip("this device has one input")
    (y, second), expected = np.full((2, pulses().size), np.nan), 0
    for block in amplifier.stream(pulses(), rate_of(amplifier), LIMITS, inputs=can.inputs):
        assert block.start == expected
        expected = block.stop
        if block.y.size:
            assert block.further.shape == (can.inputs - 1, block.y.size)
            y[block.start:block.stop], second[block.start:block.stop] = block.y, block.further[0]
    assert expected == pulses().size
    earlier = 1 if can.multiplexed else 0
    assert np.abs(y[earlier:] - 3.0 * second[:y.size - earlier]).max() <= 2.01 * can.input_lsb_v
    assert record(amplifier, pulses()).max() > 1.0, "a run of one input follows one of several"


def test_more_inputs_than_there_are_are_refused(device: Device) -> None:
    for inputs in (0, device.capabilities().inputs + 1):
        with pytest.raises(RefusedError, match="has not so many inputs"):
            device.check(np.zeros(3), rate_of(device), LIMITS, inputs=inputs)


def test_the_end_of_the_input_range_is_flagged(amplifier: Device) -> None:
    can = amplifier.capabilities()
    flags, top = Flag.NONE, -np.inf
    for block in amplifier.stream(HIGHER, rate_of(amplifier), LIMITS):
        flags |= block.flags
        top = max(top, float(block.y.max(initial=-np.inf)))
    assert Flag.CLIPPED in flags
    assert top == pytest.approx(can.input_high_v, abs=can.input_lsb_v)


def test_two_runs_begin_alike(device: Device) -> None:
    first = record(device, waves())
    assert np.ptp(first) > 1.0
    assert np.array_equal(record(device, waves()), first)


def test_the_output_holds_the_last_level_of_a_run(device: Device) -> None:
    record(device, RISE)
    assert device.level_v() == device.quantise(np.array([3.0]))[0]


def test_safe_returns_when_the_level_is_reached(device: Device) -> None:
    record(device, HIGH)
    for level, ramp_s in ((1.0, 0.2), (-1.0, 0.0)):
        device.safe(level, ramp_s)
        assert device.level_v() == pytest.approx(level, abs=device.capabilities().output_lsb_v)


def test_a_run_left_early_stops_and_can_be_made_safe(device: Device) -> None:
    blocks = device.stream(fitting(device, LONG_RISE), rate_of(device), LIMITS)
    for block in blocks:
        if block.y.size:
            break
    blocks.close()  # type: ignore[attr-defined]
    held = device.level_v()
    assert held is not None
    assert held < 8.0
    time.sleep(0.05)
    assert device.level_v() == held
    device.safe(0.0)
    assert device.level_v() == 0.0


def test_a_run_after_one_left_early_is_its_own(device: Device) -> None:
    whole = in_time(lambda: record(device, waves(), RATE_HZ))
    for block in device.stream(fitting(device, -waves(60_000)), rate_of(device), LIMITS):
        if block.y.size:
            break
    assert np.array_equal(record(device, waves()), whole)


def test_the_caller_is_never_kept_waiting_long(device: Device) -> None:
    before, longest = time.monotonic(), 0.0
    for _ in device.stream(np.zeros(4), rate_of(device, 1.0), LIMITS):
        now = time.monotonic()
        longest, before = max(longest, now - before), now
    assert longest < 3 * POLL_S


def test_a_port_has_one_owner(quiet: str) -> None:
    kind, where = driver_at(quiet)
    with connect(quiet) as device:
        if kind.port(where) is None:
            connect(quiet).close()
        else:
            with pytest.raises(DeviceError, match=r"in use: by process \d+ .*close the program that holds the port"):
                connect(quiet)
        assert device.identity()
    connect(quiet).close()


def test_closing_twice_is_harmless(quiet: str) -> None:
    with connect(quiet) as device:
        device.close()
    device.close()


def converters(device: Device) -> tuple[float, ...]:
    """Return the ranges and bits that decide what a sample is rounded to."""
    can = device.capabilities()
    return (can.output_low_v, can.output_high_v, can.output_bits, can.input_low_v, can.input_high_v, can.input_bits)


def test_drivers_with_equal_converters_give_the_same_recording_to_the_last_bit(tmp_path: Path) -> None:
    recordings: dict[tuple[float, ...], list[Array]] = {}
    for name in set(BENCHES) - set(NEEDS):  # tests/wire/test_firmware.py has the same of the firmware
        with BENCHES[name](tmp_path, QUIET) as address, connect(address) as device:
            recordings.setdefault(converters(device), []).append(record(device, fitting(device, waves(20_000))))
            device.safe()
    assert max(map(len, recordings.values())) > 1
    for alike in recordings.values():
        assert np.ptp(alike[0]) > 1.0
        assert all(np.array_equal(other, alike[0]) for other in alike[1:])
