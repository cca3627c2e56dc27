"""Does the firmware do a command once, refuse what it cannot do, and survive what makes no sense?"""

import pytest

from drivers.emulators.bench import Bench
from drivers.emulators.device_model import DeviceModel, State
from drivers.emulators.serial_firmware import SerialFirmware
from drivers.emulators.serial_pty import HARDWARE
from drivers.framing import Frame, FrameReader, encode
from drivers.serial_messages import Kind, named, pack_range
from rig.rigfile import parse_rig
from tests.rigs import GAIN

AT_4_V = 13107
"""The code of 4 V: 32767 are 10 V."""


@pytest.fixture
def model() -> DeviceModel:
    return DeviceModel(HARDWARE, Bench(parse_rig(GAIN, "test"), HARDWARE.capabilities))


@pytest.fixture
def firmware(model: DeviceModel) -> SerialFirmware:
    return SerialFirmware(model)


def ask(firmware: SerialFirmware, command: str, number: int, now_s: float = 0.0) -> str:
    firmware.receive(encode(Frame(Kind.COMMAND, number, command.encode())), now_s)
    (reply,) = FrameReader().feed(firmware.transmit(now_s))
    assert (reply.kind, reply.number) == (Kind.REPLY, number)
    return reply.payload.decode()


def test_a_command_repeated_under_its_number_is_done_once(firmware: SerialFirmware, model: DeviceModel) -> None:
    assert ask(firmware, f"SAFE {AT_4_V} 0", 1) == "OK\n"
    assert ask(firmware, "SAFE 0 10000", 2, 1.0) == "OK\n"
    assert ask(firmware, "SAFE 0 10000", 2, 6.0) == "OK\n"
    assert model.level_v(8.5) == pytest.approx(1.0, abs=1e-3), "the ramp began anew"
    assert ask(firmware, "SAFE 0 10000", 3, 6.0) == "OK\n"
    assert model.level_v(11.0) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("command", [
    "", "BOOM", "ARM", "ARM 10", "ARM x 4800 0 100 1", "ARM 10 0 0 100 1", "ARM 10 4800 0.0 100 1",
    "ARM 10 4800 32768 100 1", "ARM 10 4800 0 100", "ARM 10 4800 0 100 0", "ARM 10 4800 0 100 5",
    "SAFE", "SAFE up 1", "SAFE -32768 0", "SAFE 0 -1", "SAFE 0 60001", "SAFE 0 0.5", "GO",
])
def test_what_cannot_be_done_is_refused_and_changes_nothing(
    firmware: SerialFirmware, model: DeviceModel, command: str,
) -> None:
    assert ask(firmware, command, 1).startswith("ERROR ")
    assert model.state is State.IDLE
    assert model.level_v(0.0) is None


def test_the_level_is_told_with_the_state(firmware: SerialFirmware) -> None:
    assert named(ask(firmware, "LEVEL?", 1)) == {"level": "none", "state": "idle"}
    ask(firmware, f"SAFE {AT_4_V} 0", 2)
    ask(firmware, "SAFE 0 2000", 3, 1.0)
    said = named(ask(firmware, "LEVEL?", 4, 2.0))
    assert said["state"] == "ramping"
    assert int(said["level"]) == pytest.approx(AT_4_V / 2, abs=2)


@pytest.mark.parametrize("frame", [
    Frame(Kind.OUTPUT, 0, b"odd"), Frame(Kind.AGAIN, 0, b"short"), Frame(Kind.AGAIN, 0, pack_range(5, 9)),
    Frame(Kind.AGAIN, 0, pack_range(0, 2**32 - 1)), Frame(77, 1, b"?"), Frame(Kind.REPLY, 1, b"OK"),
])
def test_frames_that_make_no_sense_are_left_unanswered(firmware: SerialFirmware, frame: Frame) -> None:
    firmware.receive(encode(frame), 0.0)
    assert firmware.transmit(0.0) == b""
    assert ask(firmware, "ID?", 9).startswith("OK")


def test_a_run_nobody_listens_to_any_more_is_not_reported_for_ever(firmware: SerialFirmware) -> None:
    ask(firmware, "ARM 100 4800 0 100 1", 1)
    ask(firmware, "GO", 2)
    now_s = 0.0
    while firmware.live and now_s < 10:
        now_s += 0.01
        firmware.advance(now_s)
        while firmware.transmit(now_s):
            pass
    assert 2.0 < now_s < 2.5
