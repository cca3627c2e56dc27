"""How are messages found again in a stream of bytes that loses, corrupts and splits them?

A frame on the wire, little endian::

    A5 5A | kind u8 | number u32 | length u16 | CRC-16 of the header so far | payload | CRC-32 of header and payload

The header has a check of its own, so that a damaged length does not make the reader wait for bytes that never come.
CRC-16 is CCITT (polynomial 1021h, start 0), CRC-32 that of zlib.
"""

import zlib
from binascii import crc_hqx
from dataclasses import dataclass
from struct import Struct

MARKER = b"\xa5\x5a"
MAX_PAYLOAD = 2048
"""Bytes; small enough for the memory of a microcontroller, and for a prompt repetition."""

_HEADER = Struct("<2sBIH")
_HEADER_CHECK = Struct("<H")
_CHECK = Struct("<I")
_HEAD_SIZE = _HEADER.size + _HEADER_CHECK.size
OVERHEAD = _HEAD_SIZE + _CHECK.size
"""Bytes of a frame beside its payload."""


@dataclass(frozen=True)
class Frame:
    """One message: what kind, its number (of a command, or of the first sample), and its content."""

    kind: int
    number: int
    payload: bytes = b""


def encode(frame: Frame) -> bytes:
    """Return the bytes of ``frame`` on the wire; raise ValueError when it does not fit one."""
    if len(frame.payload) > MAX_PAYLOAD:
        raise ValueError(f"a frame holds at most {MAX_PAYLOAD} bytes, not {len(frame.payload)}")
    header = _HEADER.pack(MARKER, frame.kind, frame.number, len(frame.payload))
    body = header + _HEADER_CHECK.pack(crc_hqx(header, 0)) + frame.payload
    return body + _CHECK.pack(zlib.crc32(body))


class FrameReader:
    """Turns bytes, however they are cut, into the frames that arrived whole.

    A frame is taken as soon as it is whole, even where it stands inside the wreck of one that lost bytes: nothing waits
    for a time-out. ``skipped`` counts the bytes that belonged to no whole frame.
    """

    def __init__(self) -> None:
        """Start with nothing read."""
        self._buffer = bytearray()
        self.skipped = 0

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that ``data`` completes, in their order."""
        self._buffer += data
        frames = []
        while (frame := self._next()) is not None:
            frames.append(frame)
        return frames

    def clear(self) -> None:
        """Forget what was read and not understood."""
        self.skipped += len(self._buffer)
        self._buffer.clear()

    def _next(self) -> Frame | None:
        """Return the first whole frame and drop all up to its end; keep from the first unfinished one on."""
        unfinished = len(self._buffer) - self._buffer.endswith(MARKER[:1])
        at = self._buffer.find(MARKER)
        while at >= 0:
            size = self._size(at)
            if size is None or (size and at + size > len(self._buffer)):
                unfinished = min(unfinished, at)
            elif size and (frame := self._frame(at, size)) is not None:
                self._drop(at)
                del self._buffer[:size]
                return frame
            at = self._buffer.find(MARKER, at + 1)
        self._drop(unfinished)
        return None

    def _size(self, at: int) -> int | None:
        """Return the size of the frame whose header is at ``at``: 0 when it is none, None when it cannot be told."""
        head = bytes(self._buffer[at:at + _HEAD_SIZE])
        if len(head) < _HEAD_SIZE:
            return None
        length = int(_HEADER.unpack_from(head)[3])
        right = _HEADER_CHECK.unpack_from(head, _HEADER.size)[0] == crc_hqx(head[:_HEADER.size], 0)
        return OVERHEAD + length if right and length <= MAX_PAYLOAD else 0

    def _frame(self, at: int, size: int) -> Frame | None:
        """Return the frame of ``size`` bytes at ``at``, None when its check fails."""
        raw = bytes(self._buffer[at:at + size])
        if _CHECK.unpack_from(raw, size - _CHECK.size)[0] != zlib.crc32(raw[:-_CHECK.size]):
            return None
        _, kind, number, _ = _HEADER.unpack_from(raw)
        return Frame(kind, number, raw[_HEAD_SIZE:-_CHECK.size])

    def _drop(self, count: int) -> None:
        """Skip ``count`` bytes."""
        self.skipped += count
        del self._buffer[:count]
