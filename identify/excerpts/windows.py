"""Which stretches of a long recording stand for it: spread over its time, and over the levels and steps it visits?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.excerpts.cells import Cells
from identify.trace import Step

CELLS = 4  # of a window
BINS = 32  # levels of u that are told apart
LABELS = 50  # steps that are told apart, at most: more are taken as one

Stretch = tuple[int, int]
Mask = NDArray[np.bool_]
Places = NDArray[np.int64]
Worth = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Choice:
    """The cells of a recording and its steps, from which windows of ``CELLS`` cells are chosen."""

    cells: Cells
    steps: tuple[Step, ...]

    def windows(self, regions: Sequence[Stretch], count: int) -> list[Stretch]:
        """Return ``count`` windows [start, stop) within ``regions``, or as many as there is room for, in order.

        Half are spread evenly over the time, each where u moves most; half add levels of u within a step that no other
        has, and where all are there they are spread, too.
        """
        free = self._free(regions)
        chosen: list[int] = []
        for some in np.array_split(np.flatnonzero(free), max(count // 2, 1)):
            self._take(chosen, free, some, self._movement)
        seen = np.any([self._visits[at] for at in chosen], axis=0) if chosen else np.zeros(self._visits.shape[1], bool)
        while len(chosen) < count and free.any():
            every = np.flatnonzero(free)
            adds = np.count_nonzero(self._visits[every] & ~seen, axis=1).astype(np.float64)
            if not adds.any():  # all is there: as far from the others as can be
                adds = np.min(np.abs(every[:, None] - np.array(chosen)), axis=1).astype(np.float64)
            at = int(every[int(np.argmax(adds))])
            seen = seen | self._visits[at]
            self._claim(chosen, free, at)
        size = self.cells.size
        return [(at * size, (at + CELLS) * size) for at in sorted(chosen)]

    def _take(self, chosen: list[int], free: Mask, some: Places, worth: Worth) -> None:
        """Choose the most worthy of some places that are still free."""
        left = some[free[some]]
        if left.size:
            self._claim(chosen, free, int(left[int(np.argmax(worth[left]))]))

    @staticmethod
    def _claim(chosen: list[int], free: Mask, at: int) -> None:
        """Choose a place; windows do not overlap."""
        chosen.append(at)
        free[max(at - CELLS + 1, 0) : at + CELLS] = False

    def _free(self, regions: Sequence[Stretch]) -> Mask:
        """Return at which cells a window may begin."""
        free, size = np.zeros(self.cells.low.size, dtype=np.bool_), self.cells.size
        for start, stop in regions:
            free[-(-start // size) : max(stop // size - CELLS + 1, 0)] = True
        return free

    @property
    def _movement(self) -> Worth:
        """Return how far u moves in a window from each cell on; its second cell, whose end is seen, counts double."""
        moved = np.concatenate((self.cells.moved, np.zeros(CELLS)))
        each = [moved[i : i + self.cells.low.size] for i in range(CELLS)]
        return np.asarray(sum(each) + each[1])

    @cached_property
    def _visits(self) -> Mask:
        """Return which levels within which steps a window from each cell on visits, shape (cells, steps * levels)."""
        cells = self.cells
        bottom, width = float(np.min(cells.low)), max(cells.range_v, 1e-300) / BINS
        low, high = (np.clip((v - bottom) / width, 0, BINS - 1).astype(np.int64) for v in (cells.low, cells.high))
        levels = np.arange(BINS)
        inside = (levels >= low[:, None]) & (levels <= high[:, None])
        labels = list(dict.fromkeys(step.label for step in self.steps))
        if not 0 < len(labels) <= LABELS:
            labels = [""]
        steps = self.steps if labels[0] else (Step("", "", 0, cells.signal.size),)
        visits = np.zeros((low.size, len(labels), BINS), dtype=np.bool_)
        for step in steps:
            first, last = -(-step.start // cells.size), step.stop // cells.size
            visits[first:last, labels.index(step.label)] |= inside[first:last]
        flat = np.concatenate((visits.reshape(low.size, -1), np.zeros((CELLS, len(labels) * BINS), dtype=np.bool_)))
        return np.asarray(np.any([flat[i : i + low.size] for i in range(CELLS)], axis=0))
