"""Which columns of numbers are in a NumPy file, ``.npz`` or ``.npy``, without unpickling anything?

Arrays are read as a stream, packed or not: of each member of the archive its head, then stretch by stretch its values.
"""

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from identify.trace import blocks
from rig.errors import FileError
from rig.readers.arrays import ArrayTable, Stand, Values, check_packing, columns_of
from rig.readers.heading import Heading
from rig.readers.table import NOTE

ARRAY, ARCHIVE = b"\x93NUMPY", b"PK\x03\x04"
"""How a file of one array begins, and how an archive of several."""
SUFFIX = ".npy"
LONGEST_TEXT = 1 << 28  # bytes
AT_ONCE = 1 << 16  # rows


@dataclass(frozen=True)
class Head:
    """What stands before the values of an array; ``lengths`` are in the order of the bytes, the slowest first."""

    lengths: tuple[int, ...]
    kind: np.dtype[Any]


@dataclass(frozen=True, kw_only=True)
class NumpyTable(ArrayTable):
    """A NumPy archive, or a file of a single array, which has no name."""

    def stretch(self, stand: Stand, start: int, stop: int) -> Iterator[Values]:
        """Yield the rows [start, stop) of a column; what stands beside it is passed over."""
        with _member(self.path, stand.array) as file:
            head = _head(file)
            across = head.lengths[-1] if stand.at is not None and stand.axis == 0 else 1
            before = (stand.at or 0) * head.lengths[-1] if stand.axis == 1 else start * across
            _skip(file, (before + (start if stand.axis == 1 else 0)) * head.kind.itemsize)
            for a, b in blocks(start, stop):
                yield np.concatenate([_rows(file, head, stand, across, d - c) for c, d in blocks(a, b, AT_ONCE)])


def read_numpy(path: Path) -> NumpyTable:
    """Return the table; raise FileError for objects, and for arrays that claim more than the file can hold."""
    columns: list[tuple[Heading, Stand]] = []
    note = ""
    for name, held in _members(path).items():
        with _member(path, name) as file:
            head = _head(file)
            where = f"{path}: {name}" if name else str(path)
            if head.kind.hasobject:
                raise FileError("an array of Python objects, which is never loaded", where=where,
                                allowed="arrays of numbers", do="save it with a dtype of numbers")
            check_packing(where, head.lengths, head.kind, held)
            if name == NOTE and head.lengths == () and head.kind.kind == "U" and head.kind.itemsize < LONGEST_TEXT:
                note = str(np.frombuffer(_exactly(file, head.kind.itemsize), head.kind)[0])
        columns += columns_of(name, head.lengths, head.kind)
    headings, stands = zip(*columns, strict=True) if columns else ((), ())
    return NumpyTable(where=str(path), path=path, headings=headings, stands=stands, note=note)


def _members(path: Path) -> dict[str, int]:
    """Return the names of the arrays in a file, and the bytes that each takes there."""
    with path.open("rb") as file:
        if file.read(len(ARRAY)) == ARRAY:
            return {"": path.stat().st_size}
    with zipfile.ZipFile(path) as archive:
        found = {member.filename.removesuffix(SUFFIX): member.compress_size for member in archive.infolist()
                 if member.filename.endswith(SUFFIX)}
    if not found:
        raise FileError("an archive without NumPy arrays", where=str(path), allowed=".npz",
                        do="save a spreadsheet as CSV; of other archives import what is in them")
    return found


@contextmanager
def _member(path: Path, name: str) -> Iterator[IO[bytes]]:
    """Open one array of a file."""
    if not name:
        with path.open("rb") as file:
            yield file
    else:
        with zipfile.ZipFile(path) as archive, archive.open(name + SUFFIX) as member:
            yield member


def _head(file: IO[bytes]) -> Head:
    """Return what stands before the values; raise ValueError for what is none."""
    version = np.lib.format.read_magic(file)
    read = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}.get(version)
    if read is None:
        raise ValueError(f"NPY format {version[0]}.{version[1]}, where 1.0 and 2.0 are known")
    lengths, reversed_, kind = read(file)
    return Head(tuple(reversed(lengths)) if reversed_ else tuple(lengths), kind)


def _rows(file: IO[bytes], head: Head, stand: Stand, across: int, count: int) -> Values:
    """Return the next rows of a column, ``across`` values being there for each."""
    data = _exactly(file, count * across * head.kind.itemsize)
    values = np.frombuffer(data, head.kind).reshape(count, across)[:, (stand.at or 0) if across > 1 else 0]
    return values[stand.field] if stand.field else values


def _skip(file: IO[bytes], count: int) -> None:
    """Pass over some bytes; in an archive what stands there is packed."""
    if file.seekable():
        file.seek(count, 1)
    else:
        while count:
            count -= len(_exactly(file, min(count, AT_ONCE)))


def _exactly(file: IO[bytes], count: int) -> bytes:
    """Return that many bytes; raise EOFError when there are fewer."""
    data = file.read(count)
    if len(data) != count:
        raise EOFError("the file ends before its array does")
    return data
