"""What must an exported file say besides its numbers, so that the recording can be had back from it, bit for bit?

A note in JSON: everything of the recording that is no signal, the SHA-256 of every signal and one of the note itself.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from identify.trace import Array, Samples, Step, blocks
from rig.errors import FileError
from rig.readers import Table, Wanted
from rig.recorded import Equipment, Event, Ledger, Origin, Recording
from rig.spool import spooled

SCHEMA = "rig.export/1"
SIGNALS = ("u", "y", "u_measured", "further", "ledger")
FURTHER = "inputs_"
"""Opens the names of further inputs in an exported file."""
TIME = "t"


def signals_of(recording: Recording) -> dict[str, Samples]:
    """Return the signals of a recording by their names in an exported file, V."""
    inputs = recording.inputs()
    return {"u": recording.u} | {FURTHER + name if name in recording.further else name: inputs[name] for name in inputs}


def note_of(recording: Recording) -> str:
    """Return the note, ASCII and in one line."""
    told = {key: value for key, value in _plain(recording).items() if key not in SIGNALS}
    arrays: dict[str, Samples | Ledger] = {**signals_of(recording), "ledger": recording.ledger}
    note = {"schema": SCHEMA, "recording": told, "sha256": {name: digest(held) for name, held in arrays.items()}}
    return json.dumps(note | {"sha256_of_note": _digest_of(note)})


def restored(table: Table, path: Path, folder: Path | None = None) -> Recording:
    """Return the recording a table was exported from; raise FileError when a value was changed since, or is missing.

    Its name is that of the file. Long signals stand in ``folder``.
    """
    note = _read_note(table)
    names = list(note["sha256"])
    timed = [TIME] if any(heading.name == TIME for heading in table.headings) else []
    wanted = [Wanted(name, "", "anything") for name in [*names, *timed]]
    found = dict(zip([*names, *timed], spooled(table.stretches(wanted), len(wanted), folder), strict=True))
    ledger = _ledger(table, found.pop("ledger"))
    times = found.pop(TIME, None)
    for name, held in {**found, "ledger": ledger}.items():
        if digest(held) != note["sha256"][name]:
            raise _changed(table, f"the values of {name}")
    try:
        recording = replace(_recording(note["recording"], found, ledger), name=path.stem)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise _changed(table, "the note of the recording") from error
    if times is not None:
        _check_times(table, recording, times)
    return recording


def digest(held: Samples | Ledger) -> str:
    """Return the SHA-256 of the values of a signal as they stand in memory, little-endian."""
    found = hashlib.sha256()
    for start, stop in blocks(0, held.size):
        values = held[start:stop]
        found.update(values.astype(values.dtype.newbyteorder("<"), copy=False).tobytes())
    return found.hexdigest()


def times_of(recording: Recording, start: int, stop: int) -> Array:
    """Return the times of the samples [start, stop), s."""
    return np.asarray(recording.start_s + np.arange(start, stop) / recording.rate_hz)


def _plain(value: Any) -> Any:
    """Return a value as JSON has it; a dataclass by its fields, without the samples of a recording."""
    if is_dataclass(value):
        kept = [field.name for field in fields(value) if field.name not in SIGNALS or not isinstance(value, Recording)]
        return {name: _plain(getattr(value, name)) for name in kept}
    if isinstance(value, Mapping):
        return {key: _plain(held) for key, held in value.items()}
    return [_plain(held) for held in value] if isinstance(value, tuple | list) else value


def _digest_of(note: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(note, sort_keys=True).encode()).hexdigest()


def _read_note(table: Table) -> dict[str, Any]:
    """Return the note of a table; raise FileError for one of a newer program, or one that was changed."""
    try:
        note = json.loads(table.note)
        schema, told = note["schema"], note.pop("sha256_of_note")
    except (ValueError, TypeError, KeyError, RecursionError) as error:
        raise _changed(table, "the note of the recording") from error
    if schema != SCHEMA:
        raise FileError("exported by another version of this program", where=table.where, value=str(schema)[:80],
                        allowed=SCHEMA, do="import it with the version that wrote it")
    if _digest_of(note) != told:
        raise _changed(table, "the note of the recording")
    if not isinstance(note.get("sha256"), dict) or not {"u", "y", "ledger"} <= note["sha256"].keys():
        raise _changed(table, "the note of the recording")
    return dict(note)


def _recording(told: dict[str, Any], signals: dict[str, Samples], ledger: Ledger) -> Recording:
    origin = told.pop("origin")
    equipment = Equipment(**origin.pop("equipment"))
    further = {name.removeprefix(FURTHER): held for name, held in signals.items() if name.startswith(FURTHER)}
    steps = tuple(Step(**row) for row in told.pop("steps"))
    events = tuple(Event(**row) for row in told.pop("events"))
    return Recording(
        u=signals["u"], y=signals["y"], u_measured=signals.get("u_measured"), further=further, ledger=ledger,
        origin=Origin(equipment, **origin), steps=steps, events=events, **told,
    )


def _ledger(table: Table, held: Samples) -> Ledger:
    """Return the ledger out of its numbers; raise FileError for one that no ledger has."""
    ledger = np.empty(held.size, dtype=np.uint8)
    for start, stop in blocks(0, held.size):
        values = held[start:stop]
        if not ((values >= 0.0) & (values <= 255.0) & (values == np.rint(values))).all():
            raise _changed(table, "the values of ledger")
        ledger[start:stop] = values
    return ledger


def _check_times(table: Table, recording: Recording, times: Samples) -> None:
    """Raise FileError when the column of times is not the one that was written."""
    for start, stop in blocks(0, times.size):
        if not np.array_equal(times[start:stop], times_of(recording, start, stop)):
            raise _changed(table, "the times")


def _changed(table: Table, what: str) -> FileError:
    return FileError("changed since it was exported", where=table.where, value=what,
                     do="export it again, or bring it in as another program's table with --input and --output")
