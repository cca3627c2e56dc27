"""Do the instruments that are asked and answer do what an operator relies on, through unmodified pyvisa-py?

That faults of their links end well is in ``tests/wire/matrix``, that they keep the contract in ``tests/contract``.
"""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import pyvisa

import protocols
from drivers.emulators.faults import Fault, Faults, What
from drivers.emulators.redpitaya_firmware import HARDWARE as BOARD
from drivers.emulators.u2300a_firmware import HARDWARE
from drivers.emulators.usb_cable import plug_in
from drivers.scpi_link import ScpiLink
from drivers.u2300a import U2300a
from rig import session
from rig.device import Array, Block, Flag
from rig.errors import DeviceError, RefusedError, UsageError
from rig.plan import Limits
from rig.registry import connect
from tests.rigs import GAIN
from tests.wire.emulated import Emulated, emulated

LIMITS = Limits(-10.0, 10.0, None)
TEN = "amplifier: {gain: 10, range: 10 V}\n"
PROTOCOL = """\
spec: 1
title: a sine and a level
question: Does the whole way work?
rig: rig.yaml
limits: {level: 10 V}
acquisition: {rate: 10 kHz}
steps:
  - {sine: {frequency: 20 Hz, amplitude: 3 V, periods: 4}}
  - {hold: {level: 2 V, time: 100 ms}}
"""


def plugged(device: Emulated) -> str:
    """Return the VISA name of an emulated USB instrument that is now on the bus this program sees."""
    name, _, place = device.path.partition("?usb=")
    host, _, port = place.rpartition(":")
    plug_in((host, int(port)))
    return name


@contextmanager
def by_hand(device: Emulated) -> Iterator[pyvisa.resources.MessageBasedResource]:
    """Give an instrument as somebody without this program has it."""
    resource = pyvisa.ResourceManager("@py").open_resource(plugged(device))
    assert isinstance(resource, pyvisa.resources.MessageBasedResource)
    try:
        yield resource
    finally:
        resource.close()


def joined(blocks: list[Block]) -> Array:
    return np.concatenate([block.y for block in blocks])


@pytest.mark.parametrize("kind", ["u2300a", "redpitaya"])
def test_a_protocol_is_recorded_in_volts_at_the_rig(kind: str, tmp_path: Path) -> None:
    rig = GAIN + (TEN if kind == "redpitaya" else "")
    (tmp_path / "rig.yaml").write_text(rig)
    (tmp_path / "protocol.yaml").write_text(PROTOCOL)
    with emulated(rig, kind=kind) as device:
        done = session.record(tmp_path / "protocol.yaml", device.address, tmp_path / "run.h5", lambda done, total: None)
        assert done.outcome.complete, done.outcome.reason
        assert device.look().level_v == pytest.approx(0.0, abs=1e-3)
    u, y = np.asarray(done.recording.u[:]), np.asarray(done.recording.y[:])
    assert np.ptp(u) == pytest.approx(6.0, abs=0.01)
    assert np.abs(y[1:] - 3.0 * u[:-1]).max() <= 0.5 * (20.0 / 2**13 if kind == "redpitaya" else 20.0 / 2**16) * 1.001


def test_a_red_pitaya_without_an_amplifier_in_the_rig_file_ends_at_one_volt(tmp_path: Path) -> None:
    (tmp_path / "rig.yaml").write_text(GAIN)
    (tmp_path / "protocol.yaml").write_text(PROTOCOL)
    with emulated(GAIN, kind="redpitaya") as device, pytest.raises(RefusedError, match="-1 to 1 V"):
        session.check(tmp_path / "protocol.yaml", device.address)


def test_the_protocol_for_one_buffer_fits_it() -> None:
    rig = Path(protocols.__path__[0], "rigs", "opamp_behind_amplifier.yaml").read_text(encoding="utf-8")
    with emulated(rig, kind="redpitaya") as device:
        checked = session.check("one_buffer.yaml", device.address)
    assert checked.plan.rate_hz == 2000.0
    assert checked.plan.u.size <= BOARD.capabilities.max_samples  # type: ignore[operator]


def test_pyvisa_lists_opens_and_asks_the_emulated_instrument_by_itself() -> None:
    with emulated(GAIN, kind="u2300a") as device:
        name = plugged(device)
        assert any(name.split("::")[3] in listed for listed in U2300a.attached())
        with by_hand(device) as instrument:
            assert instrument.query("*IDN?").startswith("Agilent Technologies,U2351A,EMU")
            instrument.write("VOLT:OUT:OF:RANGE 1")
            assert instrument.query("SYSTem:ERRor?").startswith("-113")
            assert instrument.query(":syst:err:next?").startswith("0,")


def test_one_program_at_a_time_has_the_instrument() -> None:
    with emulated(GAIN, kind="u2300a") as device, by_hand(device) as first:
        first.query("*IDN?")
        with pytest.raises(DeviceError, match="busy"):
            connect(device.address)
        assert first.query("*IDN?").startswith("Agilent")


def test_without_the_trigger_the_output_begins_seven_milliseconds_late() -> None:
    """This is what the wire from the digital output to both trigger pins is for."""
    u = (np.full(500, 16384) + 32768).astype("<u2").tobytes()
    with emulated(GAIN, kind="u2300a") as device, by_hand(device) as instrument:
        for command in ("ROUT:ENAB ON,(@201)", "ACQ:SRAT 10000", "OUTP:WAV:SRAT 10000", "ACQ:POIN 5000",
                        "OUTP:WAV:ITER 1", "TRIG:SOUR NONE"):
            instrument.write(command)
        instrument.write_raw(b"DATA #800001000" + u)
        instrument.write("APPL:USER (@201)")
        instrument.write("DIG")
        instrument.write("OUTP ON")
        deadline = time.monotonic() + 5
        while instrument.query("WAV:COMP?").strip() != "YES":
            assert time.monotonic() < deadline
        y = np.array(instrument.query_binary_values("WAV:DATA?", datatype="h"))
        assert instrument.query("SYST:ERR?").startswith("0,")
    assert 71 <= int(np.argmax(y > 0)) < 5000  # 70 samples of 0.1 ms, the way of the command, and the one read before


@pytest.mark.parametrize("kind", ["u2300a", "redpitaya"])
def test_a_late_reply_is_not_taken_for_the_next_one(kind: str) -> None:
    faults = Faults((Fault(What.LATE, to="SYST:ERR:COUN?", seconds=0.5),))
    with emulated(GAIN, kind=kind, faults=faults) as device:
        name = plugged(device) if kind == "u2300a" else device.path
        link = ScpiLink(name, "\r\n" if kind == "redpitaya" else "\n")
        who = link.introduce()
        with pytest.raises(DeviceError, match="no answer"):
            link.ask("SYST:ERR:COUN?", timeout_s=0.1)
        time.sleep(0.5)
        assert link.ask("*IDN?") == who
        assert link.ask("*OPC?") == "1"
        assert link.ask("SYST:ERR:COUN?") == "0"
        link.close()


def test_what_the_instrument_loses_ends_the_run_as_overrun() -> None:
    with emulated(GAIN, kind="u2300a", input_fifo=4096) as device, connect(device.address) as instrument:
        blocks: list[Block] = []
        for block in instrument.stream(np.full(60_000, 1.0), 10_000.0, LIMITS):
            blocks.append(block)
            if block.stop == 1000 and block.y.size:
                time.sleep(0.8)
        assert Flag.OVERRUN in blocks[-1].flags
        assert blocks[-1].start == 60_000
        received = joined(blocks)
        assert 1000 <= received.size < 10_000
        assert np.abs(received[1:] - 3.0).max() < 1e-3
        assert instrument.level_v() == pytest.approx(1.0, abs=1e-3)
        instrument.safe(0.0, 0.0)
    assert HARDWARE.input_fifo > 4096


def test_a_model_whose_output_is_coded_in_another_way_is_refused() -> None:
    identity = replace(HARDWARE.identity, model="U2331A")
    with emulated(GAIN, kind="u2300a", identity=identity) as device, pytest.raises(DeviceError, match="U2351A, U2353A"):
        connect(device.address)


def test_something_else_than_a_red_pitaya_is_refused() -> None:
    faults = Faults((Fault(What.REPLACED, to="*IDN?", times=99, old=b"REDPITAYA", new=b"ACME"),))
    with (emulated(GAIN, kind="redpitaya", faults=faults) as device,
          pytest.raises(DeviceError, match="not a Red Pitaya")):
        connect(device.address)


def test_a_run_longer_than_the_buffer_is_refused_before_any_output() -> None:
    with emulated(GAIN, kind="redpitaya") as device, connect(device.address) as board:
        with pytest.raises(RefusedError, match=f"at most {BOARD.capabilities.max_samples}"):
            board.stream(np.zeros(20_000), 10_000.0, LIMITS)
        assert board.level_v() is None


@pytest.mark.parametrize("option", ["usb=", "usb=here", "usb=:1", "usb=h:x", "bus=h:1"])
def test_an_unknown_option_is_refused(option: str) -> None:
    with pytest.raises(UsageError, match="usb=HOST:PORT"):
        U2300a.connect(f"USB0::1::2::3::0::INSTR?{option}")


def test_an_instrument_that_is_not_there_is_told() -> None:
    with emulated(GAIN, kind="u2300a") as device:
        absent = device.address.replace("EMU-", "NOT-")
        with pytest.raises(DeviceError, match=r"cannot be opened.*No device found"):
            connect(absent)


@pytest.mark.parametrize(("why", "message"), [
    ("PyUSB does not seem to be properly installed.\nPlease refer", "install libusb-1.0"),
    ("No device found.", "cannot be opened: No device found.; check that it is on"),
])
def test_what_keeps_an_instrument_from_being_opened_is_told_in_one_line(
    monkeypatch: pytest.MonkeyPatch, why: str, message: str,
) -> None:
    def refuse(*args: object, **named: object) -> None:
        raise ValueError(why)

    monkeypatch.setattr(pyvisa.ResourceManager, "open_resource", refuse)
    with pytest.raises(DeviceError, match=message) as failure:
        U2300a.connect("USB0::1::2::3::0::INSTR")
    assert "\n" not in str(failure.value)
