"""How do an answer and its page reach the disk whole or not at all?"""

import json
import os
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from rig.errors import FileError, UsageError


def check_destination(path: str | Path) -> None:
    """Raise UsageError when no file can be put at ``path``: better before an hour of work than after it."""
    path = Path(path)
    if path.is_dir():
        raise UsageError("a folder stands where the file is to be written", where=str(path), do="name a file")
    if not path.resolve().parent.is_dir():
        raise UsageError("no such folder to write into", where=str(path), do="make the folder first")


def check_folder(path: str | Path) -> Path:
    """Return a folder that is there; raise UsageError."""
    if not Path(path).is_dir():
        raise UsageError("no such folder to write into", where=str(path), do="make the folder first")
    return Path(path)


def make_folder(path: Path) -> None:
    """Make a folder and those above it where they are not there; raise UsageError."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError("the folder cannot be made", where=str(path), value=error.strerror) from error


def write_text(path: str | Path, text: str) -> None:
    """Put ``text`` at ``path`` in one move, replacing what stood there; raise FileError."""
    write_bytes(path, text.encode())


def write_bytes(path: str | Path, held: bytes) -> None:
    """Put ``held`` at ``path`` in one move, replacing what stood there; raise FileError."""
    path = Path(path)
    try:
        handle, part = tempfile.mkstemp(dir=path.resolve().parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(held)
            Path(part).chmod(0o666 & ~_umask())
            Path(part).replace(path)
        except BaseException:
            with suppress(OSError):
                Path(part).unlink()
            raise
    except OSError as error:
        raise FileError("cannot be written", where=str(path), value=error.strerror) from error


def json_text(answer: Mapping[str, object]) -> str:
    """Return an answer as JSON text; raise ValueError for a number JSON has no form for."""
    return json.dumps(answer, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _umask() -> int:
    """Return the mask of permissions that new files are made with."""
    mask = os.umask(0)
    os.umask(mask)
    return mask
