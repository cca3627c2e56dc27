"""Which file does a name inside a file mean, and does it stay beside that file?

A protocol names a rig, a table, a simulated device. Such a name came with the file, perhaps from somebody else. It
means a file in the folder of the one that names it, or below, or one that comes with the program. What leads elsewhere
(an absolute path, ``..``, a link) is refused: only who types a command may name any file there is.
"""

from pathlib import Path

import protocols
from rig.errors import MisfitError

ALLOWED = "a file beside the one that names it or in a folder below, or one that comes with the program"
UNUSABLE = (OSError, ValueError, RuntimeError)
"""What a path raises that no file system takes: too long, with a NUL in it, links in a circle."""


def stays_inside(name: str) -> str:
    """Return ``name`` as it is; raise MisfitError where its text leads out of the folder it is seen from."""
    if not name or not name.isprintable():
        raise MisfitError("not the name of a file", value=repr(name), allowed=ALLOWED)
    if Path(name).is_absolute() or ".." in Path(name).parts:
        raise _leads_out(name)
    return name


def file_meant(name: str, folder: Path) -> Path | None:
    """Return the file that ``name`` means inside a file in ``folder``, the path as written; None where there is none.

    Raises MisfitError where the name, or a link on the way, leads out.
    """
    stays_inside(name)
    for root in (folder, packaged()):
        if is_file(root / name):
            if not (root / name).resolve().is_relative_to(root.resolve()):
                raise _leads_out(name)
            return root / name
    return None


def is_beside(path: Path, folder: Path) -> bool:
    """Return whether ``path`` leads to what lies in ``folder``, below it, or comes with the program."""
    try:
        return any(path.resolve().is_relative_to(root.resolve()) for root in (folder, packaged()))
    except UNUSABLE:
        return False


def name_seen_from(path: Path, folder: Path) -> str:
    """Return the name by which a file in ``folder`` means one that ``is_beside`` it."""
    root = packaged() if path.resolve().is_relative_to(packaged().resolve()) else folder
    return path.resolve().relative_to(root.resolve()).as_posix()


def is_file(path: Path) -> bool:
    """Return whether there is a file at ``path``, which may be one that no file system takes."""
    try:
        return path.is_file()
    except UNUSABLE:
        return False


def packaged() -> Path:
    """Return the folder of the protocols and rigs that come with the program."""
    return Path(protocols.__path__[0])


def _leads_out(name: str) -> MisfitError:
    return MisfitError("a file's references stay beside it", value=repr(name), allowed=ALLOWED,
                       do="put the file there, or name it on the command line")
