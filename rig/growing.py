"""How do samples get into a recording's file while the run goes on, at little cost, and safe from a killed process?

The structure of the file was finished before and its space reserved; so a sample has its place, and is written there
past the HDF5 library, in one call to the system. What a killed process has written is in the file.
"""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import final

import h5py
import numpy as np
from numpy.typing import NDArray

from identify.trace import Array
from rig.recorded import Entry


@final
class Growing:
    """The inputs and the ledger of the recording at ``path``, open for one writer; HDF5 readers are locked out."""

    def __init__(self, path: Path, places: Mapping[str, str]) -> None:
        """Open the file; ``places`` are the datasets of the inputs by name. Raises OSError, ValueError."""
        self._file = h5py.File(path, "r+")
        self._offsets = {name: _offset(self._file[place]) for name, place in places.items()}
        self._ledger_at = _offset(self._file["ledger"])
        self.size = int(self._file["ledger"].shape[0])
        self._descriptor = os.open(path, os.O_RDWR)

    def write(self, name: str, start: int, values: Array) -> None:
        """Put ``values``, V, to the samples of an input from ``start`` on; raise OSError."""
        self._put(np.ascontiguousarray(values, dtype=np.float64), self._offsets[name] + 8 * start)

    def enter(self, start: int, stop: int, entry: Entry) -> None:
        """Enter the samples [start, stop) in the ledger; raise OSError."""
        self._put(np.full(stop - start, entry, dtype=np.uint8), self._ledger_at + start)

    def close(self) -> None:
        """Let go of the file; harmless when that was done."""
        if self._file:
            os.close(self._descriptor)
            self._file.close()

    def _put(self, values: NDArray[np.generic], at: int) -> None:
        """Write all of ``values`` at byte ``at``."""
        data = values.data.cast("B")
        while data:
            count = os.pwrite(self._descriptor, data, at)
            data, at = data[count:], at + count


def _offset(dataset: h5py.Dataset) -> int:
    """Return where a dataset begins in its file; raise ValueError when it is not in one piece."""
    offset = dataset.id.get_offset()
    if offset is None:
        raise ValueError(f"{dataset.name} is not in one piece")
    return int(offset)
