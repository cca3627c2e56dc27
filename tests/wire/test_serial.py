"""Is every sample accounted for, and the output safe, when a run goes over a real pty and things go wrong?"""

import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.emulators.faults import Fault, Faults, What
from drivers.serial_daq import SerialDaq
from identify.trace import Step
from rig.device import Block, Device, Flag
from rig.errors import DeviceError, IncompleteError, StarvedError
from rig.plan import Limits, Plan
from rig.recording import Entry, read
from rig.registry import connect
from tests.rigs import GAIN, QUIET
from tests.wire.emulated import Emulated, emulated
from tests.wire.host import record
from tests.wire.waiting import eventually

LIMITS = Limits(-10.0, 10.0, None)


def waves(size: int) -> np.ndarray:
    return 5.0 * np.sin(np.arange(size) * 0.01)


def plan_of(u: np.ndarray, rate_hz: float) -> Plan:
    return Plan("a run", u, rate_hz, (Step("all", "table", 0, u.size),), LIMITS, 1.0, 0.1)


def happening(what: What, at_sample: int, seconds: float = math.inf) -> Faults:
    """Return the script in which one thing happens to the device in the middle of a run."""
    return Faults((Fault(what, at_sample=at_sample, seconds=seconds),))


def tripled(device: Device, u: np.ndarray) -> np.ndarray:
    """Return what GAIN answers to ``u``."""
    return 3.0 * np.concatenate([[0.0], device.quantise(u)[:-1]])


def test_a_run_at_full_speed_in_real_time_is_recorded_whole(tmp_path: Path) -> None:
    u, rate_hz = waves(10_000), 10_000.0
    with emulated(GAIN) as bench:
        begun = time.monotonic()
        outcome = record(plan_of(u, rate_hz), bench.address, tmp_path / "run.h5")
        took_s = time.monotonic() - begun
        with connect(bench.address) as device:
            expected, lsb_v = tripled(device, u), device.capabilities().input_lsb_v
        assert bench.look().level_v == pytest.approx(1.0, abs=1e-3)
    recording = read(tmp_path / "run.h5")
    assert outcome.complete
    assert outcome.samples == u.size
    assert recording.complete
    assert (recording.ledger == Entry.RECORDED).all()
    assert np.abs(recording.y - expected).max() <= 0.5001 * lsb_v
    assert took_s >= (u.size - 1) / rate_hz, "the device's clock does not run in real time"


@pytest.mark.parametrize("faults", [
    Faults(drop=2e-4, corrupt=2e-4, spare=3000, seed=1), Faults(drop=5e-4, spare=3000, seed=2),
    Faults(corrupt=5e-4, spare=3000, seed=3),
], ids=["both", "dropped", "corrupted"])
def test_samples_lost_on_the_link_are_sent_again(faults: Faults) -> None:
    u = waves(10_000)
    with emulated(GAIN, faults=faults, speed=2) as bench, connect(bench.address) as device:
        y, flags = np.full(u.size, np.nan), Flag.NONE
        for block in device.stream(u, 10_000.0, LIMITS):
            y[block.start:block.stop] = block.y
            flags |= block.flags
        assert np.abs(y - tripled(device, u)).max() <= 0.5001 * device.capabilities().input_lsb_v
    assert flags == Flag.RESENT, "the link lost nothing, or more than it had to"


def test_a_slow_link_changes_nothing() -> None:
    u = waves(4000)
    with emulated(GAIN, faults=Faults(delay_s=0.08)) as bench, connect(bench.address) as device:
        y = np.concatenate([block.y for block in device.stream(u, 10_000.0, LIMITS)])
        assert np.abs(y - tripled(device, u)).max() <= 0.5001 * device.capabilities().input_lsb_v


def test_what_the_input_fifo_cannot_hold_is_flagged_and_entered_as_lost(tmp_path: Path) -> None:
    u = waves(10_000)
    with emulated(GAIN, faults=happening(What.MUTE, 2000, 0.4), input_fifo=1024) as bench:
        outcome = record(plan_of(u, 10_000.0), bench.address, tmp_path / "run.h5")
        seen = bench.look()
        with connect(bench.address) as device:
            expected, lsb_v = tripled(device, u), device.capabilities().input_lsb_v
    recording = read(tmp_path / "run.h5")
    here = recording.ledger == Entry.RECORDED
    assert isinstance(outcome.failure, IncompleteError)
    assert seen.overrun_samples > 1000
    assert (recording.ledger == Entry.LOST).sum() == u.size - outcome.samples == seen.overrun_samples
    assert np.abs(recording.y[here] - expected[here]).max() <= 0.5001 * lsb_v
    assert any(event.kind == "lost" and "overrun" in event.text for event in outcome.events)


def test_samples_lost_at_the_very_end_are_accounted_for() -> None:
    with emulated(GAIN, faults=happening(What.MUTE, 500, 0.4), input_fifo=256) as bench:
        with connect(bench.address) as device:
            blocks = [block for block in device.stream(waves(3000), 10_000.0, LIMITS) if block.start or block.y.size]
        assert blocks[-1].stop == 3000
        assert sum(block.y.size for block in blocks) == 3000 - bench.look().overrun_samples
        assert any(block.flags & Flag.OVERRUN for block in blocks)


def test_a_host_too_slow_to_fill_the_fifo_ends_the_run_safely() -> None:
    with emulated(GAIN, output_fifo=1024) as bench, connect(bench.address) as device:
        blocks = device.stream(np.full(20_000, 5.0), 10_000.0, LIMITS, 1.0, 0.1)
        while (received := next(blocks).stop) < 500:
            pass
        time.sleep(0.3)
        rest: list[Block] = []
        with pytest.raises(DeviceError, match="ran out of output samples"):
            rest.extend(blocks)
        seen = bench.look()
        assert seen.underrun
        assert max(block.stop for block in rest) == seen.played, "samples read before the run ended were kept back"
        assert received < seen.played < 20_000
        assert eventually(lambda: bench.look().level_v == pytest.approx(1.0, abs=1e-3), 1.0)


def test_the_watchdog_acts_while_the_host_sleeps() -> None:
    with emulated(GAIN, watchdog_s=0.25) as bench, connect(bench.address) as device:
        blocks = device.stream(np.full(20_000, 5.0), 10_000.0, LIMITS, 1.0, 0.1)
        while next(blocks).stop < 1000:
            pass
        assert bench.look().level_v == pytest.approx(5.0, abs=1e-3)
        time.sleep(0.5)
        assert bench.look().watchdog_tripped
        assert bench.look().level_v == pytest.approx(1.0, abs=1e-3)
        with pytest.raises(DeviceError, match="heard nothing from the host"):
            list(blocks)


@pytest.mark.parametrize("sleeps", [1, 2])
@pytest.mark.parametrize("before", ["_fill", "_go"])
def test_a_host_that_sleeps_before_it_says_go_begins_once_more(
    before: str, sleeps: int, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    awake, left = getattr(SerialDaq, before), [0.6] * sleeps

    def drowsy(device: SerialDaq, run: object) -> None:
        time.sleep(left.pop() if left else 0.0)
        awake(device, run)

    monkeypatch.setattr(SerialDaq, before, drowsy)
    u = waves(2000)
    with emulated(GAIN, watchdog_s=0.25) as bench, connect(bench.address) as device:
        blocks = device.stream(u, 10_000.0, LIMITS, 1.0, 0.1)
        if sleeps == 1:
            y = np.concatenate([block.y for block in blocks])
            assert np.abs(y - tripled(device, u)).max() <= device.capabilities().input_lsb_v
        else:
            with pytest.raises(StarvedError, match="heard nothing from the host"):
                list(blocks)
            assert bench.look().level_v == pytest.approx(1.0, abs=1e-3)


def test_a_host_that_listens_keeps_the_watchdog_quiet() -> None:
    with emulated(GAIN, watchdog_s=0.6) as bench, connect(bench.address) as device:
        y = np.concatenate([block.y for block in device.stream(np.full(150, 2.0), 100.0, LIMITS)])
        assert y.size == 150
        assert not bench.look().watchdog_tripped


def test_a_device_that_dies_is_reported_and_what_came_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.serial_link.BACK_S", 0.3)
    with emulated(GAIN, faults=happening(What.TORN, 5000)) as bench:
        outcome = record(plan_of(waves(20_000), 10_000.0), bench.address, tmp_path / "run.h5")
    assert isinstance(outcome.failure, DeviceError)
    assert outcome.failure.exit_code == 3
    assert "switch the rig off by hand" in outcome.reason
    assert any("gone" in event.text for event in outcome.events)
    recording = read(tmp_path / "run.h5")
    assert not recording.complete
    assert 4000 < outcome.samples == (recording.ledger == Entry.RECORDED).sum() <= 6000


def test_a_device_that_hangs_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rig.device.STALL_S", 0.5)
    monkeypatch.setattr("drivers.serial_link.REPLY_S", 0.1)
    with emulated(GAIN, faults=happening(What.HUNG, 2000)) as bench:
        outcome = record(plan_of(waves(20_000), 10_000.0), bench.address, tmp_path / "run.h5")
        assert bench.look().level_v != pytest.approx(1.0, abs=1e-3)
    assert isinstance(outcome.failure, DeviceError)
    assert "not confirmed safe" in outcome.reason
    assert 1000 < outcome.samples < 3000


def test_what_is_left_of_abandoned_runs_is_not_taken_for_the_next() -> None:
    with emulated(GAIN, speed=5) as bench, connect(bench.address) as device:
        for sign in [1.0, -1.0] * 10:
            u = sign * waves(60_000)
            expected = tripled(device, u)
            for block in device.stream(u, 20_000.0, LIMITS):
                wrong = np.abs(block.y - expected[block.start:block.stop]).max(initial=0.0)
                assert wrong <= 0.5001 * device.capabilities().input_lsb_v
                if block.stop > 3000:
                    break


@pytest.fixture
def hosted(tmp_path: Path) -> Iterator[tuple[Emulated, subprocess.Popen[str], Path]]:
    """A host process that plays 5 V on a device with a watchdog of 0.5 s, in the middle of the run."""
    path = tmp_path / "run.h5"
    with emulated(GAIN, watchdog_s=0.5) as bench:
        command = [sys.executable, "-m", "tests.wire.host", bench.address, str(path)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=Path(__file__).parents[2]) as host:
            assert host.stdout is not None
            while int(host.stdout.readline()) < 3000:
                pass
            yield bench, host, path
            host.kill()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_host_asked_to_stop_ramps_down_and_keeps_the_recording(
    hosted: tuple[Emulated, subprocess.Popen[str], Path], number: signal.Signals,
) -> None:
    bench, host, path = hosted
    os.kill(host.pid, number)
    asked, levels = time.monotonic(), []
    while host.poll() is None and time.monotonic() < asked + 5:
        level = bench.look().level_v
        assert level is not None
        levels.append(level)
        time.sleep(0.01)
    assert host.returncode == 4
    assert bench.look().level_v == pytest.approx(1.0, abs=1e-3)
    assert not bench.look().watchdog_tripped
    assert any(1.5 < level < 4.5 for level in levels), "the output jumped where it should have ramped"
    recording = read(path)
    assert not recording.complete
    assert number.name in recording.reason
    assert (recording.ledger == Entry.RECORDED).sum() >= 3000


def test_a_second_owner_is_refused() -> None:
    with emulated(QUIET) as bench, connect(bench.address) as device:
        before = device.identity()
        with pytest.raises(DeviceError, match="close the program that holds the port"):
            connect(bench.address)
        assert device.level_v() is None
        assert device.identity() == before


def test_a_device_just_switched_on_has_put_nothing_out() -> None:
    with emulated(QUIET) as bench, connect(bench.address) as device:
        assert device.level_v() is None
        device.safe(2.0, 0.0)
        assert device.level_v() == pytest.approx(2.0, abs=1e-3)
