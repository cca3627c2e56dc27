"""What has every table of another program in common: named columns of numbers, read a stretch of rows at a time?

A reader of one more kind of file is a class with the members of ``Table`` left open here, and its line in
``rig.readers``. It hands out what stands in the file; units are converted here, and what is no number is refused here,
so that all kinds of files do it alike.
"""

import csv
import zlib
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from struct import error as StructError  # noqa: N812
from tokenize import TokenError
from typing import Literal
from zipfile import BadZipFile

import numpy as np

from identify.trace import Array
from rig.errors import FileError, MisfitError, unknown
from rig.readers.heading import Heading
from rig.timebase import TimeBase
from rig.units import factor, scaled

DAMAGE = (OSError, EOFError, RuntimeError, ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError,
          AssertionError, MemoryError, SyntaxError, TokenError, zlib.error, csv.Error, BadZipFile, StructError)
"""What the libraries that parse files of others raise when these are damaged."""
MOST_NAMES = 40
NOTE = "recording"
"""The array in which our own exports describe their recording."""


@dataclass(frozen=True)
class Wanted:
    """A column asked for, by name or by number from 1 on, and the unit its numbers are to have.

    ``missing`` says whether cells that are empty or NaN are refused, or let through as NaN; ``anything`` goes for an
    infinite number, too.
    """

    column: str
    unit: str
    missing: Literal["refused", "let through", "anything"] = "refused"


@dataclass(frozen=True, kw_only=True)
class Table(ABC):
    """Columns of numbers, each found by its name or by its number from 1 on.

    ``clock`` is what the file itself says of its time base, ``note`` what one of our own exports says of its recording,
    and ``remarks`` what was understood of the file that is not plain to see.
    """

    where: str
    headings: tuple[Heading, ...]
    clock: TimeBase | None = None
    note: str = ""
    remarks: tuple[str, ...] = ()

    @abstractmethod
    def place(self, row: int) -> str:
        """Return where row ``row``, counted from 0, stands, for a message."""

    @abstractmethod
    def cell(self, row: int, at: int) -> str:
        """Return what stands in the file at a row and a column, for a message; empty where nothing does."""

    @abstractmethod
    def pieces(self, at: Sequence[int], first: int, stop: int | None) -> Iterator[Array]:
        """Yield the rows [first, stop) of the columns ``at``, (columns, rows) at a time; NaN where a cell is empty."""

    def stretches(self, wanted: Sequence[Wanted], first: int = 0, stop: int | None = None) -> Iterator[Array]:
        """Yield the rows [first, stop) of the columns wanted, (columns, rows) at a time, in the units wanted.

        Raises FileError for a column that is not there, for what is no finite number and for a damaged file.
        """
        at = [self.index(one.column) for one in wanted]
        by = [self._factor(where, one.unit) for where, one in zip(at, wanted, strict=True)]
        row = first
        with readable(self.where):
            for piece in self.pieces(at, first, stop):
                for one, position, values in zip(wanted, at, piece, strict=True):
                    self._check(one, position, values, row)
                yield np.stack([values if k == 1.0 else scaled(values, k) for values, k in zip(piece, by, strict=True)])
                row += piece.shape[1]

    def column(self, which: str, unit: str, first: int = 0, stop: int | None = None) -> Array:
        """Return the rows [first, stop) of one column in ``unit``, all of them finite; raise FileError."""
        found = [piece[0] for piece in self.stretches([Wanted(which, unit)], first, stop)]
        return np.concatenate(found) if found else np.empty(0)

    def index(self, which: str) -> int:
        """Return the position of the column called ``which``, or numbered so from 1 on; raise FileError."""
        for key in ("text", "name"):
            found = [at for at, heading in enumerate(self.headings) if which and getattr(heading, key) == which]
            if len(found) > 1:
                raise FileError("two columns of one name", where=self.where, value=repr(which),
                                do=f"give its number: {' or '.join(str(at + 1) for at in found)}")
            if found:
                return found[0]
        if which.isascii() and which.isdecimal():
            return self._numbered(which)
        names = [heading.text for heading in self.headings if heading.text]
        raise FileError(where=self.where, **unknown("column", which, names[:MOST_NAMES]))

    def _numbered(self, which: str) -> int:
        if not 1 <= int(which[:9]) <= len(self.headings):
            raise FileError("no such column", where=self.where, value=which, allowed=f"1 to {len(self.headings)}")
        return int(which) - 1

    def label(self, at: int) -> str:
        """Return how a message calls a column: its number, and its heading where it has one."""
        text = self.headings[at].text
        return f"column {at + 1} ({text})" if text else f"column {at + 1}"

    def conversion(self, which: str, unit: str) -> str:
        """Return in words how the numbers of a column became ``unit``; empty when they were taken as they stand."""
        heading = self.headings[self.index(which)]
        by = self._factor(self.index(which), unit)
        return "" if by == 1.0 else f"{heading.name or which} in {heading.unit}, of which one is {by:g} {unit}"

    def _factor(self, at: int, unit: str) -> float:
        """Return how many ``unit`` one unit of the heading is, 1 where it names none; raise FileError."""
        told = self.headings[at].unit
        if not told or not unit:
            return 1.0
        try:
            return factor(told, unit)
        except MisfitError as error:
            raise FileError(error.what, where=f"{self.where}: {self.label(at)}", allowed=error.allowed or f"{unit}",
                            do=f"correct the unit, or leave it out and the numbers are taken as {unit}") from error

    def _check(self, wanted: Wanted, at: int, values: Array, row: int) -> None:
        """Raise FileError for the first of ``values``, from row ``row`` on, that is not what was wanted."""
        if wanted.missing == "anything":
            return
        wrong = np.isinf(values) if wanted.missing == "let through" else ~np.isfinite(values)
        if wrong.any():
            here = row + int(np.argmax(wrong))
            raise self.not_a_number(here, at, self.cell(here, at))

    def not_a_number(self, row: int, at: int, cell: str) -> FileError:
        """Return the refusal of a cell."""
        return FileError("not a number" if cell else "an empty cell", where=f"{self.place(row)}: {self.label(at)}",
                         value=repr(cell) if cell else None, allowed="finite numbers in every row",
                         do="correct the cell, leave the row out, or have what is missing in y as lost: --gaps lost")


@contextmanager
def readable(where: str | Path) -> Iterator[None]:
    """Turn whatever a library raises over a damaged file into a FileError."""
    try:
        yield
    except DAMAGE as error:
        text = str(error.args[0] if error.args else "") or type(error).__name__
        told = error.strerror if isinstance(error, OSError) and error.strerror else text.splitlines()[0]
        raise FileError("cannot be read, or damaged", where=str(where), value=told[:200]) from error
