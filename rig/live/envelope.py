"""How does a signal of any length stay a picture of a few hundred points, in memory that does not grow?

A picture has columns; each keeps the least and the largest sample that fell into it, so that no spike is lost however
many samples a column stands for.
"""

from typing import final

import numpy as np

from identify.trace import Array

COLUMNS = 600
LEVELS = 256
LATEST = 1 << 15  # samples at most that are looked at closely


@final
class Envelope:
    """The least and the largest sample of each column of a run of ``size`` samples."""

    def __init__(self, size: int, columns: int = COLUMNS) -> None:
        """Begin with no samples."""
        self.width = max(-(-size // columns), 1)
        self.low = np.full(-(-size // self.width), np.nan)
        self.high = self.low.copy()

    def add(self, first: int, values: Array) -> None:
        """Take the samples from index ``first`` on; those that are no numbers leave no trace."""
        head = -first % self.width
        column = first // self.width
        if head:
            self._put(column, values[:head].reshape(1, -1))
            column += 1
        body = values[head:]
        whole = body.size // self.width
        self._put(column, body[: whole * self.width].reshape(whole, self.width))
        self._put(column + whole, body[whole * self.width :].reshape(1, -1))

    def _put(self, column: int, rows: Array) -> None:
        """Widen the columns from ``column`` on, one for each row."""
        if rows.size:
            at = slice(column, column + len(rows))
            self.low[at] = np.fmin(self.low[at], np.fmin.reduce(rows, axis=1))
            self.high[at] = np.fmax(self.high[at], np.fmax.reduce(rows, axis=1))


@final
class Means:
    """The mean of the samples of each column of a run of ``size`` samples."""

    def __init__(self, size: int, columns: int = COLUMNS) -> None:
        """Begin with no samples."""
        self.width = max(-(-size // columns), 1)
        self._sum, self._count = np.zeros((2, -(-size // self.width)))

    def add(self, first: int, values: Array) -> None:
        """Take the samples from index ``first`` on; those that are no numbers leave no trace."""
        known = np.flatnonzero(np.isfinite(values))
        at, begin = (first + known) // self.width, first // self.width
        told = np.bincount(at - begin, values[known]), np.bincount(at - begin)
        for kept, fresh in zip((self._sum, self._count), told, strict=True):
            kept[begin : begin + fresh.size] += fresh

    def means(self) -> Array:
        """Return that of every column, not a number where nothing came."""
        return np.where(self._count > 0, self._sum / np.maximum(self._count, 1), np.nan)


def outline(low: Array, high: Array) -> Array:
    """Return a line that runs through the least and the largest of every column, shape (2 columns,)."""
    return np.column_stack((low, high)).ravel()


def drawn(values: Array, first: int, columns: int) -> tuple[Array, Array]:
    """Return index and value of the points of a line through the samples from index ``first`` on, few enough to draw.

    Columns are counted from sample 0, so that they stand still while the samples move on.
    """
    width = max(-(-values.size // columns), 1)
    if width == 1:
        return np.arange(first, first + values.size, dtype=np.float64), values
    skip = -first % width
    rows = values[skip : skip + (values.size - skip) // width * width].reshape(-1, width)
    index = first + skip + width * np.arange(len(rows))
    return (np.column_stack((index + 0.25 * width, index + 0.75 * width)).ravel(),
            outline(np.fmin.reduce(rows, axis=1), np.fmax.reduce(rows, axis=1)))


@final
class Latest:
    """The last samples of several signals, ``most`` at most: those from index ``first`` on."""

    def __init__(self, names: tuple[str, ...], most: int = LATEST) -> None:
        """Begin with no samples."""
        self._most, self.first = most, 0
        self.signals = {name: np.empty(0) for name in names}

    def add(self, first: int, stretch: dict[str, Array]) -> None:
        """Take further samples of every signal, from index ``first`` on."""
        stop = first + len(next(iter(stretch.values())))
        for name, before in self.signals.items():
            self.signals[name] = np.concatenate((before, stretch[name]))[-self._most :]
        self.first = stop - next(iter(self.signals.values())).size


@final
class Hull:
    """The least and the largest y that was read at each level of v: the outline of all loops so far.

    Levels lie in ``2 levels`` columns around 0 that become twice as wide when v leaves them.
    """

    def __init__(self, levels: int = LEVELS // 2) -> None:
        """Begin with columns far too narrow."""
        self._half, self.width_v = levels, 1e-6
        self.low, self.high = np.full(2 * levels, np.nan), np.full(2 * levels, np.nan)

    def add(self, v: Array, y: Array) -> None:
        """Take readings y, V, at the levels v, V; those that are no numbers leave no trace."""
        known = np.isfinite(v) & np.isfinite(y)
        v, y = v[known], y[known]
        if not v.size:
            return
        while np.max(np.abs(v)) >= self._half * self.width_v:
            self._widen()
        at = np.floor(v / self.width_v).astype(np.int64) + self._half
        np.fmin.at(self.low, at, y)
        np.fmax.at(self.high, at, y)

    def levels_v(self) -> Array:
        """Return the middle of every column, V."""
        return (np.arange(-self._half, self._half, dtype=np.float64) + 0.5) * self.width_v

    def _widen(self) -> None:
        """Make the columns twice as wide, two of them becoming one."""
        self.width_v *= 2.0
        quarter = self._half // 2
        blank = np.full(quarter, np.nan)
        for name, best in (("low", np.fmin), ("high", np.fmax)):
            pairs = best.reduce(getattr(self, name).reshape(-1, 2), axis=1)
            setattr(self, name, np.concatenate((blank, pairs, blank)))
