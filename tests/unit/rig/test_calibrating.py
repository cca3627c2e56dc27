"""Does the calibration of an emulated device hold the truth, and is a rig that is no cable left alone?"""

from dataclasses import replace
from pathlib import Path

import pytest

from rig.calibrating import Wish, calibrate, measured_on
from rig.calibration import kept_for, read_calibration
from rig.device import Device
from rig.errors import FileError, RefusedError
from rig.recorded import Equipment
from rig.registry import connect
from tests.rigs import CABLE, QUIET
from tests.wire.emulated import emulated

WISH = Wish(rate_hz=4000.0, level_v=2.0)


def silent(sentence: str, share: float) -> None:
    """Show nothing."""


def wired(folder: Path, rig: str) -> str:
    (folder / "rig.yaml").write_text(rig)
    return f"loopback:{folder / 'rig.yaml'}"


def test_a_calibration_is_kept_with_what_it_is_true_of(tmp_path: Path) -> None:
    done = calibrate(wired(tmp_path, CABLE), WISH, tmp_path / "cal.json")
    kept = read_calibration(done.path)
    assert (kept.model, kept.serial, kept.firmware, kept.rate_hz) == ("loopback", "a cable", "1", 4000.0)
    assert kept.ranges_v == (-10.0, 10.0, -20.0, 20.0)
    assert kept.delay.low < 237e-6 < kept.delay.high
    assert kept.delay.high - kept.delay.low < 1e-6
    assert kept.gain.low < 1.003 < kept.gain.high
    assert kept.offset.low < 2e-3 < kept.offset.high
    assert kept.input_step is not None
    assert kept.input_step.value == pytest.approx(40.0 / (2**24 - 2), rel=1e-9)
    assert not kept.warnings


def test_it_is_kept_where_a_run_finds_it_whatever_stood_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RIG_CALIBRATIONS", str(tmp_path))
    path = tmp_path / "loopback-a_cable-4000_Hz.json"
    path.write_text("half of a calib")
    with pytest.raises(FileError, match=r"loopback-a_cable-4000_Hz\.json:1: not valid JSON"):
        kept_for(Equipment("", "loopback", "a cable", "1"), 4000.0, "")
    done = calibrate(wired(tmp_path, CABLE), replace(WISH, inputs=2), None)
    assert done.path == path
    assert kept_for(Equipment("", "loopback", "a cable", "1"), 4000.0, "") == path.read_text()
    skew = done.calibration.input_skews["input 2"]  # it reads the output back, past the cable
    assert skew.low < -237e-6 < skew.high
    assert skew.high - skew.low < 300e-6


def test_a_board_on_a_real_port_is_calibrated_and_left_at_0_v() -> None:
    with emulated(CABLE, speed=10) as board, connect(board.address) as device:
        found = measured_on(device, WISH, silent)
        assert board.look().level_v == 0.0
    assert found.delay.low < 237e-6 < found.delay.high
    assert found.gain.low < 1.003 < found.gain.high


def test_what_is_no_cable_gets_a_tenth_of_the_level_and_no_more(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    played: list[float] = []
    stream = Device.stream
    monkeypatch.setattr(Device, "stream", lambda self, u, *rest: played.append(abs(u).max()) or stream(self, u, *rest))
    with pytest.raises(RefusedError, match=r"this is no cable.*take the rig off"):
        calibrate(wired(tmp_path, QUIET), WISH, tmp_path / "cal.json")
    assert len(played) == 1
    assert played[0] <= 0.1001 * WISH.level_v
    assert not (tmp_path / "cal.json").exists()


def test_a_level_beyond_the_input_or_the_output_is_refused(tmp_path: Path) -> None:
    amplified = CABLE.replace("gain: 1.003", "gain: 3")
    with pytest.raises(RefusedError, match="end of its range"):
        calibrate(wired(tmp_path, amplified), Wish(4000.0, 9.0), tmp_path / "cal.json")
    with pytest.raises(RefusedError, match="out of"):
        calibrate(wired(tmp_path, CABLE), Wish(4000.0, 11.0), tmp_path / "cal.json")
