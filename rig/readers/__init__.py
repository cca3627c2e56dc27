"""Which reader opens a file of another program? Told from the first bytes of the file, whatever its name."""

from pathlib import Path

from rig.errors import FileError, UsageError
from rig.readers import npz, wav
from rig.readers.table import Table, Wanted, readable
from rig.readers.text import read_text

__all__ = ["Table", "Wanted", "open_table"]

HDF5 = b"\x89HDF\r\n\x1a\n"
USER_BLOCK = 512
"""Bytes before an HDF5 signature in MAT files of version 7.3 and in recordings."""


def open_table(path: str | Path, full_scale_v: float | None = None) -> Table:
    """Return the table in the file at ``path``, text where its first bytes are of no other kind; raise FileError.

    ``full_scale_v`` is what full scale stands for in a kind of file that holds shares of it.
    """
    path = Path(path)
    if not path.is_file():
        raise FileError("no such file" if not path.exists() else "not a file", where=str(path))
    with readable(path):
        with path.open("rb") as file:
            start = file.read(USER_BLOCK + len(HDF5))
        return _read(path, start, full_scale_v)


def _read(path: Path, start: bytes, full_scale_v: float | None) -> Table:
    """Return the table in a file that begins so; the library it takes is loaded only here."""
    if start.startswith(wav.SIGNATURES) and start[8:12] == b"WAVE":
        return wav.read_wav(path, full_scale_v)
    if full_scale_v is not None:
        raise UsageError("full scale is of WAV files", where=str(path), do="leave --full-scale out")
    if start.startswith((npz.ARRAY, npz.ARCHIVE)):
        return npz.read_numpy(path)
    return _with_library(path, start)


def _with_library(path: Path, start: bytes) -> Table:
    """Return the table in a file that a library reads, which is loaded only here; else as text."""
    if start.startswith(b"TDSm"):
        from rig.readers.tdms import read_tdms

        return read_tdms(path)
    if HDF5 in (start[: len(HDF5)], start[USER_BLOCK:]):
        from rig.readers.hdf5 import read_hdf5
        from rig.unvouched import check_readable

        check_readable(path, contained=False)
        return read_hdf5(path)
    if start[124:128] in (b"\x00\x01IM", b"\x01\x00MI"):
        from rig.readers.mat5 import read_mat5

        return read_mat5(path)
    return read_text(path)
