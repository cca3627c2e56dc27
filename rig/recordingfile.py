"""Where in an HDF5 file does each part of a recording stand, and is it still what was written?"""

import hashlib
import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from identify.trace import LONG, Samples, Step, Stored, blocks
from rig.contained import check_contained
from rig.hdf5values import plain, rows_of, table
from rig.journal import JOURNAL, PAGE, HarmedError, Journal, add_journal
from rig.recorded import Entry, Equipment, Event, Ledger, Origin, Recording
from rig.samples import InFile, NotRead, Received
from rig.seal import NAME, NEEDS, SCHEMA, SIZE, VERSION, seal
from rig.unfinished import BLOCK, mark

SIGNALS = {"u": "output as commanded", "u_measured": "output as measured", "y": "input as recorded"}
ENTRIES = "one entry for every sample: " + ", ".join(f"{entry.value} {entry.name.lower()}" for entry in Entry)
FURTHER = "inputs"
LEDGER = "ledger"
ROOT = ("title", "question", "rate_hz", "start_s", "intersample", "initial", "complete", "reason")
CLOCK = ("started", "finished", "git_commit")
IDENTITY = ("address", "model", "serial", "firmware")
GROUPS = ("/", "device", "device/settings", "software")
STEPS = {"label": str, "kind": str, "start": int, "stop": int, "repeat": int}
EVENTS = {"kind": str, "text": str, "start": int, "stop": int}
CHECKSUM = "sha256"
PACKED_BYTES = 1 << 27  # of a signal that stands in pieces and is put together in memory
AT_ONCE = LONG  # samples; a longer signal stays in the file and is read by stretches


class ForeignError(ValueError):
    """The file is HDF5 and no recording; the message says what it calls itself."""


class NewerError(ValueError):
    """The file is a recording of a later schema: its name, and the program it needs."""


def store(path: Path, recording: Recording) -> None:
    """Write all of ``recording``, with a checksum on every part and on the whole. Raises OSError."""
    with h5py.File(path, "w", userblock_size=SIZE) as file:
        _fill(file, recording)
    seal(path)


def begin(path: Path, recording: Recording) -> None:
    """Write a recording of which nothing was received yet, with room for all that will be. Raises OSError."""
    grows = [*map(place, recording.inputs()), LEDGER]
    with h5py.File(path, "w", userblock_size=BLOCK, alignment_threshold=PAGE // 2, alignment_interval=PAGE) as file:
        _fill(file, recording, grows)
        add_journal(file, recording.u.size, grows)
    with h5py.File(path, "r") as file:
        mark(path, {name: (_offset(file[name]), int(file[name].nbytes)) for name in (*grows, JOURNAL)})


def _offset(dataset: h5py.Dataset) -> int:
    """Return where a dataset begins in its file; raise ValueError when it is not in one piece."""
    offset = dataset.id.get_offset()
    if offset is None:
        raise ValueError(f"{dataset.name} is not in one piece")
    return int(offset)


def _fill(file: h5py.File, recording: Recording, unsealed: Collection[str] = ()) -> None:
    """Put all of ``recording`` into an empty file, a checksum on every part but the ``unsealed``."""
    for name, (values, notes) in _datasets(recording).items():
        dataset = _filled(file, name, values)
        dataset.attrs.update(notes)
        if name not in unsealed:
            dataset.attrs[CHECKSUM] = digest(dataset)
    for name, attributes in _attributes(recording).items():
        file.require_group(name).attrs.update(attributes)
    file.attrs[CHECKSUM] = attributes_digest(file)


def _filled(file: h5py.File, name: str, values: Any) -> h5py.Dataset:
    """Return a new dataset that holds ``values``; a signal that is in another file is copied by stretches."""
    if not isinstance(values, Stored):
        return file.create_dataset(name, data=values)
    dataset = file.create_dataset(name, values.size, np.float64)
    for start, stop in blocks(0, values.size):
        dataset[start:stop] = values[start:stop]
    return dataset


def load(file: h5py.File, name: str, *, intact: bool, live: bool = False) -> Recording:
    """Return the recording in ``file``, every checksum compared unless the whole file is known to be ``intact``.

    Of a run that is not finished it is what was acknowledged, which is always compared; ``live``: it goes on meanwhile.
    Raises ForeignError for another kind of file; KeyError, ValueError, OSError and their like for a damaged one.
    """
    refuse_other_schema(file)
    check_contained(file)
    _check_kinds(file)
    wrong = () if intact else mismatches(file)
    position = _acknowledged(file) if JOURNAL in file else None
    if wrong:
        raise ValueError(wrong[0])
    inputs = {name: _signal(dataset, position, live) for name, dataset in _inputs(file).items()}
    return _recording(file, name, inputs, _ledger(file, position), looked_at=intact and position is None)


def begun(file: h5py.File, name: str) -> Recording:
    """Return the recording in ``file`` as it was when its run began: nothing received, and nothing compared.

    However long it is, no sample is read, but those of u where they are few. Raises what ``load`` raises.
    """
    refuse_other_schema(file)
    check_contained(file)
    _check_kinds(file)
    inputs: dict[str, Samples] = {name: NotRead(dataset.size) for name, dataset in _inputs(file).items()}
    ledger = np.broadcast_to(np.uint8(Entry.NOT_RECEIVED), file[LEDGER].shape)
    return _recording(file, name, inputs, ledger, looked_at=True)


def _inputs(file: h5py.File) -> dict[str, h5py.Dataset]:
    """Return the datasets of what was received, by the name of the input, y first."""
    own = {name: file[name] for name in ("y", "u_measured") if name in file}
    return {**own, **dict(file.get(FURTHER, {}))}


def _recording(
    file: h5py.File, name: str, inputs: Mapping[str, Samples], ledger: Ledger, looked_at: bool,
) -> Recording:  # fmt: skip
    """Return the recording in ``file`` with these inputs and this ledger."""
    root, device = plain(file.attrs), plain(file["device"].attrs)
    equipment = Equipment(settings=plain(file["device/settings"].attrs), calibration=_text(file, "calibration"),
                          **{key: device[key] for key in IDENTITY})
    origin = Origin(equipment, software=plain(file["software"].attrs), **{key: root[key] for key in CLOCK})
    return Recording(
        name=name, u=_signal(file["u"]), y=inputs["y"], ledger=ledger, u_measured=inputs.get("u_measured"),
        further={key: values for key, values in inputs.items() if key not in SIGNALS},
        protocol_text=file["protocol"].asstr()[()], rig_text=file["rig"].asstr()[()],
        transcript=_text(file, "transcript"), origin=origin, steps=tuple(Step(*row) for row in rows_of(file["steps"])),
        events=tuple(Event(*row) for row in rows_of(file["events"])), looked_at=looked_at,
        **{key: root[key] for key in ROOT},
    )


def refuse_other_schema(file: h5py.File) -> None:
    """Raise NewerError for a schema this program does not know yet, ForeignError for what is none of ours."""
    root = plain(file.attrs)
    schema = str(root.get("schema", "no schema"))
    name, _, version = schema.partition("/")
    if name == NAME and version.isdecimal() and int(version) > VERSION:
        raise NewerError(schema, str(root.get("needs", "")))
    if schema != SCHEMA:
        raise ForeignError(schema)


def _acknowledged(file: h5py.File) -> int:
    """Return how many samples the journal of a run that is not finished accounts for; raise ValueError."""
    journal = Journal.of(file)
    position = journal.acknowledged
    if harmed := journal.harmed(file):
        raise HarmedError(harmed[0])
    return position


def _text(file: h5py.File, name: str) -> str:
    """Return a text that not every recording has."""
    return str(file[name].asstr()[()]) if name in file else ""


def _ledger(file: h5py.File, position: int | None) -> Ledger:
    """Return the ledger, nothing being received from ``position`` on."""
    entries: Ledger = file[LEDGER][:]
    if position is not None:
        entries[position:] = Entry.NOT_RECEIVED
    return entries


def _signal(dataset: h5py.Dataset, position: int | None = None, live: bool = False) -> Samples:
    """Return a signal: in memory unless it is long and stands in the file as it would stand in memory.

    From ``position`` on nothing was received. A signal that is ``live`` may grow while it is used.
    """
    stored = InFile.of(dataset, grows=live) if dataset.size > AT_ONCE else None
    if stored is not None:
        return stored if position is None else Received(dataset.size, stored, position)
    values: Samples = dataset[:]
    if position is not None:
        values[position:] = np.nan  # type: ignore[index]
    return values


def _check_kinds(file: h5py.File) -> None:
    """Raise ValueError for signals that are no real numbers, a ledger that is no bytes, and what is packed and huge."""
    names = ("u", "y", "u_measured", LEDGER, *(f"{FURTHER}/{key}" for key in file.get(FURTHER, ())))
    for dataset in (file[name] for name in names if name in file):
        kind = dataset.dtype
        if kind != np.uint8 if dataset.name == f"/{LEDGER}" else kind.kind != "f":
            raise ValueError(f"{dataset.name} holds {kind}")
        if dataset.nbytes > PACKED_BYTES and dataset.id.get_offset() is None:
            raise ValueError(f"{dataset.name} is packed, and too large for that; 'h5repack -l CONTI' unpacks it")


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
    held = {name: {key: value for key, value in plain(file[name].attrs).items() if key != CHECKSUM} for name in GROUPS}
    return hashlib.sha256(json.dumps(held, sort_keys=True).encode()).hexdigest()


def _datasets(recording: Recording) -> dict[str, tuple[Any, dict[str, str]]]:
    """Return every dataset by name: its values and its attributes."""
    signals = {"u": recording.u} | recording.inputs()
    return {
        **{place(name): (values, {"unit": "V", "description": SIGNALS.get(name, "a further input as recorded")})
           for name, values in signals.items()},
        "ledger": (recording.ledger, {"description": ENTRIES}),
        "steps": (table(recording.steps, STEPS), {"description": "samples [start, stop) of every stimulus"}),
        "events": (table(recording.events, EVENTS), {"description": "what happened at samples [start, stop)"}),
        "protocol": (recording.protocol_text, {"description": "the protocol file"}),
        "rig": (recording.rig_text, {"description": "the rig file"}),
        **_texts_of_some(recording),
    }


def _texts_of_some(recording: Recording) -> dict[str, tuple[Any, dict[str, str]]]:
    """Return the texts that not every recording has."""
    told = {"calibration": (recording.origin.equipment.calibration, {"description": "the device over a cable"}),
            "transcript": (recording.transcript, {"description": "what crossed the wire to the device and from it"})}
    return {name: text for name, text in told.items() if text[0]}


def _attributes(recording: Recording) -> dict[str, dict[str, Any]]:
    """Return what stands in attributes, by group; a name ends in its unit."""
    origin, device = recording.origin, recording.origin.equipment
    root = {key: getattr(recording, key) for key in ROOT} | {key: getattr(origin, key) for key in CLOCK}
    identity = {key: getattr(device, key) for key in IDENTITY}
    held = ({"schema": SCHEMA, "needs": NEEDS} | root, identity, dict(device.settings), dict(origin.software))
    return dict(zip(GROUPS, held, strict=True))


def place(name: str) -> str:
    """Return where in the file the signal ``name`` stands: the further inputs have a group of their own."""
    return name if name in SIGNALS else f"{FURTHER}/{name}"


def mismatches(file: h5py.File) -> list[str]:
    """Return which parts do not match their checksum or have none, a sentence each.

    What grew in a file that was not finished has none.
    """
    wrong = []
    if attributes_digest(file) != file.attrs.get(CHECKSUM):
        wrong.append("the attributes do not match their checksum")
    for name, dataset in _held(file).items():
        told = dataset.attrs.get(CHECKSUM)
        if told is None and (file.attrs["finished"] or not _grows(name)):
            wrong.append(f"the dataset {name!r} has no checksum")
        if told is not None and digest(dataset) != told:
            wrong.append(f"the dataset {name!r} does not match its checksum")
    return wrong


def _grows(name: str) -> bool:
    return name in ("y", "u_measured", LEDGER, JOURNAL) or name.startswith(f"{FURTHER}/")


def _held(file: h5py.File) -> dict[str, h5py.Dataset]:
    """Return all datasets by name."""
    found: dict[str, h5py.Dataset] = {}
    file.visititems(lambda name, item: found.update({name: item} if isinstance(item, h5py.Dataset) else {}))
    return found
