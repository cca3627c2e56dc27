"""Does the firmware, unmodified in simavr, keep time, keep the output safe, and record what the emulator does?"""

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields

import numpy as np
import pytest

from drivers.emulators.faults import Faults
from identify.trace import Array
from rig.device import Device, Flag
from rig.errors import DeviceError
from rig.plan import Limits
from rig.registry import connect
from rig.rigfile import read_rig
from rig.session import shipped
from tests.architecture.house import ROOT
from tests.rigs import GAIN
from tests.wire.emulated import emulated
from tests.wire.simavr.bench import FREQUENCY_HZ, UNO, Board, on_simavr
from tests.wire.simavr.built import missing
from tests.wire.talk import Talk
from tests.wire.waiting import eventually, in_time

pytestmark = pytest.mark.skipif(bool(missing()), reason=missing())

EXAMPLE = "tests/hardware"
LIMITS = Limits(-10.0, 10.0, None)
LSB_V = UNO.capabilities.output_lsb_v


@pytest.fixture
def board() -> Iterator[Board]:
    with on_simavr(GAIN, speed=4) as board:
        yield board


def played(device: Device, u: Array, rate_hz: float) -> Array:
    return np.concatenate([block.y for block in device.stream(u, rate_hz, LIMITS, safe_level_v=1.0, ramp_s=0.1)])


def test_it_records_what_the_emulator_does_to_the_last_bit_noise_included() -> None:
    rig, rate_hz = read_rig(shipped("rigs/opamp_backlash.yaml")).text, 2000.0
    u = 8.0 * np.sin(np.arange(3000) * 0.01)
    recorded = []
    roomy = {"output_fifo": 32768, "input_fifo": 32768}  # its clock does not wait for a busy computer
    emulator = emulated(rig, speed=4, **{field.name: getattr(UNO, field.name) for field in fields(UNO)} | roomy)
    for device in (on_simavr(rig, speed=4), emulator):
        with device as there, connect(there.address) as connected:
            recorded.append([played(connected, sign * u, rate_hz) for sign in (1.0, -1.0)])
            connected.safe()
    for ours, theirs in zip(*recorded, strict=True):
        assert np.ptp(ours) > 10.0
        assert np.array_equal(ours, theirs)


@pytest.mark.parametrize("rate_hz", [31.25, 1000.0, 5000.0])
def test_every_sample_is_read_and_put_out_in_its_time(board: Board, rate_hz: float) -> None:
    with connect(board.address) as device:
        played(device, np.full(min(2000, int(rate_hz)), 2.0), rate_hz)
        assert eventually(lambda: board.look().periods != (0, 0))
        seen = board.look()
        device.safe()
    period = FREQUENCY_HZ / rate_hz
    assert not seen.troubles
    assert seen.idle > 0.1, "the processor has next to no time left"
    assert period - 160 < seen.periods[0] <= period <= seen.periods[1] < period + 160, "a sample is off by 10 us"


@pytest.mark.parametrize("faults", [
    Faults(drop=1e-3, spare=3000, seed=1), Faults(corrupt=1e-3, spare=3000, seed=2),
], ids=["dropped", "corrupted"])
def test_on_a_bad_line_no_sample_is_wrong_and_none_is_missing_in_silence(faults: Faults) -> None:
    u = 4.0 * np.sin(np.arange(3000) * 0.01)

    def heard() -> tuple[Array, Flag, Array]:
        with on_simavr(GAIN, faults=faults) as board, connect(board.address) as device:
            y, flags = np.full(u.size, np.nan), Flag.NONE
            for block in device.stream(u, 1000.0, LIMITS):
                flags |= block.flags
                assert block.start == np.isfinite(y).sum() or flags & Flag.LINK_LOSS, "a gap that nobody tells"
                y[block.start:block.stop] = block.y
            device.safe()
            return y, flags, 3.0 * np.concatenate([[0.0], device.quantise(u)[:-1]])

    y, flags, expected = in_time(heard)
    here = np.isfinite(y)
    assert Flag.RESENT in flags, "the line lost nothing"
    assert here.all() or Flag.LINK_LOSS in flags
    assert here.mean() > 0.9
    assert np.abs(y - expected)[here].max() <= 0.5001 * UNO.capabilities.input_lsb_v


def test_a_firmware_that_hangs_is_restarted_and_makes_the_output_safe(board: Board) -> None:
    with connect(board.address) as device:
        blocks = device.stream(np.full(20_000, 5.0), 1000.0, LIMITS, safe_level_v=1.0, ramp_s=0.1)
        while next(blocks).stop < 500:
            pass
        assert board.look().level_v == pytest.approx(5.0, abs=LSB_V)
        board.hang()
        assert eventually(lambda: board.look().level_v == pytest.approx(1.0, abs=LSB_V))
        assert board.look().played < 20_000
        with pytest.raises(DeviceError):
            list(blocks)
        device.safe(0.0)
        assert device.level_v() == 0.0


def test_a_reset_in_a_run_makes_the_output_safe_by_a_ramp(board: Board) -> None:
    with Talk.at(board.path) as talk:
        talk.arm(1000, safe="-100 400")
        talk.put(np.full(300, 1500, dtype=np.int32))
        talk.ask("GO")
        assert talk.until(lambda: bool(talk.samples()))
        board.reset()
        levels = [talk.level()]
        while levels[-1][1] != "idle":
            levels.append(talk.level())
    assert levels[-1] == (-100, "idle")
    assert any(200 < (level or 0) < 1200 for level, _ in levels), "the output jumped where it should have ramped"
    assert board.look().level_v == pytest.approx(-100 * 10.0 / 2047)


def test_a_reset_before_anything_was_output_outputs_nothing(board: Board) -> None:
    with Talk.at(board.path) as talk:
        board.reset()
        assert talk.level() == (None, "idle")
    assert board.look().level_v is None


def test_the_same_test_file_as_on_the_bench_passes_on_it() -> None:
    with on_simavr(read_rig(shipped("rigs/opamp_backlash.yaml")).text, speed=4) as board:
        command = ["-m", "pytest", "-q", "--no-cov", "-p", "no:cacheprovider", "--rig-device", board.address, EXAMPLE]
        ended = subprocess.run([sys.executable, *command], cwd=ROOT, capture_output=True, text=True, check=False)
        seen = board.look()
    assert "3 passed" in ended.stdout, ended.stdout + ended.stderr
    assert seen.played > 3_000
    assert seen.level_v == 0.0


def test_samples_that_found_no_room_are_told_as_lost_and_the_others_are_right() -> None:
    with on_simavr(GAIN, speed=4, BAUD=38400) as board, connect(f"serial:{board.path}?baud=38400") as device:
        u = np.linspace(0.0, 3.0, 384)
        expected = 3.0 * np.concatenate([[0.0], device.quantise(u)[:-1]])
        blocks = list(device.stream(u, 5000.0, LIMITS))
        device.safe()
    here = np.concatenate([np.arange(block.start, block.stop) for block in blocks])
    y = np.concatenate([block.y for block in blocks])
    assert 100 < here.size < u.size
    assert any(block.flags & Flag.OVERRUN for block in blocks)
    assert not any(block.flags & Flag.LINK_LOSS for block in blocks)
    assert blocks[-1].stop == u.size
    assert np.abs(y - expected[here]).max() <= 0.5001 * UNO.capabilities.input_lsb_v
