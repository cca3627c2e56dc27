"""How does a recording become a file of another program, whole or not at all?"""

import os
from collections.abc import Callable
from pathlib import Path

from rig.errors import FileError
from rig.exporters import as_mat, as_npz, as_text
from rig.progress import Show, silent
from rig.recorded import Recording
from rig.recording import read

UNWRITABLE = (OSError, RuntimeError)
"""What h5py raises when a disk is full."""
KINDS: dict[str, Callable[[Path, Recording, Show], None]] = {"csv": as_text.put, "mat": as_mat.put, "npz": as_npz.put}
"""What writes a recording to a path, by stretches, by the kind of file."""


def export(
    run: str | Path, kind: str, path: Path, overwrite: bool = False,
    progress: Show = silent,
) -> Recording:  # fmt: skip
    """Write the recording at ``run`` to ``path`` as ``kind``; return it.

    Raises FileError when the recording is damaged, when there is a file already that is not to be replaced, and when it
    cannot be written; what was there before is then still there.
    """
    recording = read(run)
    if path.exists() and (not overwrite or path.samefile(run)):
        or_replace = "" if path.samefile(run) else ", or replace it with --overwrite"
        raise FileError("there is a file of this name already", where=str(path), do=f"choose another name{or_replace}")
    part = path.with_name(f"{path.name}.part")
    try:
        KINDS[kind](part, recording, progress)
        with part.open("rb") as file:
            os.fsync(file.fileno())
        part.replace(path)
    except UNWRITABLE as error:
        told = error.strerror if isinstance(error, OSError) else None
        raise FileError("cannot be written", where=str(path), value=told or str(error).splitlines()[0]) from error
    finally:
        part.unlink(missing_ok=True)
    return recording
