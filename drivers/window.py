"""How is the part of a long series held that is in use, in memory that does not grow with the series?"""

from typing import Any, final

import numpy as np
from numpy.typing import DTypeLike, NDArray

LEAST = 4096
"""Entries held at first."""


@final
class Window:
    """Entries by their number in the series, 0 where nothing was written; those before ``forget`` are gone.

    It is as long as what lies between the first entry kept and the last one written.
    """

    def __init__(self, dtype: DTypeLike, *row: int) -> None:
        """Start empty; ``row`` is the shape of one entry."""
        self._held: NDArray[Any] = np.zeros((LEAST, *row), dtype)
        self._first = self._top = 0

    def part(self, start: int, stop: int) -> NDArray[Any]:
        """Return the entries [start, stop), to be read or written at once: the next call may move them.

        Raises ValueError for entries that are gone.
        """
        if start < self._first:
            raise ValueError(f"entry {start} is gone, the first is {self._first}")
        self._top = max(self._top, stop)
        if self._top - self._first > len(self._held):
            larger = np.zeros((2 * (self._top - self._first), *self._held.shape[1:]), self._held.dtype)
            larger[:len(self._held)] = self._held
            self._held = larger
        return self._held[start - self._first:stop - self._first]

    def forget(self, until: int) -> None:
        """Let go of the entries before ``until``."""
        if until - self._first < len(self._held) // 2:
            return
        kept = self._held[until - self._first:max(until, self._top) - self._first].copy()
        self._held[:max(until, self._top) - self._first] = 0
        self._held[:len(kept)] = kept
        self._first = until
