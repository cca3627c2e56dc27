"""How does an emulated instrument sit on a USB bus: endpoints, USBTMC messages, control requests?

USBTMC 1.0 and its USB488 subclass, as far as a host needs to send, to ask, and to abort what it asked. A reply nobody
fetched stays and comes first: the worst kind of instrument, on which replies slip.
"""

import select
import socket
import struct
import time
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import final

from drivers.emulators.usb_wire import (
    BULK_IN,
    BULK_OUT,
    BUSY,
    CLAIM,
    CONTROL,
    DESCRIBE,
    DONE,
    IDS,
    READ,
    SETUP,
    STALL,
    TIMEOUT,
    Descriptor,
    Packets,
    packed,
)

OUT, REQUEST_IN, IN = 1, 2, 2
"""Message identifiers (USBTMC 1.0, table 2)."""
HEADER = struct.Struct("<BBBxLBxxx")
ABORT_IN, CHECK_ABORT_IN, CAPABILITIES = 3, 4, 7
SUCCESS, USB488 = 1, 0x04
END_OF_MESSAGE = 1
GET_DESCRIPTOR, STRING = 6, 3


@dataclass
class _Read:
    """A bulk read the host waits for."""

    most: int
    until_s: float


@dataclass
class _Host:
    """One connection of a host."""

    connection: socket.socket
    packets: Packets = field(default_factory=Packets)
    read: _Read | None = None


@final
class UsbPort:
    """A USBTMC device whose cable is a TCP socket."""

    def __init__(self, descriptor: Descriptor, resource_name: str) -> None:
        """Wait for a host on a free port."""
        self._descriptor, self._name = descriptor, resource_name
        self._hosts: list[_Host] = []
        self._owner: _Host | None = None
        self._port = 0
        self._listener: socket.socket | None = None
        self._messages: list[bytes] = []
        self.plug()

    @property
    def where(self) -> str:
        """Return the VISA address, and where the cable is."""
        return f"{self._name}?usb=127.0.0.1:{self._port}"

    def hear(self) -> list[bytes]:
        """Return the messages that arrived."""
        self._accept()
        for host in list(self._hosts):
            self._listen(host)
            self._answer_read(host)
        heard, self._messages = self._messages, []
        return heard

    def say(self, data: bytes) -> None:
        """Put a message among those the host may fetch."""
        self._replies.append(bytearray(data))

    def wait(self, seconds: float) -> None:
        """Sleep until a host speaks or connects; while one waits for data, not at all long."""
        sockets = [host.connection for host in self._hosts] + [each for each in (self._listener,) if each]
        select.select(sockets, [], [], min(seconds, 0.001) if any(host.read for host in self._hosts) else seconds)

    def pull(self) -> None:
        """Pull the cable."""
        for host in list(self._hosts):
            self._drop(host)
        if self._listener is not None:
            self._listener.close()
            self._listener = None

    def plug(self) -> None:
        """Plug the cable in again."""
        if self._listener is None:
            self._listener = socket.create_server(("127.0.0.1", self._port), backlog=8)
            self._listener.setblocking(False)
            self._port = self._listener.getsockname()[1]
            self._forget()

    def close(self) -> None:
        """Be gone for good."""
        self.pull()

    def _forget(self) -> None:
        """Start anew: nothing received, nothing to fetch, nothing asked for."""
        self._replies: deque[bytearray] = deque()
        self._partial = bytearray()
        self._request: tuple[int, int] | None = None
        self._aborted = False

    def _accept(self) -> None:
        while self._listener is not None:
            try:
                connection = self._listener.accept()[0]
            except BlockingIOError:
                return
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            connection.settimeout(2.0)
            self._hosts.append(_Host(connection))

    def _listen(self, host: _Host) -> None:
        """Take the host's requests."""
        while select.select([host.connection], [], [], 0)[0]:
            try:
                data = host.connection.recv(1 << 16)
            except OSError:
                data = b""
            if not data:
                self._drop(host)
                return
            for letter, payload in host.packets.feed(data):
                self._do(host, letter, payload)

    def _do(self, host: _Host, letter: bytes, payload: bytes) -> None:
        """Do one request; a read is answered when there is something to read."""
        if letter == BULK_IN:
            most, timeout_ms = READ.unpack(payload)
            host.read = _Read(most, time.monotonic() + timeout_ms / 1000)
        elif letter == CLAIM:
            taken = self._owner not in (None, host)
            self._owner = self._owner if taken else host
            self._answer(host, BUSY if taken else DONE)
        elif letter == CONTROL:
            self._answer(host, *self._control(*SETUP.unpack(payload)))
        else:
            if letter == BULK_OUT:
                self._take(payload)
            facts = IDS.pack(self._descriptor.vendor, self._descriptor.product) if letter == DESCRIBE else b""
            self._answer(host, DONE, facts)

    def _take(self, transfer: bytes) -> None:
        """Take a bulk transfer: part of a message, or the wish to read."""
        kind, tag, _, size, attributes = HEADER.unpack_from(transfer)
        if kind == OUT:
            self._partial += transfer[HEADER.size:HEADER.size + size]
            if attributes & END_OF_MESSAGE:
                self._messages.append(bytes(self._partial))
                self._partial.clear()
        elif kind == REQUEST_IN:
            self._request, self._aborted = (tag, size), False

    def _answer_read(self, host: _Host) -> None:
        """Answer a read with the next part of the first message, or when its time is over."""
        if host.read is None:
            return
        if self._aborted:
            self._aborted, host.read = False, None
            self._answer(host, DONE)
        elif self._request is not None and self._replies:
            data = self._transfer(*self._request)
            self._request, host.read = None, None
            self._answer(host, DONE, data)
        elif time.monotonic() > host.read.until_s:
            host.read = None
            self._answer(host, TIMEOUT)

    def _transfer(self, tag: int, most: int) -> bytes:
        """Return up to ``most`` bytes of the first message behind their header, padded to whole words."""
        message = self._replies[0]
        part = bytes(message[:most])
        del message[:most]
        if not message:
            self._replies.popleft()
        header = HEADER.pack(IN, tag, ~tag & 0xFF, len(part), 0 if message else END_OF_MESSAGE)
        return header + part + bytes(-len(part) % 4)

    def _control(self, kind: int, request: int, value: int, index: int, length: int) -> tuple[bytes, bytes]:
        """Answer a control request."""
        if kind == 0x80 and request == GET_DESCRIPTOR and value >> 8 == STRING:
            text = self._descriptor.string(value & 0xFF)
            return (DONE, text[:length]) if text else (STALL, b"")
        if request == CAPABILITIES:
            return DONE, bytes([SUCCESS] + [0] * 13 + [USB488] + [0] * 9)[:length]
        if request == ABORT_IN:
            pending = self._request is not None
            self._request, self._aborted = None, pending
            return DONE, bytes([SUCCESS if pending else 0x81, value & 0xFF])
        if request == CHECK_ABORT_IN:
            return DONE, bytes([SUCCESS] + [0] * 7)
        return STALL, b""

    def _answer(self, host: _Host, letter: bytes, payload: bytes = b"") -> None:
        with suppress(OSError):
            host.connection.sendall(packed(letter, payload))

    def _drop(self, host: _Host) -> None:
        """Forget a host that has gone."""
        host.connection.close()
        self._hosts.remove(host)
        self._owner = None if self._owner is host else self._owner
