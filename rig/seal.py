"""Is a recording, byte for byte, what was written - asked before any HDF5 library parses it?

A damaged HDF5 structure can crash the library that reads it, so the checksum of the whole file stands outside of it, in
the user block: plain text before the HDF5 part, which every HDF5 reader skips. A file that a tool wrote anew has no
user block; its datasets then answer for themselves. A run that is not finished has another user block
(``rig/unfinished.py``).
"""

import hashlib
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from io import FileIO
from pathlib import Path

import xxhash

NAME, VERSION = "rig.recording", 1
SCHEMA = f"{NAME}/{VERSION}"
NEEDS = "backlash-rig 0.1.0"
"""The first program that reads recordings of this schema."""
SIGNATURE = b"\x89HDF\r\n\x1a\n"
SIZE = 512
GROWING = "growing"
UNFINISHED = "unfinished"  # as runs were marked that came before those with a journal
PIECE = 1 << 20  # bytes read at once
READERS = f"Read by {NEEDS} and later.\n"
NOTES = {
    "xxh3-128": f"HDF5 from byte {SIZE} on; the checksum is that of all bytes from there to the end. {READERS}",
    "sha256": f"HDF5 from byte {SIZE} on; the SHA-256 is that of all bytes from there to the end.\n",
}
"""What stands below the checksum, by its kind. The first is written; it is computed as fast as the bytes are read."""
_BLOCK = re.compile(rf"{re.escape(NAME)}/(\d+) (\S+)(?: (\S+))?\n")
_NEEDS = re.compile(r"Read by (\S+ \S+) and later")


class Seal(Enum):
    """What the bytes of a file say before it is opened."""

    EMPTY = "0 bytes"
    NOT_HDF5 = "no HDF5 signature"
    FOREIGN = "HDF5 of another program"
    NEWER = "a recording of a newer program"
    BROKEN = "the bytes do not match their checksum"
    ABSENT = "HDF5 without a checksum of its bytes"
    GROWING = "a run that is not finished"
    INTACT = "the bytes match their checksum"


@dataclass(frozen=True)
class Marked:
    """What the first line of a user block says: version of the schema, kind and value of the checksum."""

    version: int
    kind: str
    checksum: str
    needs: str


def seal(path: Path) -> None:
    """Write the user block of a finished file at ``path``; raise OSError."""
    kind = next(iter(NOTES))
    with path.open("r+b", buffering=0) as file:
        found = _digest(file, kind)
        file.seek(0)
        file.write(_text(kind, found).encode().ljust(SIZE))


def inspect(path: Path) -> Seal:
    """Return what the bytes of the file at ``path`` say; raise OSError. Of a run that grows no bytes are compared."""
    with path.open("rb", buffering=0) as file:
        head = file.read(SIZE + len(SIGNATURE))
        if not head:
            return Seal.EMPTY
        if head.startswith(SIGNATURE):
            return Seal.ABSENT
        marked = mark_of(head)
        if marked is None:
            return _unmarked(head)
        if marked.version > VERSION:
            return Seal.NEWER
        if marked.kind == GROWING:
            return Seal.GROWING
        return _judged(file, head, marked)


def mark_of(head: bytes) -> Marked | None:
    """Return what a user block says of itself; None when it is none of this program."""
    text = head[:SIZE].decode("latin-1")
    if (found := _BLOCK.match(text)) is None:
        return None
    needs = _NEEDS.search(text)
    return Marked(int(found[1]), found[2], found[3] or "", needs[1] if needs else "")


def marked_at(path: Path) -> Marked | None:
    """Return what the user block of the file at ``path`` says of itself; raise OSError."""
    with path.open("rb") as file:
        return mark_of(file.read(SIZE))


def pieces(file: FileIO, start: int, stop: int | None = None) -> Iterator[memoryview]:
    """Yield the bytes [start, stop) of a file, in one buffer that is used again; raise OSError."""
    left = (os.fstat(file.fileno()).st_size if stop is None else stop) - start
    buffer = memoryview(bytearray(max(0, min(PIECE, left))))
    file.seek(start)
    while left > 0 and (count := file.readinto(buffer[: min(PIECE, left)])):
        yield buffer[:count]
        left -= count


def _unmarked(head: bytes) -> Seal:
    """Return what a file is whose user block is none of this program, or was damaged."""
    if head.startswith(NAME.encode()):
        return Seal.BROKEN
    return Seal.FOREIGN if head[SIZE:] == SIGNATURE else Seal.NOT_HDF5


def _judged(file: FileIO, head: bytes, marked: Marked) -> Seal:
    """Return what a user block says of the bytes after it."""
    block, kind = head[:SIZE], marked.kind
    if kind == UNFINISHED and block == f"{SCHEMA} {UNFINISHED}\n{NOTES['sha256']}".encode().ljust(SIZE):
        return Seal.ABSENT
    if kind not in NOTES or block != _text(kind, marked.checksum).encode().ljust(SIZE):
        return Seal.BROKEN
    return Seal.INTACT if marked.checksum == _digest(file, kind) else Seal.BROKEN


def _text(kind: str, checksum: str) -> str:
    return f"{SCHEMA} {kind} {checksum}\n{NOTES[kind]}"


def _digest(file: FileIO, kind: str) -> str:
    """Return the checksum of all bytes behind the user block."""
    found = xxhash.xxh3_128() if kind == "xxh3-128" else hashlib.sha256()
    for piece in pieces(file, SIZE):
        found.update(piece)
    return found.hexdigest()
