"""What does a long signal do, cell by cell of so many samples, without ever being held whole?"""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array, Samples, part

Places = NDArray[np.int64]


@dataclass(frozen=True)
class Cells:
    """The extremes of a signal, V, in every cell of ``size`` samples, shape (cells,), and the last place of each.

    ``moved`` is how far it went since the cell before, V.
    """

    signal: Samples
    size: int
    low: Array
    high: Array
    low_at: Places
    high_at: Places
    moved: Array

    @classmethod
    def of(cls, signal: Samples, size: int) -> Self:
        """Return the table of a signal, read once; the last cell may be shorter."""
        rows = [_row(signal[first : first + size], first) for first in range(0, signal.size, size)]
        low, low_at, high, high_at, end = (np.array(column) for column in zip(*rows, strict=True))
        before = np.concatenate((low[:1], end[:-1]))
        moved = np.maximum(high, before) - np.minimum(low, before)
        return cls(signal, size, low, high, low_at, high_at, moved)

    @property
    def range_v(self) -> float:
        """Return the difference of the highest and the lowest level, V."""
        return float(np.max(self.high) - np.min(self.low))

    def last_extreme(self, start: int, stop: int, *, upper: bool) -> tuple[int, float]:
        """Return place and level, V, of the last highest or lowest sample of [start, stop), which is not empty."""
        first, last = -(-start // self.size), stop // self.size
        if first >= last:
            return self._read(start, stop, upper)
        found = [self._read(a, b, upper) for a, b in ((start, first * self.size), (last * self.size, stop)) if a < b]
        levels, places = (self.high, self.high_at) if upper else (-self.low, self.low_at)
        cell = last - 1 - int(np.argmax(levels[first:last][::-1]))
        found.append((int(places[cell]), float(levels[cell]) if upper else -float(levels[cell])))
        return max(found, key=lambda one: (one[1] if upper else -one[1], one[0]))

    def _read(self, start: int, stop: int, upper: bool) -> tuple[int, float]:
        """Return the same of a stretch that is no longer than two cells."""
        low, low_at, high, high_at, _ = _row(part(self.signal, start, stop)[:], start)
        return (high_at, high) if upper else (low_at, low)


def _row(values: Array, first: int) -> tuple[float, int, float, int, float]:
    """Return the lowest and the highest of some values with their last places, and the last value."""
    back = values[::-1]
    low, high = int(np.argmin(back)), int(np.argmax(back))
    last = first + values.size - 1
    return float(back[low]), last - low, float(back[high]), last - high, float(values[-1])
