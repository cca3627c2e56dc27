"""How do bytes cross a pyvisa resource, each crossing under a deadline of its own?

pyvisa-py moves the bytes. What it leaves open is closed here: a read that times out keeps what did arrive, a peer that
closed its TCP socket is told at once and not after a time-out, and a peer that reads nothing cannot hold a write up.
"""

import select
import socket
import time
from abc import ABC, abstractmethod
from contextlib import suppress
from typing import Any, ClassVar, final

from drivers.visa_resource import opened, told
from rig.errors import DeviceError, UsageError
from rig.transcript import ongoing

SLICE_S, FLOOD_S = 0.05, 2.0
PIECE = 4096
"""Bytes written at once to a socket: pyvisa-py waits without end for room, so room is awaited here before each."""
MESSAGE = 1 << 18
"""Bytes asked of a USBTMC device at once; pyvisa-py does not tell the end of a message, a shorter answer does."""
LINE_MOST = 1 << 16


class VisaWire(ABC):
    """Bytes to and from one instrument. Every method raises DeviceError when its time is over or the link is gone.

    ``marks_ends``: the transport itself tells where a message ends.
    """

    marks_ends: ClassVar[bool] = False

    def __init__(self, resource_name: str) -> None:
        """Open the resource of this name."""
        self.name = resource_name
        self._kept, self._more = b"", False
        self._transcript = ongoing()
        self._open()

    @abstractmethod
    def send(self, data: bytes, timeout_s: float) -> None:
        """Send all of ``data``."""

    @abstractmethod
    def line(self, timeout_s: float) -> bytes:
        """Return the next line, without its end."""

    @abstractmethod
    def exactly(self, count: int, timeout_s: float) -> bytes:
        """Return the next ``count`` bytes, whatever is in them."""

    @abstractmethod
    def end_of_message(self, timeout_s: float) -> bool:
        """Return whether what was read ends here, but for an end of line, which is taken away."""

    @abstractmethod
    def waiting(self) -> bool:
        """Return whether bytes are there that nobody asked for; False where asking would be an error by itself."""

    @abstractmethod
    def forget(self) -> None:
        """Drop what was received and not read."""

    @final
    def reopen(self) -> None:
        """Close the resource and open it again: after a replug, or when the peer hung up."""
        self.close()
        self._open()

    @final
    def close(self) -> None:
        """Release the resource; harmless when it is gone."""
        with suppress(Exception):
            self._resource.close()

    @final
    def _open(self) -> None:
        """Open the resource and find the session that pyvisa-py made for it."""
        self._resource = opened(self.name)
        self._session: Any = self._resource.visalib.sessions[self._resource.session]  # type: ignore[attr-defined]
        try:
            self._prepare()
            self.forget()
        except DeviceError:
            self.close()
            raise

    @abstractmethod
    def _prepare(self) -> None:
        """Set what the resource needs once it is open."""

    @final
    def _read(self, count: int, timeout_s: float) -> bytes:
        """Return up to ``count`` bytes, fewer when the time is over, with pyvisa-py's own rules of when to stop."""
        with told(self.name):
            self._resource.timeout = max(1.0, 1000 * timeout_s)
            data = bytes(self._session.read(count)[0])
        self._transcript.received(data)
        return data

    @final
    def _silent(self, missing: str, timeout_s: float) -> DeviceError:
        """Return the error for an answer that did not come in time."""
        return DeviceError("no answer", where=self.name, value=f"{missing} after {timeout_s:.3g} s",
                           do="check power, cable and address of the device")


@final
class SocketWire(VisaWire):
    """A TCP socket: a stream of bytes in which only lines and counts tell where an answer ends."""

    def send(self, data: bytes, timeout_s: float) -> None:
        """Send ``data`` in pieces, each when there is room for it."""
        deadline = time.monotonic() + timeout_s
        self._transcript.sent(data)
        for start in range(0, len(data), PIECE):
            with told(self.name):
                self._await_room(deadline)
                self._session.write(data[start:start + PIECE])

    def line(self, timeout_s: float) -> bytes:
        """Return the next line; raise DeviceError for one without an end."""
        self._stop_at_line_ends(True)
        line = bytearray()
        deadline = time.monotonic() + timeout_s
        while not line.endswith(b"\n"):
            line += self._some(PIECE, deadline, f"{bytes(line[:40])!r}", timeout_s)
            if len(line) > LINE_MOST:
                raise _endless(self.name, len(line))
        return bytes(line).rstrip(b"\r\n")

    def exactly(self, count: int, timeout_s: float) -> bytes:
        """Return the next ``count`` bytes."""
        self._stop_at_line_ends(False)
        data = bytearray()
        deadline = time.monotonic() + timeout_s
        while len(data) < count:
            data += self._some(count - len(data), deadline, f"{len(data)} of {count} bytes", timeout_s)
        return bytes(data)

    def end_of_message(self, timeout_s: float) -> bool:
        """Return whether the rest of the line is empty."""
        return not self.line(timeout_s)

    def waiting(self) -> bool:
        """Return whether something arrived; it is kept out of the next answer by ``forget``."""
        self._stop_at_line_ends(False)
        return bool(self._read(1, 0.0))

    def forget(self) -> None:
        """Drop what arrived until now, but wait for nothing; raise DeviceError when it does not end."""
        self._stop_at_line_ends(False)
        deadline = time.monotonic() + FLOOD_S
        while self._read(PIECE, 0.0):
            if time.monotonic() > deadline:
                raise DeviceError("the device sends without being asked, without end", where=self.name,
                                  do="check that the address is right, then restart the device")

    def _prepare(self) -> None:
        """Have every message sent at once: held back until the one before is acknowledged it would come 40 ms late."""
        with told(self.name):
            self._session.interface.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def _some(self, count: int, deadline: float, so_far: str, timeout_s: float) -> bytes:
        """Return up to ``count`` bytes as soon as there are any."""
        while not (data := self._read(count, SLICE_S)):
            self._refuse_hung_up()
            if time.monotonic() > deadline:
                raise self._silent(so_far, timeout_s)
        return data

    def _stop_at_line_ends(self, stop: bool) -> None:
        """Make a read end at a line feed, or at its count only."""
        from pyvisa.constants import ResourceAttribute

        self._resource.set_visa_attribute(ResourceAttribute.termchar_enabled, stop)

    def _await_room(self, deadline: float) -> None:
        """Wait until the socket takes more bytes; raise DeviceError when it does not in time."""
        ready = select.select([], [self._session.interface], [], max(0.0, deadline - time.monotonic()))[1]
        if not ready:
            raise DeviceError("the device takes no more data", where=self.name, do="restart it")

    def _refuse_hung_up(self) -> None:
        """Raise DeviceError when the peer closed the connection; pyvisa-py would wait for it until the time is over."""
        with told(self.name), suppress(BlockingIOError):
            if not self._session.interface.recv(1, socket.MSG_PEEK | socket.MSG_DONTWAIT):
                raise ConnectionResetError("the device closed the connection")


@final
class UsbtmcWire(VisaWire):
    """USBTMC: messages whose end the device marks. A read aborted by pyvisa-py may take 5 s more than its time."""

    marks_ends = True

    def send(self, data: bytes, timeout_s: float) -> None:
        """Send ``data`` as one message."""
        self._transcript.sent(data)
        with told(self.name):
            self._resource.timeout = max(1.0, 1000 * timeout_s)
            self._session.write(data)

    def line(self, timeout_s: float) -> bytes:
        """Return what the device answers in one message."""
        data, self._kept = self._kept, b""
        line = data or self._message(timeout_s)
        if len(line) > LINE_MOST:
            raise _endless(self.name, len(line))
        return line.rstrip(b"\r\n")

    def exactly(self, count: int, timeout_s: float) -> bytes:
        """Return the next ``count`` bytes; a device may spread them over messages."""
        deadline = time.monotonic() + timeout_s
        pieces, have = [self._kept], len(self._kept)
        while have < count:
            if time.monotonic() > deadline:
                raise self._silent(f"{have} of {count} bytes", timeout_s)
            pieces.append(self._message(deadline - time.monotonic()))
            have += len(pieces[-1])
        data = b"".join(pieces)
        self._kept = data[count:]
        return data[:count]

    def end_of_message(self, timeout_s: float) -> bool:
        """Return whether nothing but an end of line is left; what is not known for certain is no end."""
        rest, self._kept = self._kept, b""
        return not self._more and rest in (b"", b"\n", b"\r\n")

    def waiting(self) -> bool:
        """Return whether part of an answer was left over; to ask a device for more than it has is an error."""
        return bool(self._kept)

    def forget(self) -> None:
        """Drop what is left of the last message."""
        self._kept, self._more = b"", False

    def _prepare(self) -> None:
        """Do nothing."""

    def _message(self, timeout_s: float) -> bytes:
        """Return the next message, or its next part where it is long."""
        data = self._read(MESSAGE, timeout_s)
        if not data:
            raise self._silent("nothing", timeout_s)
        self._more = len(data) >= MESSAGE
        return data


def _endless(name: str, count: int) -> DeviceError:
    """Return the error for a line that does not end."""
    return DeviceError("a line without an end", where=name, value=f"{count} bytes", allowed=f"at most {LINE_MOST}")


def wire(resource_name: str) -> VisaWire:
    """Return the wire to the resource of this name, opened; raise UsageError for another kind of resource."""
    name = resource_name.upper()
    if name.startswith("TCPIP") and name.endswith("::SOCKET"):
        return SocketWire(resource_name)
    if name.startswith("USB") and name.endswith("::INSTR"):
        return UsbtmcWire(resource_name)
    raise UsageError("not an address of such a device", value=repr(resource_name),
                     allowed="TCPIP::HOST::PORT::SOCKET or USB0::VENDOR::PRODUCT::SERIAL::INSTR")
