"""Which columns of numbers are in a text file, and at which line is it wrong?

CSV, TSV, semicolons or bars, decimal commas, columns aligned by spaces, each also gzipped, in UTF-8, UTF-16 or Latin-1;
one heading line or none, perhaps a line of units below it; lines that start with # or % are comments. Every message
names the line as an editor counts it, and the column. The file is read a few megabytes at a time.
"""

import codecs
import csv
import gzip
import io
import math
import re
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import TextIO

import numpy as np

from identify.trace import Array
from rig.errors import FileError
from rig.readers.heading import Heading, read_heading, with_units
from rig.readers.table import Table, readable

GZIP = b"\x1f\x8b"
MARKS = {b"\xef\xbb\xbf": "utf-8-sig", b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16"}
COMMENTS = ("#", "%")
NOTE = "#= "
"""Opens the comment lines in which our own export describes its recording."""
NOT_TEXT = re.compile(r"[\x00-\x08\x0e-\x1f]")
PLAIN_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*(?:e[+-]?\d+)?|\.\d+(?:e[+-]?\d+)?|nan|inf|infinity)", re.ASCII | re.I)
NAN_BITS = re.compile(r"nan\(([0-9a-f]{16})\)")
DELIMITERS = ("\t", ";", "|", ",")
MIXED = "latin-1 where not utf-8"
AT_ONCE = 1 << 22  # characters read at once
LONGEST_LINE = 1 << 22
MOST_UNPACKED, ANY_SIZE = 100, 1 << 24
"""Bytes of text for each one packed, and how many are harmless."""
UNPACKED_AT_ONCE = 1 << 20

Lines = Sequence[tuple[int, str]]
"""Lines that hold something, each with its number in the file."""


@dataclass(frozen=True, kw_only=True)
class TextTable(Table):
    """A text file; rows begin after line ``head``, and their cells are parted by ``delimiter``, or spaces if None."""

    path: Path
    head: int
    delimiter: str | None

    def pieces(self, at: Sequence[int], first: int, stop: int | None) -> Iterator[Array]:
        """Yield the rows [first, stop); raise FileError naming line and column of a cell that is no number."""
        row = 0
        for lines in _content(self.path):
            body = lines if lines[0][0] > self.head else [line for line in lines if line[0] > self.head]
            kept = body[max(first - row, 0) : None if stop is None else stop - row]
            row += len(body)
            if kept:
                yield self._numbers(kept, at)
            if stop is not None and row >= stop:
                return

    def place(self, row: int) -> str:
        """Return file and line."""
        number, _ = self._line(row)
        return f"{self.where}:{number}"

    def cell(self, row: int, at: int) -> str:
        """Return the text of a cell."""
        return cells(self._line(row)[1], self.delimiter)[at]

    def _line(self, row: int) -> tuple[int, str]:
        """Return a row with the number of its line; the file is read up to it again."""
        rows = (line for lines in _content(self.path) for line in lines if line[0] > self.head)
        return next(islice(rows, row, None))

    def _numbers(self, lines: Lines, at: Sequence[int]) -> Array:
        """Return the columns ``at`` of some lines, all of one width."""
        text = [line for _, line in lines]
        self._check_widths(lines, text)
        if self.delimiter != ",":
            text = [decimal_point(line) for line in text]
        read = None if any('"' in line for line in text) else _at_once(text, self.delimiter, at)
        if read is None:
            pairs = zip(lines, text, strict=True)
            read = np.array([self._cell_by_cell(number, line, at) for (number, _), line in pairs])
        return np.asarray(read.T, dtype=np.float64)

    def _cell_by_cell(self, number: int, line: str, at: Sequence[int]) -> list[float]:
        """Return some cells of one line, those that are empty as NaN; raise FileError."""
        held = cells(line, self.delimiter)
        values = [to_number(held[position]) for position in at]
        for position, value in zip(at, values, strict=True):
            if value is None:
                raise FileError("not a number", where=f"{self.where}:{number}: {self.label(position)}",
                                value=repr(held[position]), allowed="finite numbers in every row",
                                do="correct the cell, or leave the row out")
        return [value for value in values if value is not None]

    def _check_widths(self, lines: Lines, text: Sequence[str]) -> None:
        """Raise FileError at the first row with another number of cells than the heading, or than the first row."""
        counts = [_width(line, self.delimiter) for line in text]
        if counts.count(len(self.headings)) < len(counts):
            wrong, count = next((at, n) for at, n in enumerate(counts) if n != len(self.headings))
            raise FileError("unequal columns", where=f"{self.where}:{lines[wrong][0]}", value=f"{count} cells",
                            allowed=f"{len(self.headings)} as in the lines before", do="complete the row or remove it")


def read_text(path: Path) -> TextTable:
    """Return the text table at ``path``; raise FileError when it is empty or no text."""
    where = str(path)
    with readable(where):
        _check_packing(path)
        note, first = _notes(path), list(islice(chain.from_iterable(_content(path)), 3))
        if not first:
            raise FileError("the file is empty" if path.stat().st_size == 0 else "no rows", where=where)
        delimiter = _delimiter(first[0][1])
        headings, used = _headings(first, delimiter, where)
        if used == len(first):
            raise FileError("a header and no rows", where=where)
        table = TextTable(where=where, path=path, headings=headings, head=first[used - 1][0] if used else 0,
                          delimiter=delimiter, note=note)
        return table if delimiter == "," else _told_of_commas(table)


def _at_once(text: Sequence[str], delimiter: str | None, at: Sequence[int]) -> Array | None:
    """Return the columns ``at`` of lines without quotes, (rows, columns); None where a cell is no plain number."""
    try:
        read = np.loadtxt(text, delimiter=delimiter, usecols=at, comments=None, ndmin=2)
    except ValueError:
        return None
    return read if len(read) == len(text) else None


def cells(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of one line without quotes and surrounding space."""
    if '"' not in line or delimiter is None:
        return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]
    return [cell.strip() for cell in next(csv.reader([line.strip()], delimiter=delimiter, skipinitialspace=True))]


def to_number(cell: str) -> float | None:
    """Return what a cell says, NaN where it is empty, None where it is no number.

    Numbers are those that numpy's reader takes, Python's float takes more; a NaN of unusual bits has them in brackets.
    """
    if PLAIN_NUMBER.fullmatch(cell):
        return float(cell)
    if found := NAN_BITS.fullmatch(cell):
        value: float = struct.unpack(">d", bytes.fromhex(found[1]))[0]
        return value if math.isnan(value) else None
    return None if cell else float("nan")


def decimal_point(text: str) -> str:
    """Return ``text`` with decimal points, where commas cannot part cells."""
    return text.replace(",", ".")


def _told_of_commas(table: TextTable) -> TextTable:
    """Return the table with a remark where its numbers have decimal commas."""
    rows = (line for lines in _content(table.path) for line in lines if line[0] > table.head)
    found = next((number for number, line in rows if "," in line), None)
    remark = f"decimal commas, first in line {found}"
    fields = {key: getattr(table, key) for key in table.__dataclass_fields__}
    return table if found is None else TextTable(**fields | {"remarks": (*table.remarks, remark)})


def _as_latin_1(error: UnicodeError) -> tuple[str, int]:
    """Return what bytes that are no UTF-8 are in Latin-1, and where to go on; raise what is another error."""
    if not isinstance(error, UnicodeDecodeError):
        raise error
    return error.object[error.start : error.end].decode("latin-1"), error.end


codecs.register_error(MIXED, _as_latin_1)


def _width(line: str, delimiter: str | None) -> int:
    if delimiter is None:
        return len(line.split())
    return len(cells(line, delimiter)) if '"' in line else line.count(delimiter) + 1


def _headings(first: Lines, delimiter: str | None, where: str) -> tuple[tuple[Heading, ...], int]:
    """Return the headings and how many of the first lines are these; raise FileError for what is neither."""
    (number, line), *below = first
    head = cells(line, delimiter)
    headings = tuple(read_heading(cell) for cell in head)
    second = cells(below[0][1], delimiter) if below else []
    if len(second) == len(head) and (told := with_units(headings, second)):
        return told, 2
    words = [cell for cell in head if cell and to_number(decimal_point(cell)) is None]
    if words and len(words) < len([cell for cell in head if cell]):
        raise FileError("neither a header nor a row of numbers", where=f"{where}:{number}", value=repr(words[0]),
                        allowed="names in every column, or numbers", do="correct the cell, or add a header line")
    return (headings, 1) if words else (tuple(Heading("") for _ in head), 0)


def _delimiter(line: str) -> str | None:
    """Return what parts the cells of ``line``; None stands for any run of spaces."""
    return next((delimiter for delimiter in DELIMITERS if delimiter in line), None)


def _notes(path: Path) -> str:
    """Return what our own export says of its recording in the comments before everything else."""
    with _opened(path) as file:
        found = []
        while (line := file.readline(LONGEST_LINE)).startswith(COMMENTS):
            found += [line.removeprefix(NOTE).rstrip("\n")] if line.startswith(NOTE) else []
    return "".join(found)


def _content(path: Path) -> Iterator[Lines]:
    """Yield the lines that hold something, with their numbers, some thousand at a time."""
    number = 1
    with _opened(path) as file:
        for lines in _pieces(file, str(path)):
            found = [(at, line) for at, line in enumerate(lines, number)
                     if line and not line.startswith(COMMENTS) and not line.isspace()]
            number += len(lines)
            if found:
                yield found


def _pieces(file: TextIO, where: str) -> Iterator[list[str]]:
    """Yield the lines of a file, a few megabytes at a time; raise FileError for what is no text."""
    rest, begun = "", False
    while piece := file.read(AT_ONCE):
        if not begun and NOT_TEXT.search(piece):
            raise FileError("not a text table", where=where, allowed="CSV, TSV, or these gzipped")
        *lines, rest = (rest + piece).split("\n")
        if len(rest) > LONGEST_LINE:
            raise FileError("a line that does not end", where=where, allowed=f"at most {LONGEST_LINE} characters")
        begun = True
        yield lines
    yield [rest]


def _check_packing(path: Path) -> None:
    """Raise FileError for a gzipped file that unpacks to far more than readings do; nothing of it is kept."""
    with path.open("rb") as plain:
        if plain.read(2) != GZIP:
            return
        plain.seek(0)
        most, held = ANY_SIZE + MOST_UNPACKED * path.stat().st_size, 0
        with gzip.GzipFile(fileobj=plain) as file:
            while (count := len(file.read(UNPACKED_AT_ONCE))) and held <= most:
                held += count
    if held > most:
        raise FileError("packed far tighter than readings are", where=str(path), value=f"over {most} bytes in it",
                        allowed=f"up to {MOST_UNPACKED} for each of its own", do="unpack it, if you know what it is")


@contextmanager
def _opened(path: Path) -> Iterator[TextIO]:
    """Open a plain or gzipped file as text, by its byte order mark, as UTF-8 or else Latin-1."""
    with path.open("rb") as plain:
        packed = plain.read(2) == GZIP
        plain.seek(0)
        binary = gzip.GzipFile(fileobj=plain) if packed else plain
        start = binary.read(3)
        mark = next((mark for mark in MARKS if start.startswith(mark)), b"")
        binary.seek(0)
        with io.TextIOWrapper(binary, MARKS.get(mark, "utf-8"), errors=MIXED) as file:
            yield file
