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
        size = _size(raw, at)
        if size and at + size <= len(raw) and (frame := _frame(raw, at, size)) is not None:
            return at, frame
        at = raw.find(MARKER, at + 1)
    return None


def _unfinished(raw: bytes, start: int) -> int:
    """Return where the first frame begins that more bytes may complete; there is no whole one from ``start`` on."""
    at = raw.find(MARKER, start)
    while at >= 0:
        size = _size(raw, at)
        if size is None or (size and at + size > len(raw)):
            return at
        at = raw.find(MARKER, at + 1)
    return len(raw) - raw.endswith(MARKER[:1], start)


def _size(raw: bytes, at: int) -> int | None:
    """Return the size of the frame whose header is at ``at``: 0 when it is none, None when it cannot be told."""
    head = raw[at:at + _HEAD_SIZE]
    if len(head) < _HEAD_SIZE:
        return None
    length = int(_HEADER.unpack_from(head)[3])
    right = _HEADER_CHECK.unpack_from(head, _HEADER.size)[0] == crc_hqx(head[:_HEADER.size], 0)
    return OVERHEAD + length if right and length <= MAX_PAYLOAD else 0


def _frame(raw: bytes, at: int, size: int) -> Frame | None:
    """Return the frame of ``size`` bytes at ``at``, None when its check fails."""
    end = at + size - _CHECK.size
    if _CHECK.unpack_from(raw, end)[0] != zlib.crc32(raw[at:end]):
        return None
    _, kind, number, _ = _HEADER.unpack_from(raw, at)
    return Frame(kind, number, raw[at + _HEAD_SIZE:end])
