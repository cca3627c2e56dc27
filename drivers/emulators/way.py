"""How do pieces of messages travel one way of an emulated link, each in its time and none before another?"""

from collections import deque
from collections.abc import Iterable
from typing import final

from drivers.emulators.faults import Piece


@final
class Way:
    """One direction: pieces that wait for their time, in their order."""

    def __init__(self) -> None:
        """Start with nothing under way."""
        self._pieces: deque[tuple[float, bytes]] = deque()
        self._not_before_s = 0.0

    def put(self, pieces: Iterable[Piece], now_s: float, delay_s: float = 0.0) -> None:
        """Put pieces on their way."""
        for piece in pieces:
            self._not_before_s = max(self._not_before_s, now_s + delay_s) + piece.after_s
            self._pieces.append((self._not_before_s, piece.data))

    def due(self, now_s: float) -> list[bytes]:
        """Return the pieces that have arrived by now."""
        arrived = []
        while self._pieces and self._pieces[0][0] <= now_s:
            arrived.append(self._pieces.popleft()[1])
        return arrived

    def __bool__(self) -> bool:
        """Return whether anything is under way."""
        return bool(self._pieces)
