"""Is a recording being written at this moment, and how do its bytes get past the HDF5 library into it?

A writer holds two locks until it closes the file or dies. One is HDF5's own, shared, as HDF5's readers hold it: they
get in, and other HDF5 writers do not. The other is of the open file (Linux), and tells everybody that somebody writes.
"""

import fcntl
import os
import struct
from io import FileIO
from pathlib import Path

_SET, _GET = (getattr(fcntl, name, None) for name in ("F_OFD_SETLK", "F_OFD_GETLK"))
"""None where the system has no locks of open files: a recording that grows then looks like one that was left."""


def being_written(path: Path) -> bool:
    """Return whether a program is recording into the file at ``path`` now."""
    try:
        with path.open("rb", buffering=0) as file:
            return is_written(file)
    except OSError:
        return False


def hold(descriptor: int) -> None:
    """Mark a file as being written until ``descriptor`` is closed: readers get in, other writers do not.

    Raises BlockingIOError when an HDF5 library has it open for writing.
    """
    fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    if _SET is not None:
        fcntl.fcntl(descriptor, _SET, _lock(fcntl.F_RDLCK))


def is_written(file: FileIO) -> bool:
    """Return whether another open file has the lock of a writer."""
    if _GET is None:
        return False
    told = fcntl.fcntl(file.fileno(), _GET, _lock(fcntl.F_WRLCK))
    return int(struct.unpack_from("h", told)[0]) != fcntl.F_UNLCK


def _lock(kind: int) -> bytes:
    """Return the lock of the first byte, a ``struct flock`` of a 64-bit system."""
    return struct.pack("hhqqi4x", kind, os.SEEK_SET, 0, 1, 0)


def put(descriptor: int, data: bytes | memoryview, at: int) -> None:
    """Write all of ``data`` at byte ``at``; raise OSError."""
    while data:
        count = os.pwrite(descriptor, data, at)
        data, at = data[count:], at + count
