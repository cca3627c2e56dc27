"""Which columns of numbers are in a MAT file of version 5, up to MATLAB's -v7?

SciPy reads a variable whole, so what is read here has an end; version 7.3, which is HDF5, is read by stretches.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.io import loadmat, whosmat

from identify.trace import blocks
from rig.errors import FileError
from rig.readers.arrays import ArrayTable, Stand, Values, check_packing, columns_of
from rig.readers.heading import Heading
from rig.readers.table import NOTE

LARGEST = 1 << 25
"""Values of a variable: 256 MB."""
KINDS = {"double": "f8", "single": "f4", "logical": "u1", "int8": "i1", "int16": "i2", "int32": "i4", "int64": "i8",
         "uint8": "u1", "uint16": "u2", "uint32": "u4", "uint64": "u8"}  # fmt: skip
"""Classes of variables that are numbers, with what they are in memory."""


@dataclass(frozen=True, kw_only=True)
class Mat5Table(ArrayTable):
    """The numeric variables of a MAT file."""

    def stretch(self, stand: Stand, start: int, stop: int) -> Iterator[Values]:
        """Yield the rows [start, stop) of a column out of its variable, which is read whole."""
        values = loadmat(str(self.path), variable_names=[stand.array], appendmat=False)[stand.array]
        if not isinstance(values, np.ndarray) or values.ndim != 2 or values.shape[stand.axis] != stand.rows:
            raise ValueError(f"the variable {stand.array} is not what its head says")
        for a, b in blocks(start, stop):
            yield stand.of(values, a, b)


def read_mat5(path: Path) -> Mat5Table:
    """Return the table; raise FileError for a variable too large to be read whole."""
    columns: list[tuple[Heading, Stand]] = []
    note = ""
    for name, lengths, kind in whosmat(str(path), appendmat=False):
        if kind in KINDS:
            _check(f"{path}: {name}", tuple(map(int, lengths)), np.dtype(KINDS[kind]), path.stat().st_size)
            columns += columns_of(name, tuple(map(int, lengths)), np.dtype(KINDS[kind]))
        if (name, kind) == (NOTE, "char"):
            note = "".join(map(str, loadmat(str(path), variable_names=[NOTE], appendmat=False)[NOTE]))
    headings, stands = zip(*columns, strict=True) if columns else ((), ())
    return Mat5Table(where=str(path), path=path, headings=headings, stands=stands, note=note)


def _check(where: str, lengths: tuple[int, ...], kind: np.dtype[np.generic], held: int) -> None:
    """Raise FileError for a variable that is too much at once, or more than the file can hold."""
    check_packing(where, lengths, kind, held)
    if float(np.prod(lengths, dtype=float)) > LARGEST:
        raise FileError("a variable too large to be read whole", where=where, value=" x ".join(map(str, lengths)),
                        allowed=f"{LARGEST} values", do="save it with -v7.3, which is read by stretches")
