"""What do an emulated USB device and the host's backend say to each other over a TCP connection?

One request, one answer: a letter, a length, a payload. The host asks and waits; the device answers a bulk read as soon
as it has something, or with ``TIMEOUT`` when the time the host gave is over.
"""

import socket
import struct
from dataclasses import dataclass
from typing import final

DESCRIBE, CLAIM, RELEASE, BULK_OUT, BULK_IN, CONTROL = b"D", b"K", b"R", b"O", b"I", b"C"
DONE, TIMEOUT, STALL, BUSY = b"A", b"T", b"S", b"B"
HEAD = struct.Struct("<cI")
IDS = struct.Struct("<HH")
READ = struct.Struct("<II")
SETUP = struct.Struct("<BBHHH")
"""Of a control transfer: request type, request, value, index, length (USB 2.0, 9.3)."""
LANGUAGE, STRINGS = 0x0409, {1: "maker", 2: "product", 3: "serial"}


@dataclass(frozen=True)
class Descriptor:
    """Who the device is on the bus."""

    vendor: int
    product: int
    maker: str
    name: str
    serial: str

    def string(self, index: int) -> bytes:
        """Return a string descriptor (USB 2.0, 9.6.7); empty for one that is not there."""
        if index == 0:
            return struct.pack("<BBH", 4, 3, LANGUAGE)
        text = {1: self.maker, 2: self.name, 3: self.serial}.get(index)
        if text is None:
            return b""
        data = text.encode("utf-16-le")
        return struct.pack("<BB", len(data) + 2, 3) + data


def packed(letter: bytes, payload: bytes = b"") -> bytes:
    """Return a request or an answer as bytes."""
    return HEAD.pack(letter, len(payload)) + payload


@final
class Packets:
    """Cuts a stream of bytes into requests or answers."""

    def __init__(self) -> None:
        """Start with nothing received."""
        self._data = bytearray()

    def feed(self, data: bytes) -> list[tuple[bytes, bytes]]:
        """Return the (letter, payload) that are complete with ``data``."""
        self._data += data
        found = []
        while len(self._data) >= HEAD.size:
            letter, size = HEAD.unpack_from(self._data)
            if len(self._data) < HEAD.size + size:
                break
            found.append((letter, bytes(self._data[HEAD.size:HEAD.size + size])))
            del self._data[:HEAD.size + size]
        return found


def received(connection: socket.socket) -> tuple[bytes, bytes]:
    """Return the next (letter, payload) of a blocking connection; raise ConnectionError at its end."""
    letter, size = HEAD.unpack(_exactly(connection, HEAD.size))
    return letter, _exactly(connection, size)


def _exactly(connection: socket.socket, count: int) -> bytes:
    data = bytearray()
    while len(data) < count:
        more = connection.recv(min(1 << 20, count - len(data)))
        if not more:
            raise ConnectionError("the cable was pulled")
        data += more
    return bytes(data)
