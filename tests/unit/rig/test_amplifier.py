"""Is u the voltage behind the amplifier, in ranges, rounding, playing, ramps and read-back?"""

from pathlib import Path

import numpy as np
import pytest

from rig import registry, session
from rig.amplifier import Amplifier, behind, parted
from rig.errors import FileError, RefusedError, UsageError
from rig.plan import Limits
from rig.rigfile import parse_rig
from tests.rigs import GAIN

TEN = "amplifier: {gain: 10, range: 12 V}\n"
PROTOCOL = """\
spec: 1
title: a level behind an amplifier
question: Where is u?
rig: rig.yaml
limits: {level: 12 V}
acquisition: {rate: 1 kHz}
steps:
  - {hold: {level: LEVEL, time: 50 ms}}
"""


def loopback(folder: Path, amplifier: str = TEN) -> str:
    (folder / "rig.yaml").write_text(GAIN + amplifier)
    return f"loopback:{folder / 'rig.yaml'}"


def test_a_rig_file_describes_it() -> None:
    assert parse_rig(GAIN, "r").amplifier is None
    assert parse_rig(GAIN + TEN, "r").amplifier == Amplifier(10.0, 12.0)
    assert parse_rig(GAIN + "amplifier: {gain: -2.5 V/V, range: 900 mV}", "r").amplifier == Amplifier(-2.5, 0.9)


@pytest.mark.parametrize(("text", "message"), [
    ("amplifier: {gain: 0, range: 10 V}", "amplifies"),
    ("amplifier: {gain: 10, range: 10}", "range"),
    ("amplifier: {gain: 10, range: 0 V}", "range"),
    ("amplifier: {gain: 10}", "range"),
    ("amplifier: {gain: 10, range: 10 V, offset: 1 V}", "offset"),
])
def test_what_describes_none_is_refused(text: str, message: str) -> None:
    with pytest.raises(FileError, match=message):
        parse_rig(GAIN + text, "r")


def test_an_address_carries_it_once() -> None:
    address = behind("serial:/dev/ttyACM0", Amplifier(-2.5, 0.9))
    assert parted(address) == ("serial:/dev/ttyACM0", Amplifier(-2.5, 0.9))
    assert behind(address, Amplifier(7.0, 7.0)) == address
    assert behind("loopback:", None) == "loopback:"
    for told in ("", "10", "0,10", "10,0", "10,x", "nan,1", "1,2,3"):
        with pytest.raises(UsageError, match="not an amplifier"):
            registry.connect(f"loopback:#amplifier={told}")


@pytest.mark.parametrize("gain", [10.0, -10.0, 0.5])
def test_range_and_steps_are_those_behind_it(tmp_path: Path, gain: float) -> None:
    plain = loopback(tmp_path, "")
    with registry.connect(plain) as bare, registry.connect(behind(plain, Amplifier(gain, 12.0))) as device:
        can, own = device.capabilities(), bare.capabilities()
        assert (can.output_low_v, can.output_high_v) == (-min(12.0, abs(gain) * 10.0), min(12.0, abs(gain) * 10.0))
        assert can.output_lsb_v == abs(gain) * own.output_lsb_v
        u = np.linspace(can.output_low_v, can.output_high_v, 999)
        rounded = device.quantise(u)
        assert np.abs(rounded - u).max() <= 0.501 * can.output_lsb_v
        assert np.array_equal(device.quantise(rounded), rounded)
        with pytest.raises(RefusedError, match="out of the device's range"):
            device.quantise(np.array([can.output_high_v + 2 * can.output_lsb_v]))


@pytest.mark.parametrize("gain", [10.0, -10.0])
def test_what_is_played_reaches_the_rig_amplified(tmp_path: Path, gain: float) -> None:
    address = behind(loopback(tmp_path, f"amplifier: {{gain: {gain}, range: 12 V}}\n"), Amplifier(gain, 12.0))
    with registry.connect(address) as device:
        u = device.quantise(np.array([0.0, 1.0, -2.0, 3.0]))
        y = np.concatenate([block.y for block in device.stream(u, 1000.0, Limits(-12.0, 12.0, None))])
        assert np.abs(y[1:] - 3.0 * u[:-1]).max() <= 0.501 * device.capabilities().input_lsb_v
        assert device.level_v() == u[-1]
        device.safe(-1.5)
        assert device.level_v() == pytest.approx(-1.5, abs=device.capabilities().output_lsb_v)


def test_a_session_takes_it_from_the_rig_and_records_volts_at_the_rig(tmp_path: Path) -> None:
    loopback(tmp_path)
    (tmp_path / "protocol.yaml").write_text(PROTOCOL.replace("LEVEL", "4 V"))
    done = session.record(tmp_path / "protocol.yaml", None, tmp_path / "run.h5", lambda done, total: None)
    assert np.asarray(done.recording.u[:]) == pytest.approx(4.0, abs=0.002)
    assert np.asarray(done.recording.y[1:]) == pytest.approx(12.0, abs=0.01)
    assert done.recording.origin.equipment.address.endswith("#amplifier=10.0,12.0")


def test_a_recording_replays_with_the_volts_it_holds(tmp_path: Path) -> None:
    loopback(tmp_path)
    (tmp_path / "protocol.yaml").write_text(PROTOCOL.replace("LEVEL", "4 V"))
    first = session.record(tmp_path / "protocol.yaml", None, tmp_path / "run.h5", lambda done, total: None)
    again = session.record(tmp_path / "protocol.yaml", f"replay:{tmp_path / 'run.h5'}", tmp_path / "again.h5",
                           lambda done, total: None)
    assert np.array_equal(np.asarray(again.recording.y[:]), np.asarray(first.recording.y[:]))


def test_more_than_the_amplifier_makes_is_refused(tmp_path: Path) -> None:
    loopback(tmp_path, "amplifier: {gain: 10, range: 3 V}\n")
    (tmp_path / "protocol.yaml").write_text(PROTOCOL.replace("LEVEL", "4 V"))
    with pytest.raises(RefusedError, match=r"allowed: -3 to 3 V"):
        session.check(tmp_path / "protocol.yaml")
