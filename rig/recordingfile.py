"""Where in an HDF5 file does each part of a recording stand, and is it still what was written?"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from identify.trace import LONG, Samples, Step, Stored, blocks
from rig.recorded import Entry, Equipment, Event, Origin, Recording
from rig.samples import InFile
from rig.seal import SCHEMA, SIZE, seal

SIGNALS = {"u": "output as commanded", "u_measured": "output as measured", "y": "input as recorded"}
LEDGER = "one entry for every sample: " + ", ".join(f"{entry.value} {entry.name.lower()}" for entry in Entry)
FURTHER = "inputs"
GROWING = ("y", "u_measured", "ledger")
ROOT = ("title", "question", "rate_hz", "start_s", "intersample", "initial", "complete", "reason")
CLOCK = ("started", "finished", "git_commit")
IDENTITY = ("address", "model", "serial", "firmware")
GROUPS = ("/", "device", "device/settings", "software")
STEPS = {"label": str, "kind": str, "start": int, "stop": int, "repeat": int}
EVENTS = {"kind": str, "text": str, "start": int, "stop": int}
CHECKSUM = "sha256"
AT_ONCE = LONG  # samples; a longer signal stays in the file and is read by stretches

Columns = Mapping[str, type]


class ForeignError(ValueError):
    """The file is HDF5 and no recording; the message says what it calls itself."""


def store(path: Path, recording: Recording) -> None:
    """Write all of ``recording``; what still grows in one that is not finished gets no checksum. Raises OSError."""
    unsealed = () if recording.origin.finished else (*GROWING, *map(place, recording.further))
    with h5py.File(path, "w", userblock_size=SIZE) as file:
        for name, (values, notes) in _datasets(recording).items():
            dataset = _filled(file, name, values)
            dataset.attrs.update(notes)
            if name not in unsealed:
                dataset.attrs[CHECKSUM] = digest(dataset)
        for name, attributes in _attributes(recording).items():
            file.require_group(name).attrs.update(attributes)
        file.attrs[CHECKSUM] = attributes_digest(file)
    seal(path, finished=bool(recording.origin.finished))


def _filled(file: h5py.File, name: str, values: Any) -> h5py.Dataset:
    """Return a new dataset that holds ``values``; a signal that is in another file is copied by stretches."""
    if not isinstance(values, Stored):
        return file.create_dataset(name, data=values)
    dataset = file.create_dataset(name, values.size, np.float64)
    for start, stop in blocks(0, values.size):
        dataset[start:stop] = values[start:stop]
    return dataset


def load(file: h5py.File, name: str, *, intact: bool) -> Recording:
    """Return the recording in ``file``, every checksum compared unless the whole file is known to be ``intact``.

    Raises ForeignError for another kind of file; KeyError, ValueError, OSError and their like for a damaged one.
    """
    root = _plain(file.attrs)
    if root.get("schema") != SCHEMA:
        raise ForeignError(str(root.get("schema", "no schema")))
    if not intact:
        _compare_digests(file, finished=bool(root["finished"]))
    device = _plain(file["device"].attrs)
    calibration = file["calibration"].asstr()[()] if "calibration" in file else ""
    settings = _plain(file["device/settings"].attrs)
    equipment = Equipment(settings=settings, calibration=calibration, **{key: device[key] for key in IDENTITY})
    origin = Origin(equipment, software=_plain(file["software"].attrs), **{key: root[key] for key in CLOCK})
    return Recording(
        name=name, u=_signal(file["u"]), y=_signal(file["y"]), ledger=file["ledger"][:], origin=origin,
        u_measured=_signal(file["u_measured"]) if "u_measured" in file else None,
        further={name: _signal(dataset) for name, dataset in file.get(FURTHER, {}).items()},
        protocol_text=file["protocol"].asstr()[()], rig_text=file["rig"].asstr()[()],
        steps=tuple(Step(*row) for row in _rows(file["steps"])),
        events=tuple(Event(*row) for row in _rows(file["events"])), **{key: root[key] for key in ROOT},
    )


def _signal(dataset: h5py.Dataset) -> Samples:
    """Return a signal: in memory unless it is long and stands in the file as it would stand in memory."""
    stored = InFile.of(dataset) if dataset.size > AT_ONCE else None
    return dataset[:] if stored is None else stored


def digest(dataset: h5py.Dataset) -> str:
    """Return the SHA-256 of what the dataset holds: its bytes as stored, or its text in UTF-8."""
    if dataset.shape == ():
        held = dataset[()]
        return hashlib.sha256(held if isinstance(held, bytes) else held.tobytes()).hexdigest()
    found = hashlib.sha256()
    for start, stop in blocks(0, dataset.shape[0]):
        found.update(dataset[start:stop].tobytes())
    return found.hexdigest()


def attributes_digest(file: h5py.File) -> str:
    """Return the SHA-256 of all attributes of the file but this one and those of datasets, as sorted JSON."""
    held = {name: {key: value for key, value in _plain(file[name].attrs).items() if key != CHECKSUM} for name in GROUPS}
    return hashlib.sha256(json.dumps(held, sort_keys=True).encode()).hexdigest()


def _datasets(recording: Recording) -> dict[str, tuple[Any, dict[str, str]]]:
    """Return every dataset by name: its values and its attributes."""
    signals = {"u": recording.u} | recording.inputs()
    return {
        **{place(name): (values, {"unit": "V", "description": SIGNALS.get(name, "a further input as recorded")})
           for name, values in signals.items()},
        "ledger": (recording.ledger, {"description": LEDGER}),
        "steps": (_table(recording.steps, STEPS), {"description": "samples [start, stop) of every stimulus"}),
        "events": (_table(recording.events, EVENTS), {"description": "what happened at samples [start, stop)"}),
        "protocol": (recording.protocol_text, {"description": "the protocol file"}),
        "rig": (recording.rig_text, {"description": "the rig file"}),
        **_calibration(recording.origin.equipment),
    }


def _calibration(device: Equipment) -> dict[str, tuple[Any, dict[str, str]]]:
    """Return the dataset of the device's calibration, where it had one."""
    told = {"calibration": (device.calibration, {"description": "the device over a cable"})}
    return told if device.calibration else {}


def _attributes(recording: Recording) -> dict[str, dict[str, Any]]:
    """Return what stands in attributes, by group; a name ends in its unit."""
    origin, device = recording.origin, recording.origin.equipment
    root = {key: getattr(recording, key) for key in ROOT} | {key: getattr(origin, key) for key in CLOCK}
    identity = {key: getattr(device, key) for key in IDENTITY}
    held = ({"schema": SCHEMA} | root, identity, dict(device.settings), dict(origin.software))
    return dict(zip(GROUPS, held, strict=True))


def place(name: str) -> str:
    """Return where in the file the signal ``name`` stands: the further inputs have a group of their own."""
    return name if name in SIGNALS else f"{FURTHER}/{name}"


def _compare_digests(file: h5py.File, *, finished: bool) -> None:
    """Raise ValueError naming the first part whose checksum does not match, KeyError where there is none.

    What grew in a file that was not ``finished`` has none.
    """
    if attributes_digest(file) != file.attrs[CHECKSUM]:
        raise ValueError("the attributes do not match their checksum")
    for name, dataset in _held(file).items():
        grew = not finished and (name in GROWING or name.startswith(f"{FURTHER}/"))
        if not grew and digest(dataset) != dataset.attrs[CHECKSUM]:
            raise ValueError(f"the dataset {name!r} does not match its checksum")


def _held(file: h5py.File) -> dict[str, h5py.Dataset]:
    """Return all datasets by name."""
    found: dict[str, h5py.Dataset] = {}
    file.visititems(lambda name, item: found.update({name: item} if isinstance(item, h5py.Dataset) else {}))
    return found


def _plain(attributes: Mapping[str, Any]) -> dict[str, Any]:
    """Return attributes as plain Python values."""
    return {key: value.item() if isinstance(value, np.generic) else value for key, value in attributes.items()}


def _table(rows: Sequence[object], columns: Columns) -> NDArray[np.void]:
    """Return rows as a table; its text has a fixed length in UTF-8 bytes, which every HDF5 reader knows."""
    values = [tuple(getattr(row, key).encode() if kind is str else getattr(row, key) for key, kind in columns.items())
              for row in rows]
    types = [(key, h5py.string_dtype("utf-8", _longest(values, at)) if kind is str else np.dtype(np.int64))
             for at, (key, kind) in enumerate(columns.items())]
    return np.array(values, dtype=np.dtype(types))


def _longest(values: Sequence[tuple[Any, ...]], column: int) -> int:
    return max((len(row[column]) for row in values), default=0) or 1


def _rows(table: h5py.Dataset) -> list[tuple[Any, ...]]:
    """Return the rows of a table as plain values."""
    return [tuple(cell.decode() if isinstance(cell, bytes) else int(cell) for cell in row) for row in table[:].tolist()]
