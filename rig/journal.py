"""Which samples of a run that was never finished were acknowledged, and are they unharmed?

The dataset ``journal`` has a row for every ``STRETCH`` samples: how many of them were acknowledged, and the checksum of
each signal and of the ledger over these (XXH3, 64 bits). A row lies within one page, so that no killed process leaves
half of one; it is written after the samples it speaks of, and is the acknowledgement. Whenever the program dies, rows
and samples agree, and what stands behind the last row was promised to nobody.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import h5py
import numpy as np
import xxhash
from numpy.typing import NDArray

from identify.trace import blocks

JOURNAL = "journal"
STRETCH = 1 << 16  # samples a row speaks of
PAGE = 4096
COLUMNS = "columns"
DESCRIPTION = f"samples acknowledged of every {STRETCH}, then the XXH3 of these in each of the columns named"


class HarmedError(ValueError):
    """What was acknowledged is not there any more; the message says what, and where."""


@dataclass(frozen=True)
class Journal:
    """What was acknowledged of ``names``, the datasets that grow, each of ``size`` samples."""

    names: tuple[str, ...]
    rows: NDArray[np.uint64]
    size: int

    @classmethod
    def of(cls, file: h5py.File) -> Self:
        """Return the journal in a file; raise KeyError, ValueError, TypeError and the like for one that cannot be."""
        dataset = file[JOURNAL]
        names = tuple(map(str, dataset.attrs[COLUMNS]))
        return cls(names, np.asarray(dataset[:], dtype=np.uint64), min(int(file[name].shape[0]) for name in names))

    @property
    def acknowledged(self) -> int:
        """Return how many samples are accounted for; raise HarmedError when the rows do not fit together."""
        counts = self.rows[:, 0].astype(np.int64)
        position = int(counts.sum())
        expected = np.clip(position - STRETCH * np.arange(len(counts)), 0, STRETCH)
        if position > self.size or not np.array_equal(counts, expected) or self.rows[counts == 0].any():
            raise HarmedError("the journal of what was written does not fit together")
        return position

    def harmed(self, file: h5py.File) -> list[str]:
        """Return what was acknowledged and is another now, a sentence for each dataset and stretch."""
        found = []
        for at, row in enumerate(self.rows):
            start, stop = at * STRETCH, at * STRETCH + int(row[0])
            for name, told in zip(self.names, row[1:], strict=False):
                if row[0] and xxhash.xxh3_64_intdigest(file[name][start:stop].tobytes()) != int(told):
                    found.append(f"the dataset {name!r} does not match its checksum in samples {start} to {stop}")
        return found

    def beyond(self, file: h5py.File) -> int:
        """Return how many samples behind the last acknowledged one were written to: a program died in it."""
        first = stop = self.acknowledged
        for name in self.names:
            blank = blank_of(file[name].dtype)
            for a, b in blocks(first, self.size):
                written = np.flatnonzero(file[name][a:b].view(np.uint8).reshape(b - a, -1) != blank)
                stop = max(stop, a + int(written[-1]) // blank.size + 1) if written.size else stop
        return stop - first


def blank_of(kind: np.dtype[np.generic]) -> NDArray[np.uint8]:
    """Return the bytes of a sample of which nothing was received: NaN, or the entry 0 of the ledger."""
    return np.full(1, np.nan if kind.kind == "f" else 0, dtype=kind).view(np.uint8)


def shape_of(size: int, names: Sequence[str]) -> tuple[int, int]:
    """Return the rows and columns of the journal of ``size`` samples: no row crosses a page."""
    columns = 1 << len(names).bit_length()
    return max(-(-size // STRETCH), PAGE // (8 * columns)), columns


def add_journal(file: h5py.File, size: int, names: Sequence[str]) -> None:
    """Put an empty journal of the datasets ``names`` into a file."""
    journal = file.create_dataset(JOURNAL, data=np.zeros(shape_of(size, names), np.uint64))
    journal.attrs[COLUMNS] = list(names)
    journal.attrs["description"] = DESCRIPTION
