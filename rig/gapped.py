"""What stands where rows of a table are missing: nothing was read, and what was put out is not known either?"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array, Samples, Stored
from rig.timebase import Gaps

Counts = NDArray[np.int64]
Filling = Literal["nothing", "held", "linear"]


@dataclass(frozen=True)
class Gapped(Stored):
    """A signal with the samples it lacks put in: NaN, or the last one held, or a straight line to the next one."""

    signal: Samples
    gaps: Gaps
    filling: Filling

    def read(self, start: int, stop: int) -> Array:
        """Return the samples [start, stop), counted by the clock."""
        at = np.arange(start, stop)
        row, past = self._rows(at)
        first, last = int(row[0]), min(int(row[-1]) + 2, self.signal.size)
        held = self.signal[first:last]
        values: Array = held[row - first]
        if self.filling == "nothing":
            values[past > 0] = np.nan
        elif self.filling == "linear" and (past > 0).any():
            after = held[np.minimum(row + 1, self.signal.size - 1) - first]
            share = past / (1.0 + self._missing_after(row))
            values = np.where(past > 0, values + share * (after - values), values)
        return values

    def _rows(self, at: Counts) -> tuple[Counts, Counts]:
        """Return for samples of the clock the row at or before each, and by how many samples that is earlier."""
        starts = self.gaps.rows + np.cumsum(self.gaps.missing)  # the sample at which each run of rows begins
        run = np.searchsorted(starts, at, side="right")
        before = np.concatenate([[0], np.cumsum(self.gaps.missing)])[run]
        last = np.concatenate([self.gaps.rows, [self.signal.size]])[run] - 1
        row = np.minimum(at - before, last)
        return row, at - before - row

    def _missing_after(self, row: Counts) -> Counts:
        """Return how many samples are missing after each of these rows."""
        gap = np.searchsorted(self.gaps.rows, row, side="right")
        found: Counts = np.concatenate([self.gaps.missing, [0]])[gap]
        return found


def filled(signal: Samples, gaps: Gaps, filling: Filling) -> Samples:
    """Return the signal with the samples it lacks; itself when it lacks none, in memory when it was there."""
    if not gaps.rows.size:
        return signal
    put_in = Gapped(signal.size + int(gaps.missing.sum()), signal, gaps, filling)
    return put_in if isinstance(signal, Stored) else put_in[:]
