"""Is a recording what was written, in every part that has a checksum, and what is wrong where it is not?

The bytes come first: what does not match there is never shown to an HDF5 library in this process, which it might bring
down. Which part was hit is then looked for in a process of its own, that may die.
"""

import json
import os
import resource
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

import h5py

from rig.errors import FileError, RefusedError
from rig.journal import JOURNAL, Journal
from rig.outputs import json_text
from rig.recorded import Entry, Recording
from rig.recording import DAMAGE, judged, read, settled, told
from rig.recordingfile import CHECKSUM, mismatches, refuse_other_schema
from rig.seal import Seal
from rig.unfinished import Unfinished
from rig.unfinished import inspect as inspect_unfinished
from rig.unvouched import check_readable

LOOK_S, LOOK_BYTES_PER_S, LOOK_BYTES, GIVEN_UP_S = 6, 1e8, 1 << 30, 60.0
"""How much of the processor's time, and of memory, it may take to look into a damaged file, and how long at all."""


@dataclass(frozen=True)
class Verified:
    """What became of one recording: ``findings`` say what is damaged, ``remarks`` what is odd without being damage.

    ``checked`` says which checksums were computed; ``recording`` is None where damage keeps it from being read.
    """

    path: Path
    checked: tuple[str, ...]
    findings: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    being_written: bool = False
    recording: Recording | None = None

    @property
    def opened(self) -> bool:
        """Return whether the bytes were such that an HDF5 library was let at them."""
        return bool(self.checked)

    @property
    def intact(self) -> bool:
        """Return whether nothing is damaged."""
        return not self.findings

    @property
    def refusal(self) -> tuple[str, str]:
        """Return what is wrong where something is, and what to do."""
        return "damaged", "use a copy, or record again"

    def to_dict(self) -> dict[str, Any]:
        """Return this as it stands in the JSON of ``rig verify``."""
        run = self.recording
        told = {"file": str(self.path), "verdict": "intact" if self.intact else "damaged",
                "findings": list(self.findings), "remarks": list(self.remarks), "checked": list(self.checked),
                "being_written": self.being_written}
        if run is None:
            return told
        samples = {entry.name.lower(): run.count(entry) for entry in Entry}
        return told | {"complete": run.complete, "reason": run.reason, "samples": samples, "rate_hz": run.rate_hz,
                       "started": run.origin.started, "finished": run.origin.finished, "title": run.title,
                       "device": run.origin.equipment.address, "software": dict(run.origin.software),
                       "git_commit": run.origin.git_commit}


def verify(path: str | Path, *, locate: bool = True) -> Verified:
    """Compute every checksum of the recording at ``path`` anew; raise FileError for what is none.

    ``locate``: where bytes are not what they were, look for the parts they belong to.
    """
    path = Path(path)
    with told(path):
        found = settled(path, lambda: _verified(path, judged(path)))
    return replace(found, findings=(*found.findings, *_looked_into(path))) if locate and not found.opened else found


class Checked(Protocol):
    """What became of one file, a recording or an answer: ``findings`` say what is wrong with it."""

    @property
    def path(self) -> Path:
        """Return where it is."""

    @property
    def intact(self) -> bool:
        """Return whether nothing is wrong."""

    @property
    def findings(self) -> tuple[str, ...]:
        """Return what is wrong, in sentences."""

    @property
    def refusal(self) -> tuple[str, str]:
        """Return in one word what a file with findings is, and what to do with it."""

    def to_dict(self) -> dict[str, Any]:
        """Return this as it stands in the JSON of ``rig verify``."""


def to_json(found: Sequence[Checked]) -> str:
    """Return the JSON of ``rig verify``."""
    verdict = "intact" if all(one.intact for one in found) else "damaged"
    return json_text({"schema": "rig.verify/1", "verdict": verdict, "files": [one.to_dict() for one in found]})


def refuse_damaged(found: Sequence[Checked]) -> None:
    """Raise RefusedError where any of these is damaged, or comes out otherwise."""
    damaged = [one for one in found if not one.intact]
    if damaged:
        what, do = damaged[0].refusal
        raise RefusedError(what, where=", ".join(str(one.path) for one in damaged), value=damaged[0].findings[0], do=do)


def _verified(path: Path, found: Seal) -> Verified:
    unfinished = None
    if found is Seal.BROKEN:
        return Verified(path, (), (found.value,))
    if found is Seal.GROWING:
        try:
            unfinished = inspect_unfinished(path)
        except ValueError as error:
            return Verified(path, (), (str(error),))
    if found is Seal.ABSENT:
        try:
            check_readable(path)
        except ValueError as error:
            return Verified(path, (), (str(error),))
    return _opened(path, found, unfinished)


def _opened(path: Path, found: Seal, unfinished: Unfinished | None) -> Verified:
    """Return what the parts of a file say that may be opened."""
    checked = {Seal.INTACT: ("all bytes",), Seal.GROWING: ("all bytes that do not grow",)}.get(found, ())
    with h5py.File(path, "r") as file:
        refuse_other_schema(file)
        findings = tuple(_wrong(file))
        parts = _parts(file)
        remarks = tuple(_odd(file, unfinished)) if not findings else ()
    busy = unfinished is not None and unfinished.being_written
    try:
        recording = None if findings else read(path)
    except FileError as error:
        recording, findings = None, (error.value or error.what,)
    if found is Seal.ABSENT:
        remarks = ("its bytes as a whole have no checksum: another program wrote the file anew", *remarks)
    return Verified(path, (*checked, *parts), findings, remarks, busy, recording)


def _parts(file: h5py.File) -> list[str]:
    """Return what has a checksum of its own."""
    found: list[str] = ["attributes"]
    file.visititems(lambda name, item: found.append(name) if CHECKSUM in item.attrs else None)
    return found + ([f"{name}, as far as it was acknowledged" for name in Journal.of(file).names]
                    if JOURNAL in file else [])


def _wrong(file: h5py.File) -> list[str]:
    """Return which parts are not what was written."""
    wrong = mismatches(file)
    if JOURNAL in file:
        journal = Journal.of(file)
        wrong += journal.harmed(file) if journal.acknowledged else []
    return wrong


def _odd(file: h5py.File, unfinished: Unfinished | None) -> list[str]:
    """Return what a program left that was killed while it wrote."""
    beyond = Journal.of(file).beyond(file) if JOURNAL in file and not (unfinished and unfinished.being_written) else 0
    odd = [f"{beyond} samples behind the last acknowledged one were being written when the program ended: left out"]
    loose = ["its last words were being written when the program ended: left out"]
    return (odd if beyond else []) + (loose if unfinished and unfinished.loose else [])


def _looked_into(path: Path) -> list[str]:
    """Return which parts of a damaged file are hit, as an HDF5 library tells in a process that may die of it."""
    program = "import sys; from rig.verifying import look; look(sys.argv[1], int(sys.argv[2]))"
    cpu_s = LOOK_S + int(path.stat().st_size / LOOK_BYTES_PER_S)
    surroundings = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        done = subprocess.run([sys.executable, "-P", "-c", program, str(path), str(cpu_s)], capture_output=True,
                              text=True, check=True, timeout=GIVEN_UP_S + cpu_s, env=surroundings)
        return list(map(str, json.loads(done.stdout)))
    except subprocess.TimeoutExpired:
        return ["which part of it is damaged was not found in time"]
    except (OSError, ValueError, subprocess.SubprocessError):
        return ["its structure is damaged: no HDF5 library can read it"]


def look(path: str, cpu_s: int) -> None:
    """Print which parts of a damaged file are hit, as JSON; die when that takes too much."""
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s))
    resource.setrlimit(resource.RLIMIT_DATA, (LOOK_BYTES, LOOK_BYTES))
    try:
        with h5py.File(path, "r") as file:
            wrong = _wrong(file)
    except DAMAGE as error:
        wrong = [f"its structure is damaged: {str(error).splitlines()[0] if str(error) else type(error).__name__}"]
    sys.stdout.write(json.dumps(wrong or ["what is damaged is none of its values: they match their checksums"]))
