"""How do plain values, and rows of texts and numbers, stand in an HDF5 file?"""

from collections.abc import Mapping, Sequence
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

Columns = Mapping[str, type]
"""Of a table: str or int by name."""


def plain(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return attributes as plain Python values."""
    return {key: value.item() if isinstance(value, np.generic) else value for key, value in attributes.items()}


def table(rows: Sequence[object], columns: Columns) -> NDArray[np.void]:
    """Return rows as a table; its text has a fixed length in UTF-8 bytes, which every HDF5 reader knows."""
    values = [tuple(getattr(row, key).encode() if kind is str else getattr(row, key) for key, kind in columns.items())
              for row in rows]
    types = [(key, h5py.string_dtype("utf-8", _longest(values, at)) if kind is str else np.dtype(np.int64))
             for at, (key, kind) in enumerate(columns.items())]
    return np.array(values, dtype=np.dtype(types))


def _longest(values: Sequence[tuple[Any, ...]], column: int) -> int:
    return max((len(row[column]) for row in values), default=0) or 1


def rows_of(dataset: h5py.Dataset) -> list[tuple[Any, ...]]:
    """Return the rows of a table as plain values."""
    rows = dataset[:].tolist()
    return [tuple(cell.decode() if isinstance(cell, bytes) else int(cell) for cell in row) for row in rows]
