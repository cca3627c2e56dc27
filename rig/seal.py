"""Is a recording, byte for byte, what was written - asked before any HDF5 library parses it?

A damaged HDF5 structure can crash the library that reads it, so the checksum of the whole file stands outside of it, in
the user block: 512 bytes of plain text before the HDF5 part, which every HDF5 reader skips. A file that a tool wrote
anew has no user block; its datasets then answer for themselves.
"""

import hashlib
from enum import Enum
from pathlib import Path

SCHEMA = "rig.recording/1"
SIGNATURE = b"\x89HDF\r\n\x1a\n"
SIZE = 512
UNFINISHED = f"{SCHEMA} unfinished"
SEALED = f"{SCHEMA} sha256 "
NOTE = "\nHDF5 from byte 512 on; the SHA-256 is that of all bytes from there to the end.\n"


class Seal(Enum):
    """What the bytes of a file say before it is opened."""

    EMPTY = "0 bytes"
    NOT_HDF5 = "no HDF5 signature"
    FOREIGN = "HDF5 of another program"
    BROKEN = "the bytes do not match their checksum"
    ABSENT = "HDF5 without a checksum of its bytes"
    INTACT = "the bytes match their checksum"


def seal(path: Path, *, finished: bool) -> None:
    """Write the user block of the file at ``path``; raise OSError."""
    text = f"{SEALED}{_digest(path)}" if finished else UNFINISHED
    with path.open("r+b") as file:
        file.write(f"{text}{NOTE}".encode().ljust(SIZE))


def inspect(path: Path) -> Seal:
    """Return what the bytes of the file at ``path`` say; raise OSError."""
    with path.open("rb") as file:
        head = file.read(SIZE + len(SIGNATURE))
    if not head:
        return Seal.EMPTY
    if head.startswith(SIGNATURE):
        return Seal.ABSENT
    if head[SIZE:] != SIGNATURE:
        return Seal.NOT_HDF5
    return _judged(path, head[:SIZE].decode("latin-1"))


def _judged(path: Path, block: str) -> Seal:
    """Return what a user block says of the bytes after it."""
    text, note, rest = block.partition(NOTE)
    if not (note and not rest.strip(" ") and text.startswith((SEALED, UNFINISHED))):
        return Seal.FOREIGN
    if text == UNFINISHED:
        return Seal.ABSENT
    return Seal.INTACT if text == f"{SEALED}{_digest(path)}" else Seal.BROKEN


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        file.seek(SIZE)
        return hashlib.file_digest(file, "sha256").hexdigest()
