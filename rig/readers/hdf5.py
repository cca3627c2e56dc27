"""Which columns of numbers are in an HDF5 file, each called by its path, or in a MAT file of version 7.3?

Only what stands in the file itself is read: links to other files, virtual datasets and raw data kept elsewhere are not
followed. A unit may stand in the attribute ``unit`` or ``units``; one that is not known is refused where the column is
asked for. Version 7.3 of MAT files is HDF5 by convention.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from identify.trace import blocks
from rig.errors import FileError
from rig.readers.arrays import ArrayTable, Stand, Values, check_packing, columns_of
from rig.readers.heading import SPELT, Heading
from rig.readers.table import NOTE

UNITS = {"unit", "units", "unit_string"}
"""Attributes that name the unit of a dataset, in any case."""
MATLABS_OWN = "#"
"""Opens the names of groups in which MATLAB keeps what is no variable."""
LARGEST_CHUNK = 1 << 28  # bytes
LONGEST_TEXT = 1 << 28  # characters


@dataclass(frozen=True, kw_only=True)
class Hdf5Table(ArrayTable):
    """The datasets of an HDF5 file."""

    def stretch(self, stand: Stand, start: int, stop: int) -> Iterator[Values]:
        """Yield the rows [start, stop) of a column; raise FileError for data that are not in the file."""
        with h5py.File(self.path, "r") as file:
            dataset = file[stand.array]
            _check(dataset, f"{self.where}: {stand.array}", self.path.stat().st_size)
            for a, b in blocks(start, stop):
                yield stand.of(dataset, a, b)


def read_hdf5(path: Path) -> Hdf5Table:
    """Return the table; raise OSError and its like for a damaged file."""
    columns: list[tuple[Heading, Stand]] = []
    with h5py.File(path, "r") as file:
        for name, dataset in _datasets(file).items():
            columns += columns_of(name, dataset.shape or (), dataset.dtype, _unit(dataset))
        note = _text(file[NOTE]) if isinstance(file.get(NOTE, getlink=True), h5py.HardLink) else ""
    headings, stands = zip(*columns, strict=True) if columns else ((), ())
    return Hdf5Table(where=str(path), path=path, headings=headings, stands=stands, note=note)


def _datasets(file: h5py.File) -> dict[str, h5py.Dataset]:
    """Return all datasets by path; links that lead out of the file are not followed."""
    found: dict[str, h5py.Dataset] = {}

    def visit(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith(MATLABS_OWN):
            found[name] = item

    file.visititems(visit)
    return found


def _unit(dataset: h5py.Dataset) -> str:
    """Return the unit in a dataset's attributes; empty where there is none."""
    held = next((dataset.attrs[key] for key in dataset.attrs if key.lower() in UNITS), "")
    told = held.flat[0] if isinstance(held, np.ndarray) and held.size == 1 else held  # MATLAB writes arrays of one
    text = (told.decode("utf-8", "replace") if isinstance(told, bytes) else str(told)).strip()
    return SPELT.get(text.lower(), text)


def _text(item: Any) -> str:
    """Return a text as MATLAB keeps it, 16 bits a character; empty where it is none."""
    if not isinstance(item, h5py.Dataset) or item.attrs.get("MATLAB_class") != b"char":
        return ""
    if item.dtype != np.uint16 or item.size > LONGEST_TEXT:
        return ""
    return bytes(np.ravel(item[()]).astype("<u2").tobytes()).decode("utf-16-le")


def _check(dataset: h5py.Dataset, where: str, held: int) -> None:
    """Raise FileError for a dataset whose values are elsewhere, or more than the file can hold."""
    if dataset.is_virtual or dataset.external:
        raise FileError("its values stand in another file", where=where, do="copy them into this one, h5repack does")
    check_packing(where, dataset.shape, dataset.dtype, held)
    chunk = float(np.prod(dataset.chunks or (1,), dtype=float)) * dataset.dtype.itemsize
    if chunk > LARGEST_CHUNK:
        raise FileError("chunks too large to be read one by one", where=where, value=f"{chunk:.3g} bytes",
                        allowed=f"{LARGEST_CHUNK} bytes", do="write it with smaller chunks, h5repack does")
