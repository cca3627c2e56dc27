"""How is a run kept in a file that survives a killed process, and is any damage to it found?

HDF5, readable by plain h5py, MATLAB and HDFView: datasets ``u``, ``y``, ``ledger`` and perhaps ``u_measured``, further
inputs in the group ``inputs``, tables ``steps`` and ``events``, texts ``protocol`` and ``rig``, everything else as
attributes. While a run is being recorded only sample values are written, in place, into a file whose structure was
finished before: whenever the process dies, the file opens. The finished recording replaces it in one move, with a
SHA-256 on every dataset and on the attributes.
"""

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import h5py
import numpy as np

from identify.trace import Array, Samples
from rig.block import NO_FURTHER
from rig.errors import FileError
from rig.growing import Growing
from rig.plan import Plan
from rig.provenance import git_commit, now, software
from rig.recorded import Entry, Equipment, Event, Origin, Recording
from rig.recordingfile import ForeignError, load, place, store
from rig.samples import NotRead
from rig.seal import SCHEMA, Seal, inspect

__all__ = ["Entry", "Equipment", "Event", "Origin", "Recording", "Writer", "read", "write"]

UNWRITABLE = (OSError, RuntimeError)
"""What h5py raises when a disk is full or a folder is not there."""
DAMAGE = (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, IndexError, MemoryError)


def read(path: str | Path) -> Recording:
    """Return the recording at ``path``; raise FileError for anything else, and for any damage to it."""
    path = Path(path)
    intact = _sealed(path) is Seal.INTACT
    try:
        with h5py.File(path, "r") as file:
            return load(file, path.stem, intact=intact)
    except ForeignError as error:
        raise _foreign(path, str(error)) from error
    except BlockingIOError as error:
        raise FileError("the recording is still being written", where=str(path),
                        do="wait for the run to end") from error
    except DAMAGE as error:
        reason = str(error.args[0] if error.args else type(error).__name__).splitlines()[0]
        raise _damaged(path, reason) from error


def write(path: str | Path, recording: Recording, overwrite: bool = False) -> None:
    """Write a finished recording in one move: the file at ``path`` is the old one or the new one, never half of it.

    Raises FileError when it cannot be written, or exists and is not to be overwritten.
    """
    _put(_free(path, overwrite), recording)


def _put(path: Path, recording: Recording) -> None:
    """Write the file beside ``path`` and move it there; raise FileError, leaving what was there before."""
    part = path.with_name(f"{path.name}.part")
    try:
        store(part, recording)
        with part.open("rb") as file:
            os.fsync(file.fileno())
        part.replace(path)
    except UNWRITABLE as error:
        part.unlink(missing_ok=True)
        raise FileError("cannot be written", where=str(path), value=_reason(error)) from error


def _sealed(path: Path) -> Seal:
    """Return what the bytes at ``path`` say; raise FileError for what no HDF5 library should be shown."""
    if not path.is_file():
        raise FileError("no such recording" if not path.exists() else "not a file", where=str(path))
    try:
        found = inspect(path)
    except OSError as error:
        raise FileError("cannot be read", where=str(path), value=_reason(error)) from error
    if found is Seal.EMPTY:
        raise FileError("the recording is empty", where=str(path), value=found.value, do="record it again")
    if found is Seal.NOT_HDF5:
        raise FileError("not an HDF5 file", where=str(path), do="bring tables in with 'rig import'")
    if found is Seal.FOREIGN:
        raise _foreign(path, found.value)
    if found is Seal.BROKEN:
        raise _damaged(path, found.value)
    return found


def _foreign(path: Path, calls_itself: str) -> FileError:
    return FileError("not a recording of this program", where=str(path), value=calls_itself, allowed=SCHEMA,
                     do="bring it in with 'rig import'")


def _damaged(path: Path, how: str) -> FileError:
    return FileError("damaged or truncated recording", where=str(path), value=how,
                     do="use a copy of it, or record again")


def _free(path: str | Path, overwrite: bool) -> Path:
    """Return ``path`` where a recording may be put; raise FileError when one is there."""
    path = Path(path)
    if path.exists() and not overwrite:
        raise FileError("there is a file of this name already", where=str(path), do="choose another name or remove it")
    return path


class Writer:
    """Records one run into the file at ``path`` while it goes on; the space is reserved before anything is played."""

    def __init__(
        self, path: str | Path, plan: Plan, equipment: Equipment, u: Array | None = None, overwrite: bool = False,
    ) -> None:
        """Create the file; ``u`` is what the DAC puts out where that is rounded from the plan's.

        Raises FileError when it cannot be made, or exists and is not to be overwritten.
        """
        self.path = _free(path, overwrite)
        self._position = 0
        _put(self.path, _begun(self.path, plan, equipment, plan.u if u is None else u))
        self._growing = Growing(self.path, {name: place(name) for name in plan.inputs})
        self._inputs = plan.inputs

    def append(self, start: int, y: Array, further: Array = NO_FURTHER) -> None:
        """Store ``y`` (n,), V, as the samples from index ``start`` on; those skipped since the last call are lost.

        ``further`` (inputs - 1, n) are the other inputs of the plan, in its order. Raises ValueError for samples that
        do not follow, or of other inputs. On return they are with the operating system.
        """
        stop, size = start + len(y), self._growing.size
        if not self._position <= start <= stop <= size:
            raise ValueError(f"samples {start} to {stop} do not follow {self._position} of {size}")
        if 1 + len(further) != len(self._inputs):
            raise ValueError(f"{1 + len(further)} inputs where {len(self._inputs)} are recorded")
        for name, values in zip(self._inputs, (y, *further), strict=True):
            self._growing.write(name, start, values)
        self._growing.enter(self._position, start, Entry.LOST)
        self._growing.enter(start, stop, Entry.RECORDED)
        self._position = stop

    def finish(self, complete: bool, reason: str, events: Iterable[Event] = ()) -> Recording:
        """Close the run and return it; ``lost`` events without samples after them are entered in the ledger.

        Raises FileError when the finished file cannot be written; what was recorded stays readable.
        """
        self.close()
        begun, happened = _whole(self.path), tuple(events)
        ledger = begun.ledger.copy()
        for event in happened:
            if event.kind == "lost":
                stretch = ledger[event.start:event.stop]
                stretch[stretch == Entry.NOT_RECEIVED] = Entry.LOST
        finished = replace(begun, ledger=ledger, complete=complete, reason=reason, events=happened,
                           origin=replace(begun.origin, finished=now()))
        _put(self.path, finished)
        return _whole(self.path)

    def close(self) -> None:
        """Let go of the file as it stands; harmless when it was finished."""
        self._growing.close()

    def __enter__(self) -> Self:
        """Return the writer itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
                 ) -> None:
        """Close the file; a run that was not finished stays readable as far as it went."""
        self.close()


def _whole(path: Path) -> Recording:
    """Return the recording this program has just written; long signals stay in the file."""
    with h5py.File(path, "r") as file:
        return load(file, path.stem, intact=True)


def _begun(path: Path, plan: Plan, equipment: Equipment, u: Array) -> Recording:
    """Return the recording of a run of which nothing was received yet."""
    origin = Origin(equipment, software(), git_commit(), started=now())
    nothing = NotRead(u.size)
    return Recording(
        name=path.stem, rate_hz=plan.rate_hz, u=u, **_by_field(dict.fromkeys(plan.inputs, nothing)),
        ledger=np.full(u.size, Entry.NOT_RECEIVED, dtype=np.uint8), origin=origin, title=plan.title,
        question=plan.question, protocol_text=plan.protocol_text, rig_text=plan.rig_text, complete=False,
        reason="the program ended before the run did",
        steps=plan.steps, initial=plan.initial,
    )


def _by_field(inputs: Mapping[str, Samples]) -> dict[str, Any]:
    """Return the inputs by name as a Recording has them: y, u_measured where there is one, and the further ones."""
    own = {name: inputs[name] for name in ("y", "u_measured") if name in inputs}
    return {**own, "further": {name: values for name, values in inputs.items() if name not in own}}


def _reason(error: Exception) -> str:
    """Return the operating system's word for what went wrong, out of h5py's where it is only there."""
    text = str(error).splitlines()[0]
    quoted = re.search(r"error message = '([^']*)'", text)
    told = error.strerror if isinstance(error, OSError) else None
    return quoted[1] if quoted else told or text

