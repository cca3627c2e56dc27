"""What crossed the wire to a device and from it, byte by byte, as far as there is room to keep it?

Links report what they send and receive to the transcript that is being taken, if any is. Drivers are plug-ins that are
connected by an address alone; therefore it is found by asking (``ongoing``), not handed through.
"""

import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import final

from rig.provenance import now

MOST = 1 << 20  # bytes kept of all that crosses: the first half, and the last
PIECE = 1 << 16  # bytes kept of one piece
Said = tuple[float, str, bytes, int]
"""When, s; > to the device or < from it; the bytes kept; how many there were."""


@final
class Transcript:
    """All that crossed a wire, the middle left out where it is much."""

    def __init__(self, most: int = MOST, piece: int = PIECE) -> None:
        """Begin; of each direction together the first and the last ``most`` / 2 bytes are kept."""
        self._half, self._piece = most // 2, piece
        self._began, self._since_s = now(), time.monotonic()
        self._first: list[Said] = []
        self._last: deque[Said] = deque()
        self._kept = [0, 0]
        self._left_out = [0, 0]

    def sent(self, data: bytes) -> None:
        """Note bytes that went to the device."""
        self._note(">", data)

    def received(self, data: bytes) -> None:
        """Note bytes that came from it; none is no news."""
        self._note("<", data)

    def text(self) -> str:
        """Return a line for every piece: seconds, direction, the bytes as Python writes them; empty without any."""
        if not self._first and not self._last:
            return ""
        pieces, count = self._left_out
        gap = [f"# left out here: {count} bytes in {pieces} pieces"] if pieces else []
        head = f"# seconds since {self._began}, > to the device, < from it, the bytes"
        return "\n".join([head, *map(_line, self._first), *gap, *map(_line, self._last), ""])

    def _note(self, direction: str, data: bytes) -> None:
        if not data:
            return
        said = (time.monotonic() - self._since_s, direction, bytes(data[: self._piece]), len(data))
        size = len(said[2])
        if not self._last and self._kept[0] + size <= self._half:
            self._first.append(said)
            self._kept[0] += size
            return
        self._last.append(said)
        self._kept[1] += size
        while self._kept[1] > self._half:
            _, _, kept, count = self._last.popleft()
            self._kept[1] -= len(kept)
            self._left_out = [self._left_out[0] + 1, self._left_out[1] + count]


def _line(said: Said) -> str:
    at_s, direction, kept, count = said
    return f"{at_s:.6f} {direction} {kept!r}{f' and {count - len(kept)} more' if count > len(kept) else ''}"


@final
class NoTranscript:
    """What links report to when nobody asked for a transcript."""

    def sent(self, data: bytes) -> None:
        """Forget it."""

    def received(self, data: bytes) -> None:
        """Forget it."""

    def text(self) -> str:
        """Return nothing."""
        return ""


_ongoing: ContextVar[Transcript | NoTranscript] = ContextVar("transcript", default=NoTranscript())  # noqa: B039


def ongoing() -> Transcript | NoTranscript:
    """Return the transcript that is being taken now; links that are opened meanwhile report to it."""
    return _ongoing.get()


@contextmanager
def taken(wanted: bool = True) -> Iterator[None]:
    """Take a transcript of all links that are opened inside, where it is ``wanted``."""
    before = _ongoing.set(Transcript() if wanted else NoTranscript())
    try:
        yield
    finally:
        _ongoing.reset(before)
