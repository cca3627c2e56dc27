"""Which columns of numbers are in a file that another program wrote, and at which line is it wrong?

Text tables: CSV, TSV, semicolons with decimal commas, columns aligned by spaces, each also gzipped; one header line or
none; lines that start with # or % are comments. Every message names the line as an editor counts it, and the column.
A new kind of file is one more class with the three methods of ``Table`` and its entry in ``READERS``.
"""

import gzip
import math
import re
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Never

import numpy as np

from identify.trace import Array
from rig.errors import FileError, unknown

GZIP = b"\x1f\x8b"
COMMENTS = ("#", "%")
NOT_TEXT = re.compile(r"[\x00-\x08\x0e-\x1f]")
PLAIN_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*(?:e[+-]?\d+)?|\.\d+(?:e[+-]?\d+)?|nan|inf|infinity)", re.ASCII | re.I)
DELIMITERS = ("\t", ";", ",")


class Table(ABC):
    """Columns of numbers, each found by its name or by its number from 1 on."""

    where: str
    names: tuple[str, ...]

    @abstractmethod
    def column(self, which: str, first: int = 0, stop: int | None = None) -> Array:
        """Return the rows [first, stop) of a column, all of them finite; raise FileError."""

    @abstractmethod
    def place(self, row: int) -> str:
        """Return where row ``row``, counted from 0, stands, for a message."""

    def index(self, which: str) -> int:
        """Return the position of the column called ``which``, or numbered so from 1 on; raise FileError."""
        found = [at for at, name in enumerate(self.names) if name == which]
        if len(found) > 1:
            raise FileError("two columns of one name", where=self.where, value=repr(which),
                            do=f"give its number: {' or '.join(str(at + 1) for at in found)}")
        if found:
            return found[0]
        if which.isdecimal() and 1 <= int(which) <= len(self.names):
            return int(which) - 1
        if which.isdecimal():
            raise FileError("no such column", where=self.where, value=which, allowed=f"1 to {len(self.names)}")
        raise FileError(where=self.where, **unknown("column", which, [name for name in self.names if name]))


@dataclass(frozen=True)
class TextTable(Table):
    """A text file split into lines; ``numbers`` are their line numbers in the file."""

    where: str
    names: tuple[str, ...]
    lines: Sequence[str]
    numbers: Sequence[int]
    delimiter: str | None

    def column(self, which: str, first: int = 0, stop: int | None = None) -> Array:
        """Return the rows [first, stop) of a column; raise FileError naming line and column of a cell that is amiss."""
        at, lines = self.index(which), self.lines[first:stop]
        if not lines:
            return np.empty(0)
        try:
            values = np.loadtxt(lines, delimiter=self.delimiter, usecols=at, comments=None, quotechar='"', ndmin=1)
        except ValueError:
            self._blame(at, first, lines)
        if not np.isfinite(values).all():
            self._blame(at, first, lines)
        return np.asarray(values, dtype=np.float64)

    def place(self, row: int) -> str:
        """Return file and line."""
        return f"{self.where}:{self.numbers[row]}"

    def _blame(self, at: int, first: int, lines: Sequence[str]) -> Never:
        """Raise FileError for the first cell of the column that is not a finite number."""
        for row, line in enumerate(lines):
            cell = cells(line, self.delimiter)[at]
            if not _is_finite(cell):
                where = f"{self.place(first + row)}: column {self._label(at)}"
                raise FileError("not a number" if cell else "an empty cell", where=where,
                                value=repr(cell) if cell else None, allowed="finite numbers in every row",
                                do="correct the cell, or leave the row out")
        raise FileError("cannot be read as numbers", where=f"{self.where}: column {self._label(at)}")

    def _label(self, at: int) -> str:
        return f"{at + 1} ({self.names[at]})" if self.names[at] else f"{at + 1}"


def open_table(path: str | Path) -> Table:
    """Return the table in the file at ``path``, by its suffix, text where that says nothing; raise FileError."""
    path = Path(path)
    if not path.is_file():
        raise FileError("no such file" if not path.exists() else "not a file", where=str(path))
    return READERS.get(path.suffix.lower(), read_text_table)(path)


def read_text_table(path: Path) -> Table:
    """Return the text table at ``path``; raise FileError when it is empty, no text, or its rows differ in length."""
    where = str(path)
    found = [(number, line) for number, line in enumerate(_text(path).splitlines(), 1)
             if line.strip() and not line.startswith(COMMENTS)]
    if not found:
        raise FileError("the file is empty" if path.stat().st_size == 0 else "no rows", where=where)
    delimiter = _delimiter(found[0][1])
    head = cells(found[0][1], delimiter)
    named = _is_header(head, f"{where}:{found[0][0]}")
    body = found[1:] if named else found
    if not body:
        raise FileError("a header and no rows", where=where)
    table = TextTable(where, tuple(head) if named else ("",) * len(head), [line for _, line in body],
                      [number for number, _ in body], delimiter)
    _check_widths(table)
    return _with_decimal_points(table)


READERS: dict[str, Callable[[Path], Table]] = {}
"""Readers of files that are not text, by suffix."""


def cells(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of one line without quotes and surrounding space."""
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def _is_header(head: Sequence[str], where: str) -> bool:
    """Return whether the first line holds names; raise FileError when it is neither names nor numbers."""
    words = [cell for cell in head if cell and not _is_number(_decimal_point(cell))]
    if words and len(words) < len([cell for cell in head if cell]):
        raise FileError("neither a header nor a row of numbers", where=where, value=repr(words[0]),
                        allowed="names in every column, or numbers", do="correct the cell, or add a header line")
    return bool(words)


def _text(path: Path) -> str:
    """Return the text of a plain or gzipped file, UTF-8 or else Latin-1; raise FileError."""
    try:
        held = path.read_bytes()
        held = gzip.decompress(held) if held.startswith(GZIP) else held
    except (OSError, EOFError, zlib.error) as error:
        raise FileError("cannot be read, or damaged", where=str(path), value=str(error)) from error
    try:
        text = held.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = held.decode("latin-1")
    if NOT_TEXT.search(text[:4096]):
        raise FileError("not a text table", where=str(path), allowed="CSV, TSV, or these gzipped")
    return text


def _delimiter(line: str) -> str | None:
    """Return what separates the cells of ``line``; None stands for any run of spaces."""
    return next((delimiter for delimiter in DELIMITERS if delimiter in line), None)


def _check_widths(table: TextTable) -> None:
    """Raise FileError at the first row with another number of cells than the header, or than the first row."""
    if table.delimiter is None:
        widths = np.array([len(line.split()) for line in table.lines])
    else:
        widths = np.array([line.count(table.delimiter) + 1 for line in table.lines])
    wrong = np.flatnonzero(widths != len(table.names))
    if wrong.size:
        row = int(wrong[0])
        raise FileError("unequal columns", where=table.place(row), value=f"{widths[row]} cells",
                        allowed=f"{len(table.names)} as in the lines before", do="complete the row or remove it")


def _with_decimal_points(table: TextTable) -> TextTable:
    """Return the table with decimal commas turned into points, where commas cannot be delimiters."""
    if table.delimiter == "," or not any("," in line for line in table.lines[:100]):
        return table
    lines = [_decimal_point(line) for line in table.lines]
    return TextTable(table.where, table.names, lines, table.numbers, table.delimiter)


def _decimal_point(text: str) -> str:
    return text.replace(",", ".")


def _is_finite(cell: str) -> bool:
    return _is_number(cell) and math.isfinite(float(cell))


def _is_number(cell: str) -> bool:
    """Return whether numpy's reader takes the cell; Python's float takes more."""
    return PLAIN_NUMBER.fullmatch(cell) is not None
