"""How do samples get into a recording's file while the run goes on, at little cost, and safe from a killed process?

The structure of the file was finished before and its space reserved; so a sample has its place, and is written there
past the HDF5 library, in one call to the system. The journal's row follows it (``rig/journal.py``): what it accounts
for is acknowledged, and survives the process.
"""

import os
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import final

import numpy as np
import xxhash
from numpy.typing import NDArray

from identify.trace import Array
from rig.journal import JOURNAL, STRETCH, shape_of
from rig.recorded import Entry
from rig.unfinished import LastWords, inspect, speak
from rig.writing import hold, put

LEDGER = "ledger"


@final
class Growing:
    """The inputs and the ledger of the recording at ``path``, open for one writer; readers are let in."""

    def __init__(self, path: Path, inputs: Sequence[str]) -> None:
        """Open the file; ``inputs`` are the datasets of the inputs. Raises OSError, ValueError."""
        extents = inspect(path).extents
        if list(extents) != [*inputs, LEDGER, JOURNAL]:
            raise ValueError(f"{path} grows in {', '.join(extents)}, not in {', '.join(inputs)}")
        *self._inputs, (self._ledger, self.size), (self._journal, _) = extents.values()
        self._row = 8 * shape_of(self.size, [*inputs, LEDGER])[1]
        self._sums = [xxhash.xxh3_64() for _ in (*inputs, LEDGER)]
        self.position = 0
        self._descriptor: int | None = os.open(path, os.O_RDWR)
        hold(self._descriptor)

    def append(self, start: int, signals: Sequence[Array]) -> None:
        """Put a stretch of every input, V, at the samples from ``start`` on; those before, from the last on, are lost.

        Raises OSError; nothing is acknowledged then.
        """
        stop, lost = start + len(signals[0]), start - self.position
        entries = np.full(stop - self.position, Entry.RECORDED, dtype=np.uint8)
        entries[:lost] = Entry.LOST
        columns = [np.ascontiguousarray(values, dtype=np.float64) for values in signals]
        for (at, _), values in zip(self._inputs, columns, strict=True):
            self._put(values, at + 8 * start)
        self._put(entries, self._ledger + self.position)
        if lost:
            columns = [np.concatenate([np.full(lost, np.nan), values]) for values in columns]
        self._account(self.position, stop, [*columns, entries])

    def speak(self, words: LastWords) -> None:
        """Put down how the run ended; raise OSError."""
        assert self._descriptor is not None
        speak(self._descriptor, words)
        os.fdatasync(self._descriptor)

    def close(self) -> None:
        """Let go of the file; harmless when that was done."""
        if self._descriptor is not None:
            os.close(self._descriptor)
            self._descriptor = None

    def _account(self, first: int, stop: int, columns: Sequence[NDArray[np.generic]]) -> None:
        """Acknowledge the samples [first, stop), row by row, each when its checksums are known."""
        edges = [first, *range((first // STRETCH + 1) * STRETCH, stop, STRETCH), stop]
        for a, b in pairwise(edges):
            fresh = a % STRETCH == 0
            sums = [xxhash.xxh3_64() if fresh else known.copy() for known in self._sums]
            for known, values in zip(sums, columns, strict=True):
                known.update(_bytes(values[a - first : b - first]))
            row = np.array([b - a // STRETCH * STRETCH, *(known.intdigest() for known in sums)], dtype=np.uint64)
            self._put(row, self._journal + a // STRETCH * self._row)
            self._sums, self.position = sums, b

    def _put(self, values: NDArray[np.generic], at: int) -> None:
        """Write all of ``values`` at byte ``at``."""
        assert self._descriptor is not None
        put(self._descriptor, _bytes(values), at)


def _bytes(values: NDArray[np.generic]) -> memoryview:
    return values.data.cast("B") if values.size else memoryview(b"")
