"""How are the arrays of a file columns of a table: vectors, the columns of matrices, the fields of records?

A vector, also one of one row or one column, is a column of its name. Rows of a matrix run along its longer side, and
its columns are called ``NAME:1``, ``NAME:2``, ...; fields are called ``NAME.FIELD``.
"""

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array, blocks
from rig.errors import FileError
from rig.readers.heading import Heading, read_heading
from rig.readers.table import Table

WIDEST = 256
"""Columns of a matrix; one with more is no table of signals."""
EXACT = 2**53
"""The largest integer up to which every one is a float64."""
MOST_PACKED = 1100
"""How many bytes a byte of a packed file can stand for; 1032 in deflate."""
NUMBERS = "biuf"
Values = NDArray[Any]


@dataclass(frozen=True)
class Stand:
    """Where a column stands in an array: along ``axis``, at ``at`` on the other one, in ``field``; ``rows`` long."""

    array: str
    rows: int
    kind: np.dtype[Any]
    axis: int = 0
    at: int | None = None
    field: str = ""

    def of(self, values: Values, start: int, stop: int) -> Values:
        """Return the rows [start, stop) of the column out of its array, or of what reads like it."""
        at = (slice(start, stop),) if self.at is None else (slice(start, stop), self.at)
        found = values[at[:: -1 if self.axis else 1]]
        return found[self.field] if self.field else found


@dataclass(frozen=True, kw_only=True)
class ArrayTable(Table):
    """A file of arrays; ``stands`` says of every heading where its column is."""

    path: Path
    stands: tuple[Stand, ...]

    @abstractmethod
    def stretch(self, stand: Stand, start: int, stop: int) -> Iterator[Values]:
        """Yield the rows [start, stop) of a column as they stand in the file, in the stretches of ``blocks``."""

    def pieces(self, at: Sequence[int], first: int, stop: int | None) -> Iterator[Array]:
        """Yield the rows [first, stop) of the columns ``at``; raise FileError when their lengths differ."""
        stands = [self.stands[position] for position in at]
        self._check_stands(at, stands, stop)
        end = stands[0].rows if stop is None else min(stands[0].rows, stop)
        if first < end:
            for values in zip(*(self.stretch(stand, first, end) for stand in stands), strict=True):
                yield np.stack([self._numbers(each, position) for each, position in zip(values, at, strict=True)])

    def place(self, row: int) -> str:
        """Return the file and the row, counted from 0 as those of a range of rows are."""
        return f"{self.where}: row {row} (from 0)"

    def cell(self, row: int, at: int) -> str:
        """Return the value as text."""
        return str(next(self.stretch(self.stands[at], row, row + 1))[0])

    def _check_stands(self, at: Sequence[int], stands: Sequence[Stand], stop: int | None) -> None:
        for position, stand in zip(at, stands, strict=True):
            where = f"{self.where}: {self.label(position)}"
            if stand.kind.kind not in NUMBERS or stand.kind.itemsize > 8:
                raise FileError("not a column of numbers", where=where, value=str(stand.kind),
                                allowed="integers, and floats of up to 64 bits")
            if stand.rows != stands[0].rows and (stop is None or stop > min(stand.rows, stands[0].rows)):
                raise FileError("columns of unequal length", where=where, value=f"{stand.rows} rows",
                                allowed=f"{stands[0].rows} as {self.label(at[0])} has")

    def _numbers(self, values: Values, at: int) -> Array:
        """Return values as float64; raise FileError for an integer that is none of them."""
        if values.dtype.kind in "iu" and values.dtype.itemsize == 8 and (np.abs(values.astype(float)) >= EXACT).any():
            raise FileError("integers too large to be kept exactly", where=f"{self.where}: {self.label(at)}",
                            allowed=f"below {EXACT}", do="subtract an offset from them first")
        return values.astype(np.float64)


def columns_of(name: str, lengths: tuple[int, ...], kind: np.dtype[Any], unit: str = "",
               ) -> Iterator[tuple[Heading, Stand]]:
    """Yield the columns that an array makes; none where it is no vector and no matrix, or has less than two rows."""
    for field in kind.names or ("",):
        label = f"{name}.{field}" if field else name
        for suffix, stand in _stands(name, lengths, kind[field] if field else kind):
            heading = read_heading(label + suffix)
            yield replace(heading, unit=unit or heading.unit), replace(stand, field=field)


def _stands(name: str, lengths: tuple[int, ...], kind: np.dtype[Any]) -> Iterator[tuple[str, Stand]]:
    """Yield what is added to the name of an array for each of its columns, and where that stands."""
    if len(lengths) == 1 and lengths[0] > 1:
        yield "", Stand(name, lengths[0], kind)
    if len(lengths) != 2 or not 1 <= min(lengths) <= WIDEST or max(lengths) < 2:
        return
    axis = int(lengths[1] > lengths[0])
    count = lengths[1 - axis]
    for at in range(count):
        yield ("" if count == 1 else f":{at + 1}"), Stand(name, lengths[axis], kind, axis, at)


def check_packing(where: str, lengths: tuple[int, ...], kind: np.dtype[Any], held: int) -> None:
    """Raise FileError when an array claims more values than ``held`` bytes of file can stand for."""
    claimed = float(np.prod([float(n) for n in lengths])) * kind.itemsize
    if claimed > MOST_PACKED * held:
        raise FileError("an array larger than its file can hold", where=where, value=f"{claimed:.3g} bytes",
                        allowed=f"at most {MOST_PACKED} times the {held} bytes it has", do="use a whole copy of it")


def strided(stand: Stand, values: Values, start: int, stop: int) -> Iterator[Values]:
    """Yield the rows [start, stop) of a column out of an array that is read where it is sliced."""
    return (stand.of(values, a, b) for a, b in blocks(start, stop))
