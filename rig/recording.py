"""How is a run kept in a file that survives a killed process, and is any damage to it found?

HDF5, readable by plain h5py, MATLAB and HDFView: datasets ``u``, ``y``, ``ledger`` and perhaps ``u_measured``, further
inputs in the group ``inputs``, tables ``steps`` and ``events``, texts ``protocol`` and ``rig``, everything else as
attributes. While a run is being recorded only values are written, in place, into a file whose structure was finished
before: whenever the process dies, the file opens, and until then it can be read. The finished recording replaces it in
one move, with a SHA-256 on every dataset and on the attributes, and a checksum of all its bytes (``rig/README.md``).
"""

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

import h5py
import numpy as np

from identify.trace import Array, Samples
from rig.block import NO_FURTHER
from rig.errors import FileError
from rig.growing import Growing
from rig.plan import Plan
from rig.provenance import git_commit, now, software
from rig.recorded import Entry, Equipment, Event, Origin, Recording
from rig.recordingfile import ForeignError, NewerError, begin, load, place, store
from rig.samples import NotRead
from rig.seal import NAME, SCHEMA, Seal, inspect, marked_at
from rig.unfinished import LastWords, ended
from rig.unfinished import inspect as inspect_unfinished
from rig.unvouched import check_readable
from rig.writing import being_written

__all__ = ["Entry", "Equipment", "Event", "Origin", "Recording", "Writer", "read", "write"]

UNWRITABLE = (OSError, RuntimeError)
"""What h5py raises when a disk is full or a folder is not there."""
DAMAGE = (OSError, RuntimeError, KeyError, ValueError, TypeError, AttributeError, IndexError, ArithmeticError,
          MemoryError)
LOOKS = 5
"""How often a file is looked at that another program writes meanwhile, and may finish and replace."""
Found = TypeVar("Found")


def read(path: str | Path) -> Recording:
    """Return the recording at ``path``, as far as it went when it is being written or its program was killed.

    Raises FileError for anything else, and for any damage to it.
    """
    path = Path(path)
    with told(path):
        return settled(path, lambda: _read(path, sealed(path)))


def _read(path: Path, found: Seal) -> Recording:
    unfinished = inspect_unfinished(path) if found is Seal.GROWING else None
    if found is Seal.ABSENT:
        check_readable(path)
    with h5py.File(path, "r") as file:
        live = unfinished is not None and unfinished.being_written
        recording = load(file, path.stem, intact=found is not Seal.ABSENT, live=live)
    if unfinished is None:
        return recording
    return ended(recording, unfinished.words) if unfinished.words else replace(recording, reason=unfinished.reason)


def settled(path: Path, look: Callable[[], Found]) -> Found:
    """Return what ``look`` finds; what looks like damage while a program writes the file is looked at once more."""
    for _ in range(LOOKS):
        busy = being_written(path)
        try:
            return look()
        except (*DAMAGE, FileError):
            if not busy:
                raise
    return look()


@contextmanager
def told(path: Path) -> Iterator[None]:
    """Turn what goes wrong with the recording at ``path`` into a FileError."""
    try:
        yield
    except ForeignError as error:
        raise _foreign(path, str(error)) from error
    except NewerError as error:
        raise _newer(path, *map(str, error.args)) from error
    except BlockingIOError as error:
        raise FileError("another program has the recording open for writing", where=str(path),
                        do="close it there") from error
    except DAMAGE as error:
        reason = str(error.args[0] if error.args else type(error).__name__).splitlines()[0]
        raise _damaged(path, reason) from error


def write(path: str | Path, recording: Recording, overwrite: bool = False) -> None:
    """Write a finished recording in one move: the file at ``path`` is the old one or the new one, never half of it.

    Raises FileError when it cannot be written, or exists and is not to be overwritten.
    """
    _put(_free(path, overwrite), lambda part: store(part, recording))


def _put(path: Path, write: Callable[[Path], None]) -> None:
    """Write the file beside ``path`` and move it there; raise FileError, leaving what was there before."""
    part = path.with_name(f"{path.name}.part")
    try:
        write(part)
        _to_disk(part)
        part.replace(path)
        with suppress(OSError):  # some file systems do not sync a folder; the file is there all the same
            _to_disk(path.absolute().parent)
    except BaseException as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        if not isinstance(error, UNWRITABLE):
            raise
        raise FileError("cannot be written", where=str(path), value=_reason(error)) from error


def _to_disk(path: Path) -> None:
    """Have the system write a file, or the names in a folder, to the disk; raise OSError."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def sealed(path: Path) -> Seal:
    """Return what the bytes at ``path`` say; raise FileError for what no HDF5 library should be shown."""
    found = judged(path)
    if found is Seal.BROKEN:
        raise _damaged(path, found.value)
    return found


def judged(path: Path) -> Seal:
    """Return what the bytes at ``path`` say; raise FileError for what is no recording, or one of a newer program."""
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
    if found is Seal.NEWER:
        marked = marked_at(path)
        raise _newer(path, f"{NAME}/{marked.version}", marked.needs) if marked else _damaged(path, found.value)
    return found


def _newer(path: Path, schema: str, needs: str) -> FileError:
    return FileError("a recording of a newer program", where=str(path), value=schema, allowed=f"up to {SCHEMA}",
                     do=f"read it with {needs} or later" if needs else "read it with the program that wrote it")


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
        raise FileError("there is a file of this name already", where=str(path),
                        do="choose another name, or replace it with --overwrite")
    if being_written(path):
        raise FileError("another program is recording into this file", where=str(path), do="choose another name")
    return path


class Writer:
    """Records one run into the file at ``path`` while it goes on; the space is reserved before anything is played."""

    def __init__(
        self, path: str | Path, plan: Plan, equipment: Equipment, u: Samples | None = None, overwrite: bool = False,
    ) -> None:
        """Create the file; ``u`` is what the DAC puts out where that is rounded from the plan's.

        Raises FileError when it cannot be made, or exists and is not to be overwritten.
        """
        self.path = _free(path, overwrite)
        begun = _begun(self.path, plan, equipment, plan.u if u is None else u)
        _put(self.path, lambda part: begin(part, begun))
        self._growing = Growing(self.path, [place(name) for name in begun.inputs()])
        self._inputs = [plan.inputs.index(name) for name in begun.inputs()]

    def append(self, start: int, y: Array, further: Array = NO_FURTHER) -> None:
        """Store ``y`` (n,), V, as the samples from index ``start`` on; those skipped since the last call are lost.

        ``further`` (inputs - 1, n) are the other inputs of the plan, in its order. Raises ValueError for samples that
        do not follow, that are no numbers, or of other inputs. On return they are acknowledged: the operating system
        has them, and whatever becomes of this program, they are in the recording.
        """
        stop, position, size = start + len(y), self._growing.position, self._growing.size
        signals = (y, *further)
        if not position <= start <= stop <= size:
            raise ValueError(f"samples {start} to {stop} do not follow {position} of {size}")
        if len(signals) != len(self._inputs):
            raise ValueError(f"{len(signals)} inputs where {len(self._inputs)} are recorded")
        if not all(np.isfinite(values).all() for values in signals):
            raise ValueError(f"a reading among samples {start} to {stop} is not a finite number")
        self._growing.append(start, [signals[at] for at in self._inputs])

    def finish(self, complete: bool, reason: str, events: Iterable[Event] = (), transcript: str = "") -> Recording:
        """Close the run and return it; ``lost`` events without samples after them are entered in the ledger.

        Where the finished file cannot be written the one that grew stays, with everything but the transcript; the
        recording then says that it is incomplete, and why. Raises FileError where not even that can be read.
        """
        words = LastWords(complete, reason, now(), tuple(events))
        with suppress(OSError):
            self._growing.speak(words)
        try:
            finished = replace(ended(read(self.path), words), transcript=transcript)
            _put(self.path, lambda part: store(part, finished))
        except FileError as error:
            why = f"{reason}; the recording could not be finished: {error.value}"
            with suppress(OSError):
                self._growing.speak(replace(words, complete=False, reason=why))
        self.close()
        return read(self.path)

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


def _begun(path: Path, plan: Plan, equipment: Equipment, u: Samples) -> Recording:
    """Return the recording of a run of which nothing was received yet."""
    origin = Origin(equipment, software(), git_commit(), started=now())
    nothing = NotRead(u.size)
    return Recording(
        name=path.stem, rate_hz=plan.rate_hz, u=u, **_by_field(dict.fromkeys(plan.inputs, nothing)),
        ledger=np.zeros(u.size, dtype=np.uint8), origin=origin, title=plan.title,
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
    text = str(error)
    quoted = re.search(r"error message = '([^']*)'", text)
    told = error.strerror if isinstance(error, OSError) else None
    return quoted[1] if quoted else (told or text).partition("\n")[0]

