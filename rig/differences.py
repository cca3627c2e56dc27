"""In what do two recordings differ that is no property of the rig: protocol, device, calibration, program?"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from identify.natural_units import shown, shown_interval
from identify.trace import Samples, blocks
from rig.calibration import Calibration, parse_calibration
from rig.recorded import Entry, Equipment, Recording
from rig.units import show

Aspect = Literal["protocol", "device", "calibration", "readings", "rig file", "program"]
NOTHING = "none"


@dataclass(frozen=True)
class Difference:
    """One thing that is not the same in both recordings, as text for whoever reads it."""

    aspect: Aspect
    what: str
    before: str
    after: str

    def to_dict(self) -> dict[str, object]:
        """Return the form of ``rig compare --json``."""
        return {"aspect": self.aspect, "what": self.what, "before": self.before, "after": self.after}


def differences(before: Recording, after: Recording) -> tuple[Difference, ...]:
    """Return all in which two recordings differ beside their readings, what may move a result first."""
    return (
        *_of_protocol(before, after), *_of_device(before.origin.equipment, after.origin.equipment),
        *_of_calibration(before, after), *_of_readings(before, after),
        *_told("rig file", {"rig file": (before.rig_text, after.rig_text)}),
        *_of_program(before, after),
    )  # fmt: skip


def _told(aspect: Aspect, pairs: Mapping[str, tuple[str, str]]) -> Iterator[Difference]:
    """Yield the pairs that differ; of texts of several lines, where they begin to."""
    for what, (one, other) in pairs.items():
        if one != other:
            yield Difference(aspect, what, *_apart(one, other))


def _apart(one: str, other: str) -> tuple[str, str]:
    """Return two texts as short as tells them apart: their first lines that differ where they have several."""
    if "\n" not in one + other:
        return one or NOTHING, other or NOTHING
    lines = one.splitlines(), other.splitlines()
    at = next((i for i, (a, b) in enumerate(zip(*lines, strict=False)) if a != b), min(map(len, lines)))
    if at == max(map(len, lines)):
        return "the same lines", "with other line ends"
    return _line(lines[0], at), _line(lines[1], at)


def _line(lines: list[str], at: int) -> str:
    """Return a line of a text, and where it stands; that it has ended before."""
    if not lines:
        return NOTHING
    return f"line {at + 1}: {lines[at].strip()}" if at < len(lines) else f"ends at line {len(lines)}"


def _of_protocol(before: Recording, after: Recording) -> Iterator[Difference]:
    """Yield what was played otherwise."""
    yield from _told("protocol", {
        "protocol": (before.protocol_text, after.protocol_text),
        "sample rate": (show(before.rate_hz, "Hz"), show(after.rate_hz, "Hz")),
        "length": (_length(before), _length(after)),
        "u between samples": (before.intersample, after.intersample),
        "rig at first": (before.initial, after.initial),
        "steps": (_steps(before), _steps(after)),
    })  # fmt: skip
    if before.u.size == after.u.size and (at := first_apart(before.u, after.u)) is not None:
        one, other = (float(signal[at : at + 1][0]) for signal in (before.u, after.u))
        yield Difference("protocol", f"u, first at sample {at}", shown(one, "V", 6), shown(other, "V", 6))


def first_apart(one: Samples, other: Samples) -> int | None:
    """Return the first sample at which two signals of one size differ, None where they are the same to the last bit.

    What was not recorded in either is the same.
    """
    for start, stop in blocks(0, one.size):
        a, b = one[start:stop], other[start:stop]
        unlike = np.flatnonzero((a != b) & ~(np.isnan(a) & np.isnan(b)))
        if unlike.size:
            return start + int(unlike[0])
    return None


def _length(recording: Recording) -> str:
    return f"{recording.u.size} samples"


def _steps(recording: Recording) -> str:
    return ", ".join(dict.fromkeys(step.label for step in recording.steps))


def _of_device(before: Equipment, after: Equipment) -> Iterator[Difference]:
    """Yield another device, and what is set otherwise."""
    for name in ("address", "model", "serial", "firmware"):
        yield from _told("device", {name: (getattr(before, name), getattr(after, name))})
    for name in sorted({*before.settings, *after.settings}):
        yield from _told("device", {name: (before.settings.get(name, ""), after.settings.get(name, ""))})


def _of_calibration(before: Recording, after: Recording) -> Iterator[Difference]:
    """Yield what the calibrations kept in the recordings say otherwise."""
    kept = [_quantities(calibration_of(recording)) for recording in (before, after)]
    for name in {**kept[0], **kept[1]}:
        yield from _told("calibration", {name: (kept[0].get(name, ""), kept[1].get(name, ""))})


def calibration_of(recording: Recording) -> Calibration | None:
    """Return the calibration kept in a recording, None where there is none; raise FileError for one that is broken."""
    text = recording.origin.equipment.calibration
    return parse_calibration(text, f"{recording.name} (its calibration)") if text else None


def _quantities(kept: Calibration | None) -> dict[str, str]:
    if kept is None:
        return {}
    told = {"delay": (kept.delay, "s"), "gain": (kept.gain, "V/V"), "offset": (kept.offset, "V")}
    return {"made": kept.made, **{name: shown_interval(value, unit) for name, (value, unit) in told.items()}}


def _of_readings(before: Recording, after: Recording) -> Iterator[Difference]:
    """Yield whether samples are missing, and which channels there are."""
    yield from _told("readings", {
        "complete": (_complete(before), _complete(after)),
        "samples not recorded": (_missing(before), _missing(after)),
        "inputs": (", ".join(before.inputs()), ", ".join(after.inputs())),
    })  # fmt: skip


def _complete(recording: Recording) -> str:
    return "yes" if recording.complete else f"no: {recording.reason}"


def _missing(recording: Recording) -> str:
    return str(recording.u.size - recording.count(Entry.RECORDED))


def _of_program(before: Recording, after: Recording) -> Iterator[Difference]:
    """Yield which program recorded."""
    one, other = before.origin, after.origin
    for name in sorted({*one.software, *other.software}):
        yield from _told("program", {name: (one.software.get(name, ""), other.software.get(name, ""))})
    yield from _told("program", {"git commit": (one.git_commit, other.git_commit)})
