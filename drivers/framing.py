"""How are messages found again in a stream of bytes that loses, corrupts and splits them?

A frame on the wire, little endian::

    A5 5A | kind u8 | number u32 | length u16 | CRC-16 of the header so far | payload | CRC-32 of header and payload

The header has a check of its own, so that a damaged length does not make the reader wait for bytes that never come.
CRC-16 is CCITT (polynomial 1021h, start 0), CRC-32 that of zlib.
"""

import zlib
from binascii import crc_hqx
from dataclasses import dataclass
from enum import Enum
from struct import Struct

MARKER = b"\xa5\x5a"
MAX_PAYLOAD = 2048
"""Bytes; small enough for the memory of a microcontroller, and for a prompt repetition."""

_HEADER = Struct("<2sBIH")
_HEADER_CHECK = Struct("<H")
_HEAD = Struct("<2sBIHH")
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
        self._rest = b""
        self.skipped = 0

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that ``data`` completes, in their order."""
        raw, at, frames = self._rest + data, 0, []
        while (found := _first(raw, at)) is not None:
            start, frame = found
            self.skipped += start - at
            at = start + OVERHEAD + len(frame.payload)
            frames.append(frame)
        keep = _unfinished(raw, at)
        self.skipped += keep - at
        self._rest = raw[keep:]
        return frames

    def clear(self) -> None:
        """Forget what was read and not understood."""
        self.skipped += len(self._rest)
        self._rest = b""


def _first(raw: bytes, at: int) -> tuple[int, Frame] | None:
    """Return the first whole frame from ``at`` on and where it begins, None when there is none."""
    at = raw.find(MARKER, at)
    while at >= 0:
        if isinstance(found := _frame(raw, at), Frame):
            return at, found
        at = raw.find(MARKER, at + 1)
    return None


def _unfinished(raw: bytes, start: int) -> int:
    """Return where the first frame begins that more bytes may complete; there is no whole one from ``start`` on."""
    at = raw.find(MARKER, start)
    while at >= 0:
        if _frame(raw, at) is _Not.YET:
            return at
        at = raw.find(MARKER, at + 1)
    return len(raw) - raw.endswith(MARKER[:1], start)


class _Not(Enum):
    """Why there is no frame at a marker: more bytes may make one, or none can."""

    YET = "unfinished"
    EVER = "damaged"


def _frame(raw: bytes, at: int) -> Frame | _Not:
    """Return the frame whose marker is at ``at``."""
    start = at + _HEAD_SIZE
    if start > len(raw):
        return _Not.YET
    _, kind, number, length, check = _HEAD.unpack_from(raw, at)
    if length > MAX_PAYLOAD or check != crc_hqx(raw[at:at + _HEADER.size], 0):
        return _Not.EVER
    end = start + length
    if end + _CHECK.size > len(raw):
        return _Not.YET
    if _CHECK.unpack_from(raw, end)[0] != zlib.crc32(raw[at:end]):
        return _Not.EVER
    return Frame(kind, number, raw[start:end])
