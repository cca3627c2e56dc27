"""Where does y settle while u stands still, dwell by dwell, as the samples come?"""

from collections import deque
from dataclasses import dataclass
from math import nan, sqrt
from typing import final

import numpy as np

from identify.staircase import ENOUGH
from identify.trace import Array, Mask

MOST = 400
"""Dwells that are kept: those before the last so many are forgotten."""


@dataclass(frozen=True)
class Dwell:
    """A stretch in which u stood at ``level_v``: the mean of the ``count`` settled readings, V."""

    level_v: float
    mean_v: float
    count: int


@dataclass
class _Now:
    """The dwell that goes on: where it began, and what its settled readings have added up to."""

    level_v: float
    length: int = 0
    total: float = 0.0
    count: int = 0

    @property
    def dwell(self) -> Dwell | None:
        """Return what is known of it, None where too few readings have settled."""
        return Dwell(self.level_v, self.total / self.count, self.count) if self.count >= ENOUGH else None


@final
class Dwells:
    """The settled means of a run, and the noise of a reading as successive settled readings show it."""

    def __init__(self, settle: int) -> None:
        """Begin; after ``settle`` samples on a level readings count as settled."""
        self._settle, self._now = settle, _Now(nan)
        self._ended: deque[Dwell] = deque(maxlen=MOST)
        self._squares, self._differences = 0.0, 0

    @property
    def found(self) -> tuple[Dwell, ...]:
        """Return the last dwells, the one that goes on included."""
        now = self._now.dwell
        return (*self._ended, now)[-MOST:] if now else tuple(self._ended)

    @property
    def noise_v(self) -> float | None:
        """Return the noise of a reading, V rms; None where too few have settled."""
        return sqrt(0.5 * self._squares / self._differences) if self._differences >= 10 * ENOUGH else None

    def add(self, u: Array, y: Array, came: Mask) -> None:
        """Take further samples; ``came`` says which readings were recorded."""
        edges = np.concatenate(([0], np.flatnonzero(np.diff(u)) + 1, [u.size]))
        lasting = np.diff(edges) > self._settle  # only these, the first and the last can bring a settled reading
        lasting[[0, -1]] = True
        for at in np.flatnonzero(lasting):
            self._go_on(float(u[edges[at]]), y[edges[at] : edges[at + 1]], came[edges[at] : edges[at + 1]])
            if at < lasting.size - 1:
                self._end()

    def _go_on(self, level_v: float, y: Array, came: Mask) -> None:
        """Take samples on one level, the one of before or another."""
        if level_v != self._now.level_v:
            self._end()
            self._now = _Now(level_v)
        now, length = self._now, y.size
        settled = slice(max(self._settle - now.length, 0), None)
        y, came, now.length = y[settled], came[settled], now.length + length
        now.total, now.count = now.total + float(np.sum(y[came])), now.count + int(np.count_nonzero(came))
        moves = np.diff(y)[came[1:] & came[:-1]]
        self._squares, self._differences = self._squares + float(moves @ moves), self._differences + moves.size

    def _end(self) -> None:
        """Keep the dwell that went on, and begin none."""
        if self._now.dwell:
            self._ended.append(self._now.dwell)
        self._now = _Now(nan)
