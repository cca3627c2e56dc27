"""Is a reply ever taken for another's on a TCP link that answers late, wrongly, in pieces or not at all?"""

import re
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field

import pytest

from drivers.scpi_link import CLEAN_S, ScpiLink
from rig.errors import DeviceError, UsageError

WHO = "MAKER,MODEL,7,1.0"
Reply = tuple[float, bytes]
Answer = Callable[[str], Reply | None]


@dataclass
class Peer:
    """An instrument on a real socket: ``answer`` says how late, and what, the reply to a query is."""

    answer: Answer
    who: str = WHO
    heard: list[str] = field(default_factory=list)
    connections: int = 0
    errors: list[str] = field(default_factory=list)
    hang_up: bool = False
    number: str = "0"

    def reply(self, command: str) -> Reply | None:
        if fence := re.fullmatch(r"\*CLS;\*ESE (\d+);\*ESE\?", command):
            self.errors.clear()
            return 0.0, fence[1].encode() + b"\r\n"
        if command == "*IDN?":
            return 0.0, self.who.encode() + b"\r\n"
        if command == "SYST:ERR?":
            return 0.0, (self.errors.pop(0) if self.errors else '0,"No error"').encode() + b"\r\n"
        return self.answer(command)

    def serve(self, listener: socket.socket, over: threading.Event) -> None:
        while not over.is_set():
            with suppress(TimeoutError, ConnectionError):
                connection, _ = listener.accept()
                self.connections += 1
                with connection:
                    self.talk(connection, over)

    def talk(self, connection: socket.socket, over: threading.Event) -> None:
        connection.settimeout(0.01)
        text = b""
        while not over.is_set() and not self.hang_up:
            with suppress(TimeoutError):
                data = connection.recv(4096)
                if not data:
                    return
                text += data
            while b"\n" in text:
                line, _, text = text.partition(b"\n")
                self.heard.append(line.decode("latin-1").strip())
                said = self.reply(self.heard[-1])
                if said is not None:
                    time.sleep(said[0])
                    connection.sendall(said[1])


@contextmanager
def linked(answer: Answer, **more: str) -> Iterator[tuple[Peer, ScpiLink]]:
    peer, over = Peer(answer, **more), threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(0.02)
        thread = threading.Thread(target=peer.serve, args=(listener, over))
        thread.start()
        link = ScpiLink(f"TCPIP::127.0.0.1::{listener.getsockname()[1]}::SOCKET", "\r\n")
        try:
            link.introduce()
            yield peer, link
        finally:
            link.close()
            over.set()
            thread.join()


def said(text: str) -> Reply:
    return 0.0, text.encode() + b"\r\n"


def block(payload: bytes) -> bytes:
    return f"#{len(str(len(payload)))}{len(payload)}".encode() + payload


def test_a_query_gets_its_line() -> None:
    with linked(lambda query: said(f"reply to {query}")) as (_, link):
        assert link.introduce() == WHO
        assert [link.ask(f"Q{k}?") for k in range(3)] == [f"reply to Q{k}?" for k in range(3)]


def test_a_late_reply_is_not_the_answer_to_the_next_query() -> None:
    late = {"SLOW?": 0.6}
    with linked(lambda query: (late.get(query, 0.0), f"reply to {query}\r\n".encode())) as (peer, link):
        with pytest.raises(DeviceError, match="no answer"):
            link.ask("SLOW?", timeout_s=0.2)
        assert link.ask("NEXT?") == "reply to NEXT?"
        assert link.ask("LAST?") == "reply to LAST?"
        assert peer.connections == 1


def test_a_late_identity_is_not_taken_for_the_handshake() -> None:
    with linked(lambda query: said(f"reply to {query}")) as (peer, link):
        answer, slow = peer.reply, {"*IDN?": 0.5}
        peer.reply = lambda command: (slow.pop(command, 0.0), (answer(command) or said(""))[1])  # type: ignore[method-assign]
        with pytest.raises(DeviceError, match="no answer"):
            link.ask("*IDN?", timeout_s=0.1)
        assert link.ask("NEXT?") == "reply to NEXT?"


@pytest.mark.parametrize("number", [100, 137, 200, 255])
def test_a_late_reply_that_is_a_number_does_not_pass_for_the_fence(number: int) -> None:
    """The late reply may be any number; should it be that of the fence, the identity is out of step and tells."""
    with linked(lambda query: (0.6, f"{number}\r\n".encode()) if query == "N?" else said(query)) as (peer, link):
        answer = peer.reply

        def twice(command: str) -> Reply | None:
            reply = answer(command)
            fence = re.fullmatch(r"\*CLS;\*ESE (\d+);\*ESE\?", command)
            return (0.0, 2 * reply[1]) if fence and reply and len(peer.heard) < 5 else reply

        peer.reply = twice  # type: ignore[method-assign]
        with pytest.raises(DeviceError, match="no answer"):
            link.ask("N?", timeout_s=0.05)
        assert link.ask("A?") == "A?"
        assert link.ask("B?") == "B?"


def test_a_reply_sent_twice_is_not_the_answer_to_the_next_query() -> None:
    with linked(lambda query: (0.0, 2 * f"reply to {query}\r\n".encode())) as (_, link):
        assert link.ask("A?") == "reply to A?"
        time.sleep(0.05)
        assert link.ask("B?") == "reply to B?"


def test_a_block_may_hold_line_feeds_and_arrive_in_pieces() -> None:
    payload = bytes(range(256)) * 400 + b"\n#15\r\n"
    with linked(lambda query: (0.0, block(payload) + b"\r\n")) as (_, link):
        assert link.ask_block("D?", len(payload)) == payload
        assert link.ask_block("D?", len(payload)) == payload


@pytest.mark.parametrize(("reply", "message"), [
    (block(b"x" * 100)[:60], "55 of 100 bytes"),
    (b"#9999999999" + b"x" * 50, "a block of 999999999 bytes"),
    (b"#0abc\r\n", "begins with #"),
    (b"12.5\r\n", "begins with #"),
    (b"#3 12\r\n", "the size of a block"),
    (block(b"x" * 100) + b"xx\r\n", "more than the 100 bytes"),
    (b"", "0 of 2 bytes"),
])
def test_a_block_that_is_not_as_it_says_is_refused_and_the_link_recovers(reply: bytes, message: str) -> None:
    with linked(lambda query: (0.0, reply) if query == "D?" else said("fine")) as (_, link):
        with pytest.raises(DeviceError, match=message):
            link.ask_block("D?", 100, timeout_s=0.2)
        assert link.ask("NEXT?") == "fine"


def test_a_block_cut_short_that_ends_later_is_dropped_whole() -> None:
    """The rest of the block holds what looks like lines; none of them answers the next query."""
    rest = b"1\r\n".join([b""] * 40)
    with linked(lambda query: said("fine")) as (peer, link):
        answer, pieces = peer.reply, {"D?": [(0.0, block(rest)[:20])], "*IDN?": []}
        peer.reply = lambda command: pieces[command].pop() if pieces.get(command) else answer(command)  # type: ignore[method-assign]
        with pytest.raises(DeviceError, match="15 of 117 bytes"):
            link.ask_block("D?", 1000, timeout_s=0.1)
        pieces["*IDN?"].append((0.0, block(rest)[20:] + b"\r\n" + WHO.encode() + b"\r\n"))
        assert link.ask("NEXT?") == "fine"


def test_errors_in_the_queue_are_told_with_the_command() -> None:
    with linked(lambda query: None) as (peer, link):
        link.tell("VOLT 1")
        peer.errors += ['-222,"Data out of range"', '-113,"Undefined header"']
        with pytest.raises(DeviceError, match=r"VOLT 99.*-222.*-113"):
            link.tell("VOLT 99")
        link.tell("VOLT 2")
        assert "VOLT 2" in peer.heard


def test_a_peer_that_hangs_up_is_told_at_once_and_found_again() -> None:
    with linked(said) as (peer, link):
        peer.hang_up = True
        time.sleep(0.05)
        begun = time.monotonic()
        with pytest.raises(DeviceError, match=r"closed the connection|link to the device is gone"):
            link.ask("A?", timeout_s=3.0)
        assert time.monotonic() - begun < 2.0
        peer.hang_up = False
        assert link.ask("B?") == "B?"
        assert peer.connections == 2


def test_another_device_behind_the_address_is_refused() -> None:
    with linked(lambda query: None) as (peer, link):
        peer.who = "MAKER,MODEL,8,1.0"
        with pytest.raises(DeviceError, match="no answer"):
            link.ask("A?", timeout_s=0.05)
        with pytest.raises(DeviceError, match=r"another device answers.*'MAKER,MODEL,8,1.0'"):
            link.ask("B?")


def test_a_peer_that_reads_nothing_does_not_hold_a_write_up() -> None:
    with linked(lambda query: said("fine")) as (peer, link):
        answer = peer.reply
        peer.reply = lambda command: time.sleep(1.5) or answer(command) if command == "A?" else answer(command)  # type: ignore[func-returns-value, method-assign]
        with pytest.raises(DeviceError, match="no answer"):
            link.ask("A?", timeout_s=0.05)
        begun = time.monotonic()
        with pytest.raises(DeviceError):
            link._wire.send(bytes(20_000_000), timeout_s=0.2)
        assert time.monotonic() - begun < 1.0


def test_nobody_there_is_told_within_the_deadline() -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    begun = time.monotonic()
    with pytest.raises(DeviceError, match=r"link to the device is gone.*refused"):
        ScpiLink(f"TCPIP::127.0.0.1::{port}::SOCKET")
    assert time.monotonic() - begun < CLEAN_S + 4.0


@pytest.mark.parametrize("name", ["", "ASRL/dev/ttyUSB0::INSTR", "TCPIP::host::INSTR", "nonsense"])
def test_other_resources_are_refused(name: str) -> None:
    with pytest.raises(UsageError, match="TCPIP::HOST::PORT::SOCKET"):
        ScpiLink(name)


def test_a_device_without_an_identity_is_given_up_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.scpi_link.CLEAN_S", 0.3)
    begun = time.monotonic()
    with pytest.raises(DeviceError, match="tells no identity: 'hello'"), linked(lambda query: None, who="hello"):
        pass
    assert time.monotonic() - begun < 2.0


def test_a_link_that_stays_broken_is_mended_for_a_while_once_and_then_tried_once_each_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("drivers.scpi_link.CLEAN_S", 0.5)
    monkeypatch.setattr("drivers.scpi_link.FENCE_S", 0.1)
    with linked(lambda query: None) as (peer, link):
        peer.reply = lambda command: None  # type: ignore[method-assign]
        with pytest.raises(DeviceError, match="no answer"):
            link.ask("A?", timeout_s=0.05)
        fences = []
        for _ in range(3):
            before = sum("*ESE?" in line for line in peer.heard)
            with pytest.raises(DeviceError, match="no answer"):
                link.ask("B?")
            fences.append(sum("*ESE?" in line for line in peer.heard) - before)
    assert fences[0] > 1
    assert fences[1:] == [1, 1]


def test_what_is_shouted_is_heard_by_a_device_that_answers_no_more() -> None:
    with linked(lambda query: said("fine")) as (peer, link):
        answer = peer.reply
        peer.reply = lambda command: None  # type: ignore[method-assign]
        with pytest.raises(DeviceError, match="no answer"):
            link.ask("A?", timeout_s=0.05)
        link.shout("SOUR:VOLT 0", "OUTP OFF")
        time.sleep(0.1)
        assert peer.heard[-2:] == ["SOUR:VOLT 0", "OUTP OFF"]
        peer.reply = answer  # type: ignore[method-assign]
        assert link.ask("B?") == "fine"
        assert "*ESE?" in peer.heard[-3], "the link was fenced before it was believed again"


def test_a_queue_full_of_errors_is_told_in_few_words() -> None:
    def answer(query: str) -> Reply | None:
        return None

    with linked(answer) as (peer, link):
        peer.errors = ['-350,"Queue overflow"'] * 50
        with pytest.raises(DeviceError, match="Queue overflow") as failure:
            link.tell(*["SOUR:VOLT 1"] * 100)
    assert len(str(failure.value)) < 500


def test_a_device_that_sends_without_end_is_given_up_in_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("drivers.scpi_link.CLEAN_S", 0.2)
    monkeypatch.setattr("drivers.visa_wire.FLOOD_S", 0.2)

    def flood(listener: socket.socket) -> None:
        with suppress(OSError):
            while True:
                connection = listener.accept()[0]
                with connection, suppress(OSError):
                    while True:
                        connection.sendall(b"noise" * 1000)

    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=flood, args=(listener,), daemon=True)
        thread.start()
        begun = time.monotonic()
        with pytest.raises(DeviceError, match=r"without end|a line without an end"):
            ScpiLink(f"TCPIP::127.0.0.1::{listener.getsockname()[1]}::SOCKET").introduce()
        assert time.monotonic() - begun < 4.0
        listener.shutdown(socket.SHUT_RDWR)
    thread.join(2)
