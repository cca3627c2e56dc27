"""Does the host keep question and answer together on a link that answers late, wrongly or not at all?"""

import os
import pty
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest

from drivers.framing import Frame, FrameReader, encode
from drivers.serial_daq import SerialDaq
from drivers.serial_link import TRIES, SerialLink
from drivers.serial_messages import Condition, Kind, Status
from rig.errors import DeviceError, UsageError
from rig.plan import Limits
from rig.registry import connect

WHO = "OK\nprotocol=2\nmodel=peer\nserial=7\nfirmware=1"
CAN = ("OK\noutput_low_v=-10\noutput_high_v=10\ninput_low_v=-10\ninput_high_v=10\noutput_bits=12\ninput_bits=10\n"
       "min_rate_hz=1\nmax_rate_hz=1000\nclock_hz=16e6\noutput_fifo=512\ninput_fifo=512\nhistory=512\nwatchdog_s=1\n"
       "inputs=1\nmax_total_rate_hz=1000")
Answer = Callable[[str], tuple[float, str | None]]
Around = Callable[[str], tuple[bytes, bytes]]


def plain(command: str) -> tuple[float, str | None]:
    return 0.0, {"ID?": WHO, "CAP?": CAN}.get(command, f"OK\nsaid={command}")


def nothing(command: str) -> tuple[bytes, bytes]:
    return b"", b""


@contextmanager
def peer(answer: Answer, around: Around = nothing) -> Iterator[str]:
    """Give the path of a pty where ``answer`` says how late, and what, the reply to a command is.

    ``around`` says which bytes come right before and after the reply; frames of samples are answered with a status.
    """
    master, slave = pty.openpty()
    tty.setraw(slave)
    over = threading.Event()
    thread = threading.Thread(target=_answer, args=(master, answer, around, over))
    thread.start()
    try:
        yield os.ttyname(slave)
    finally:
        over.set()
        thread.join()
        os.close(slave)
        with suppress(OSError):
            os.close(master)


def _answer(master: int, answer: Answer, around: Around, over: threading.Event) -> None:
    os.set_blocking(master, False)
    reader, due = FrameReader(), []
    while not over.wait(0.002):
        with suppress(BlockingIOError):
            for frame in reader.feed(os.read(master, 4096)):
                if frame.kind == Kind.OUTPUT:
                    taken = Status(False, Condition.FINE, frame.number + len(frame.payload) // 2, 0, 0)
                    os.write(master, encode(Frame(Kind.STATUS, 0, taken.pack())))
                if frame.kind != Kind.COMMAND:
                    continue
                command = frame.payload.decode()
                late_s, text = answer(command)
                if text is not None:
                    before, after = around(command)
                    reply = encode(Frame(Kind.REPLY, frame.number, text.encode()))
                    due.append((time.monotonic() + late_s, before + reply + after))
        for item in [item for item in due if item[0] <= time.monotonic()]:
            due.remove(item)
            os.write(master, item[1])


@pytest.fixture(autouse=True)
def _impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.serial_link.REPLY_S", 0.2)
    monkeypatch.setattr("drivers.serial_daq.GREETING_S", 0.6)


def once(command: str, late_s: float) -> Answer:
    """Answer ``command`` late the first time it is asked three times, everything else at once."""
    asked = []

    def answer(said: str) -> tuple[float, str | None]:
        asked.append(said)
        late = said == command and asked.count(command) <= 3
        return (late_s if late else 0.0), plain(said)[1]

    return answer


def test_a_late_reply_is_never_taken_for_another_ones() -> None:
    with peer(once("ONE", 0.7)) as path:
        link = SerialLink(path, 115200)
        with pytest.raises(DeviceError, match="no answer"):
            link.ask("ONE")
        assert link.ask("TWO") == "said=TWO"
        time.sleep(0.8)
        assert link.ask("THREE") == "said=THREE"
        assert link.ask("ONE") == "said=ONE"
        link.close()


def test_after_a_time_out_the_identity_is_asked_before_anything_else() -> None:
    asked: list[str] = []

    def answer(command: str) -> tuple[float, str | None]:
        asked.append(command)
        return 0.0, None if command == "DEAF" else plain(command)[1]

    with peer(answer) as path:
        link = SerialLink(path, 115200)
        assert link.introduce(0.6) == WHO.removeprefix("OK\n")
        with pytest.raises(DeviceError, match="no answer"):
            link.ask("DEAF")
        link.ask("NEXT")
        link.ask("AFTER")
        link.close()
    assert asked == ["ID?", "DEAF", "DEAF", "DEAF", "ID?", "NEXT", "AFTER"]


def test_another_device_in_the_place_of_the_first_is_refused() -> None:
    names = iter(["7", "8", "8"])

    def answer(command: str) -> tuple[float, str | None]:
        if command == "ID?":
            return 0.0, WHO.replace("serial=7", f"serial={next(names)}")
        return 0.0, None

    with peer(answer) as path:
        link = SerialLink(path, 115200)
        link.introduce(0.6)
        with pytest.raises(DeviceError, match="no answer"):
            link.ask("DEAF")
        with pytest.raises(DeviceError, match="another device answers"):
            link.ask("NEXT")
        link.close()


def test_a_command_whose_first_reply_is_lost_is_asked_again_under_its_number() -> None:
    asked: list[str] = []

    def answer(command: str) -> tuple[float, str | None]:
        asked.append(command)
        return 0.0, None if len(asked) == 1 else plain(command)[1]

    with peer(answer) as path:
        link = SerialLink(path, 115200)
        assert link.ask("GO") == "said=GO"
        link.close()
    assert asked == ["GO", "GO"]


def test_garbage_before_every_reply_does_no_harm() -> None:
    with peer(plain, lambda command: (b"\n*** boot ***\xa5\x5a\x01", b"\xa5")) as path, \
            connect(f"serial:{path}?baud=115200") as device:
        assert str(device.identity()) == "peer serial 7 firmware 1"
        assert device.capabilities().output_bits == 12


def test_samples_of_the_run_before_are_not_taken_for_this_ones() -> None:
    old = encode(Frame(Kind.INPUT, 0, b"\x07\x00"))
    with peer(plain, lambda command: (old if command.startswith("ARM") else b"", b"")) as path, \
            connect(f"serial:{path}") as device:
        blocks = device.stream(np.zeros(3), 100.0, Limits(-1.0, 1.0, None))
        assert next(blocks).y.size == 0
        blocks.close()  # type: ignore[attr-defined]


def test_a_port_that_says_nothing_is_no_device() -> None:
    with peer(lambda command: (0.0, None)) as path, pytest.raises(DeviceError, match=r"no answer.*ID.*baud rate"):
        connect(f"serial:{path}")


@pytest.mark.parametrize(("change", "message"), [
    (("protocol=2", "protocol=99"), "speaks another protocol: 99"),
    (("output_fifo=512\n", ""), "does not tell its output_fifo"),
    (("output_bits=12", "output_bits=twelve"), "describes itself badly"),
    (("OK\noutput_low_v", "ERROR busy\noutput_low_v"), "refused: 'CAP\\?': ERROR busy"),
])
def test_a_device_that_describes_itself_badly_is_refused(change: tuple[str, str], message: str) -> None:
    def answer(command: str) -> tuple[float, str | None]:
        return 0.0, {"ID?": WHO, "CAP?": CAN}[command].replace(*change)

    with peer(answer) as path:
        with pytest.raises(DeviceError, match=message):
            connect(f"serial:{path}")
        with pytest.raises(DeviceError, match=message):  # and not for the port being held by the first attempt
            connect(f"serial:{path}")


def test_a_level_that_is_no_number_is_refused() -> None:
    with peer(plain) as path, connect(f"serial:{path}") as device, pytest.raises(DeviceError, match="tells no level"):
        device.level_v()


@pytest.mark.parametrize(("level", "state"), [("920", "idle"), ("0", "running"), ("none", "idle")])
def test_a_device_that_does_not_come_to_rest_at_the_safe_level_is_reported(
    monkeypatch: pytest.MonkeyPatch, level: str, state: str,
) -> None:
    monkeypatch.setattr("drivers.serial_daq.CONFIRM_S", 0.1)

    def answer(command: str) -> tuple[float, str | None]:
        return 0.0, f"OK\nlevel={level}\nstate={state}" if command == "LEVEL?" else plain(command)[1]

    with peer(answer) as path, connect(f"serial:{path}") as device, \
            pytest.raises(DeviceError, match=r"did not reach the level.*switch the rig off by hand"):
        device.safe(0.0, 0.0)


def test_a_safe_level_that_was_taken_is_waited_for_while_the_device_is_not_heard() -> None:
    """Where this computer is too busy, a reply comes late; asked once more, the device does nothing twice."""
    asked: list[str] = []

    def answer(command: str) -> tuple[float, str | None]:
        asked.append(command)
        if command != "LEVEL?":
            return plain(command)
        return 0.0, "OK\nlevel=0\nstate=idle" if asked.count("LEVEL?") > TRIES + 1 else None

    with peer(answer) as path, connect(f"serial:{path}") as device:
        device.safe(0.0, 0.0)
        assert asked.count("LEVEL?") == TRIES + 2
        assert sum(command.startswith("SAFE") for command in asked) == 1


def test_a_port_that_is_not_there_is_told_with_what_to_do() -> None:
    with pytest.raises(DeviceError, match=r"/dev/nowhere: the port cannot be opened.*rig devices"):
        connect("serial:/dev/nowhere")


def test_a_device_that_was_unplugged_is_spoken_to_again_once_it_says_who_it_is(tmp_path: Path) -> None:
    port, asked = tmp_path / "port", []

    def answer(command: str) -> tuple[float, str | None]:
        asked.append(command)
        return plain(command)

    with peer(plain) as path:
        port.symlink_to(path)
        link = SerialLink(str(port), 115200)
        link.introduce(0.6)
    port.unlink()
    with pytest.raises(DeviceError, match="the link to the device is gone"):
        link.ask("ONE")
    with peer(answer) as path:
        port.symlink_to(path)
        assert link.ask("TWO") == "said=TWO"
        link.close()
    assert asked == ["ID?", "TWO"]


def test_another_device_on_a_port_that_came_back_is_refused(tmp_path: Path) -> None:
    port = tmp_path / "port"
    with peer(plain) as path:
        port.symlink_to(path)
        link = SerialLink(str(port), 115200)
        link.introduce(0.6)
    port.unlink()
    with pytest.raises(DeviceError, match="gone"):
        link.send(Frame(Kind.ALIVE, 0))
    with peer(lambda command: (0.0, WHO.replace("serial=7", "serial=8"))) as path:
        port.symlink_to(path)
        with pytest.raises(DeviceError, match=r"another device answers.*serial=8.*allowed.*serial=7"):
            link.ask("SAFE 0 0")
        link.close()


def test_a_port_that_does_not_come_back_is_waited_for_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.serial_link.BACK_S", 1.0)
    port = tmp_path / "port"  # a name of its own: the pty's is given to the next that any process opens
    with peer(plain) as path:
        port.symlink_to(path)
        link = SerialLink(str(port), 115200)
    port.unlink()
    with pytest.raises(DeviceError, match="gone"):
        link.receive()
    begun = time.monotonic()
    for _ in range(5):
        with pytest.raises(DeviceError, match="plug the device in"):
            link.ask("SAFE 0 0")
    assert time.monotonic() - begun < 4.0
    link.close()


def test_a_link_that_is_torn_is_told_as_such() -> None:
    master, slave = pty.openpty()
    link = SerialLink(os.ttyname(slave), 115200)
    os.close(slave)
    os.close(master)
    with pytest.raises(DeviceError, match="the link to the device is gone"):
        link.ask("ID?")
    link.close()


@pytest.mark.parametrize(("address", "message"), [
    ("serial:", "no port"), ("serial:/dev/null?speed=3", "unknown option"), ("serial:/dev/null?baud=0", "baud=N"),
])
def test_an_address_with_a_mistake_is_refused(address: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        connect(address)


def test_only_usb_ports_are_taken_for_candidates(monkeypatch: pytest.MonkeyPatch) -> None:
    class Port:
        def __init__(self, device: str, vid: int | None) -> None:
            self.device, self.vid = device, vid

    ports = [Port("/dev/ttyUSB0", 0x403), Port("/dev/ttyS0", None), Port("/dev/ttyACM1", 0x2341)]
    monkeypatch.setattr("drivers.serial_daq.list_ports.comports", lambda: ports)
    assert SerialDaq.attached() == ("/dev/ttyACM1", "/dev/ttyUSB0")
