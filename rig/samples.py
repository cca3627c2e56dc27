"""How is a signal read that stays in its recording's file, and what stands where samples were lost?"""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import h5py
import numpy as np
from numpy.typing import NDArray

from identify.trace import Array, Mask, Samples, Stored, blocks
from rig.errors import FileError

Stamp = tuple[int, ...]


@dataclass(frozen=True)
class InFile(Stored):
    """A signal of float64, in one piece from byte ``offset`` on in the file at ``path``.

    The file is opened for every read, so nothing is to be closed, and a copy of this in another process reads as well.
    """

    path: Path
    offset: int
    stamp: Stamp

    @classmethod
    def of(cls, dataset: h5py.Dataset, *, grows: bool = False) -> Self | None:
        """Return the signal in a dataset; None when it is not one row of float64 in one piece.

        ``grows``: the file may be written to while the signal is used, but not be replaced.
        """
        offset, path = dataset.id.get_offset(), Path(dataset.file.filename).absolute()
        if dataset.ndim != 1 or dataset.dtype != np.float64 or offset is None:
            return None
        stamp = _stamp(path.stat())
        return cls(dataset.size, path, offset, stamp[:1] if grows else stamp)

    def read(self, start: int, stop: int) -> Array:
        """Return the samples [start, stop), V; raise FileError when the file is no longer the one it was."""
        try:
            with self.path.open("rb", buffering=0) as file:
                if _stamp(os.fstat(file.fileno()))[: len(self.stamp)] == self.stamp:
                    return np.fromfile(file, np.float64, stop - start, offset=self.offset + start * 8)
        except OSError as error:
            raise FileError("cannot be read any more", where=str(self.path), value=error.strerror) from error
        raise FileError("the recording changed while it was in use", where=str(self.path), do="start again")


def _stamp(status: os.stat_result) -> Stamp:
    """Return what changes when a file is replaced or written to."""
    return status.st_ino, status.st_size, status.st_mtime_ns


@dataclass(frozen=True)
class NotRead(Stored):
    """A signal of which nothing was received."""

    def read(self, start: int, stop: int) -> Array:
        """Return that the samples are not known."""
        return np.full(stop - start, np.nan)


@dataclass(frozen=True)
class Received(Stored):
    """A signal of which nothing was received from the sample ``stop`` on, whatever stands there."""

    signal: Stored
    stop: int

    def read(self, start: int, stop: int) -> Array:
        """Return the samples [start, stop), V."""
        values = self.signal.read(start, stop)
        values[max(self.stop - start, 0):] = np.nan
        return values


@dataclass(frozen=True)
class Bridged(Stored):
    """The readings of a signal, a straight line where ``valid`` (N,) says that they were lost.

    ``beside`` are the samples received next to a lost one, in ascending order, and ``levels`` their readings in V.
    """

    signal: Samples
    valid: Mask
    beside: NDArray[np.int64]
    levels: Array

    @classmethod
    def over(cls, signal: Samples, valid: Mask) -> Self:
        """Return the readings up to the last of ``valid``, which is True."""
        edges = np.flatnonzero(valid[1:] != valid[:-1])
        beside = np.unique(np.where(valid[edges], edges, edges + 1))
        levels = [signal[a:b][beside[(beside >= a) & (beside < b)] - a] for a, b in blocks(0, valid.size)]
        return cls(valid.size, signal, valid, beside, np.concatenate(levels))

    def read(self, start: int, stop: int) -> Array:
        """Return the samples [start, stop), V; the first reading also stands where those before it were lost."""
        y = self.signal[start:stop].copy()
        lost = np.flatnonzero(~self.valid[start:stop])
        if lost.size:
            y[lost] = np.interp(start + lost, self.beside, self.levels)
        return y
