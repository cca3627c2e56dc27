"""What is known of one run: the samples, which of them are there, what was asked for, and who recorded it?"""

from collections.abc import Mapping
from dataclasses import InitVar, dataclass, field
from enum import IntEnum
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from identify.natural_units import shown
from identify.notebook.glance import Glance, Seen
from identify.trace import Intersample, Mask, Samples, Step, Stored, Trace, blocks, frozen, part
from rig.errors import FileError
from rig.samples import Bridged
from rig.units import quantity

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Ledger = NDArray[np.uint8]
Initial = Literal["rest", "in_motion"]


RATES_HZ = (1e-6, 1e12)
LOOKED_AT = 1 << 18
"""Samples looked at together, whether they are numbers: few enough for the processor's cache."""
VOLTAGES = ("output_low", "output_high", "input_low", "input_high")
"""Settings that hold the ranges of a device, as quantities."""


class Entry(IntEnum):
    """What the ledger says of one sample of y."""

    NOT_RECEIVED = 0
    RECORDED = 1
    LOST = 2


@dataclass(frozen=True)
class Event:
    """Something that happened in a run: samples [start, stop) it concerns, equal when it is a moment."""

    kind: str
    text: str
    start: int
    stop: int


@dataclass(frozen=True)
class Equipment:
    """The device a run was recorded with, as it said itself, its settings as read back, and the calibration it had."""

    address: str
    model: str = ""
    serial: str = ""
    firmware: str = ""
    settings: Mapping[str, str] = field(default_factory=dict)
    calibration: str = ""

    @property
    def ranges_v(self) -> tuple[float, ...] | None:
        """Return both ends of the output's range and of the inputs', V; None where the settings do not have them."""
        told = [self.settings.get(name) for name in VOLTAGES]
        return None if None in told else tuple(quantity(volts, "V") for volts in told)


@dataclass(frozen=True)
class Origin:
    """Where a recording comes from: device, program versions, the source's commit, the host's clock in UTC.

    ``finished`` is empty while a run is being recorded, and for ever when the program was killed in it.
    """

    equipment: Equipment
    software: Mapping[str, str] = field(default_factory=dict)
    git_commit: str = ""
    started: str = ""
    finished: str = ""

    def check(self) -> None:
        """Raise ValueError for words that are no text, and ranges that are none."""
        of, words = self.equipment, (self.git_commit, self.started, self.finished)
        told = (*words, of.address, of.model, of.serial, of.firmware, of.calibration, *of.settings.values(),
                *self.software.values())
        if not all(isinstance(text, str) for text in told):
            raise ValueError("something else where a text on the device or the program should stand")
        if of.ranges_v is not None and not all(low < high for low, high in (of.ranges_v[:2], of.ranges_v[2:])):
            raise ValueError(f"ranges of {of.ranges_v} V")


@dataclass(frozen=True, repr=False)
class Recording(Seen):
    """One run. ``u`` is what the output was told, ``u_measured`` an input that read it back; V, shape (N,) as ``y``.

    ``further`` are the other inputs by name. All inputs are read at start_s + k / rate_hz, just before u[k] acts.
    ``ledger`` (N,) holds an ``Entry`` for every sample of them, which are NaN where nothing was recorded. ``initial``
    says whether the rig was at rest before the first sample. ``transcript`` is what crossed the wire to the device,
    where that was asked for (``rig/transcript.py``). ``looked_at``: that all samples are numbers is known, because a
    checksum says that they are those that were written.
    """

    name: str
    rate_hz: float
    u: Samples
    y: Samples
    ledger: Ledger
    origin: Origin
    u_measured: Samples | None = None
    further: Mapping[str, Samples] = field(default_factory=dict)
    intersample: Intersample = "held"
    start_s: float = 0.0
    initial: Initial = "rest"
    title: str = ""
    question: str = ""
    protocol_text: str = ""
    rig_text: str = ""
    transcript: str = ""
    complete: bool = True
    reason: str = ""
    steps: tuple[Step, ...] = ()
    events: tuple[Event, ...] = field(default=())
    looked_at: InitVar[bool] = False

    def __post_init__(self, looked_at: bool) -> None:
        """Freeze the arrays; raise ValueError for what cannot be a recording."""
        measured = None if self.u_measured is None else frozen(self.u_measured)
        further = MappingProxyType({key: frozen(values) for key, values in self.further.items()})
        signals = {"u": frozen(self.u), "y": frozen(self.y), "u_measured": measured, "further": further}
        for key, value in signals.items():
            object.__setattr__(self, key, value)
        ledger = np.asarray(self.ledger, dtype=np.uint8).view()
        ledger.flags.writeable = False
        object.__setattr__(self, "ledger", ledger)
        sizes = {key: values.size for key, values in ({"u": self.u, "ledger": ledger} | self.inputs()).items()}
        if len(set(sizes.values())) > 1 or self.u.size == 0:
            raise ValueError(f"signals of {sizes} samples; all must be equal and above 0")
        self._check_facts()
        if not looked_at and not all(self._is_finite(slice(*ab)) for ab in blocks(0, self.u.size, LOOKED_AT)):
            raise ValueError("a recorded sample is not a finite number")

    def _check_facts(self) -> None:
        """Raise ValueError for what nobody can have recorded: a file may say anything."""
        low_hz, high_hz = RATES_HZ
        if not (isinstance(self.rate_hz, float | int) and low_hz <= self.rate_hz <= high_hz):
            raise ValueError(f"sample rate of {self.rate_hz} Hz; it must be above 0 Hz, {low_hz:g} to {high_hz:g} Hz")
        if not (isinstance(self.start_s, float | int) and np.isfinite(self.start_s)):
            raise ValueError(f"a start at {self.start_s} s; it must be a finite time")
        if self.intersample not in get_args(Intersample) or self.initial not in get_args(Initial):
            raise ValueError(f"intersample {self.intersample!r} and initial {self.initial!r}; not what they can be")
        if not isinstance(self.complete, bool) or not all(isinstance(text, str) for text in self._texts()):
            raise ValueError("something else where a text, or whether the run is complete, should stand")
        for step in self.steps:
            if not 0 <= step.start <= step.stop <= self.u.size:
                raise ValueError(f"a step at samples {step.start} to {step.stop} of {self.u.size}")
        self.origin.check()

    def _texts(self) -> tuple[str, ...]:
        return (self.title, self.question, self.protocol_text, self.rig_text, self.transcript, self.reason)

    def _is_finite(self, at: slice) -> bool:
        """Return whether u, and the inputs where they were recorded, are numbers."""
        lost = self.ledger[at] != Entry.RECORDED
        somewhere = bool(lost.any())
        read = (signal[at] for signal in self.inputs().values())
        return bool(np.isfinite(self.u[at]).all()) and all(
            bool((np.isfinite(values) | lost).all() if somewhere else np.isfinite(values).all()) for values in read)

    def inputs(self) -> dict[str, Samples]:
        """Return what the inputs read, by name, y first."""
        measured = {} if self.u_measured is None else {"u_measured": self.u_measured}
        return {"y": self.y, **measured, **self.further}

    def count(self, entry: Entry) -> int:
        """Return how many samples the ledger has under ``entry``; over all entries they add up to N."""
        return int(np.count_nonzero(self.ledger == entry))

    def glance(self) -> Glance:
        """Return what was played on what and when, and whether all of it is there."""
        size, lost = self.u.size, self.u.size - self.count(Entry.RECORDED)
        length = f"{size} samples at {shown(self.rate_hz, 'Hz')}, {shown(size / self.rate_hz, 's')}"
        whole = "complete" if self.complete else f"INCOMPLETE: {self.reason}"
        of = self.origin.equipment
        rows = {
            "question": self.question, "device": " ".join(filter(None, (of.address, of.model, of.serial))),
            "started": self.origin.started, "missing": f"{lost} samples" if lost else "",
            "inputs": ", ".join(self.inputs()),
        }  # fmt: skip
        shown_rows = tuple((name, value) for name, value in rows.items() if value)
        steps = tuple(("step", f"{step.label}, {step.stop - step.start} samples") for step in self.steps)
        return Glance("Recording", f"{self.name} ({self.title}), {length}, {whole}", (*shown_rows, *steps))

    def plot(self) -> "list[Axes]":
        """Draw u and all inputs over time on axes of pyplot, missing samples hatched; return the axes."""
        from identify.notebook.plots import signals

        title = self.name if self.complete else f"{self.name}: incomplete, {self.reason}"
        recorded = self.ledger == Entry.RECORDED
        return signals(title, self.rate_hz, {"u": self.u, **self.inputs()}, recorded, self.start_s)

    def trace(self) -> Trace:
        """Return what identification sees: up to the last sample recorded, lost ones bridged and marked not valid.

        Raises FileError when nothing was recorded.
        """
        recorded = self.ledger == Entry.RECORDED
        if not recorded.any():
            raise FileError("no sample was recorded", where=self.name, value=self.reason or None, do="record it again")
        size = recorded.size - int(np.argmax(recorded[::-1]))
        valid = None if recorded[:size].all() else recorded[:size]
        return Trace(
            name=self.name, rate_hz=self.rate_hz, u=part(self.u, 0, size), y=self._bridged(size, valid),
            intersample=self.intersample, start_s=self.start_s, steps=self._steps_until(size), valid=valid,
            from_rest=self.initial == "rest",
        )

    def _bridged(self, size: int, valid: Mask | None) -> Samples:
        """Return the readings up to ``size``; in memory where the recording is."""
        if valid is None:
            return part(self.y, 0, size)
        bridged = Bridged.over(self.y, valid)
        return bridged if isinstance(self.y, Stored) else bridged[:]

    def _steps_until(self, size: int) -> tuple[Step, ...]:
        """Return the steps that began before ``size``, the last one ending there."""
        return tuple(Step(step.label, step.kind, step.start, min(step.stop, size), step.repeat)
                     for step in self.steps if step.start < size)


def complete_ledger(size: int) -> Ledger:
    """Return the ledger of ``size`` samples that are all there."""
    return np.full(size, Entry.RECORDED, dtype=np.uint8)
