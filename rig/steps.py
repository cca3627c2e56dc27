"""What can a step of a protocol ask for, and which samples does it mean?

One form per stimulus. A form knows its keys, draws its samples in a ``Setting``, and says where the samples are not
quite what was asked for. A new stimulus is one more form and its entry in ``STIMULI``.
"""

from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, Tag, model_validator

from rig import stimuli
from rig.errors import MisfitError
from rig.forms import BY_SHAPE, Form, Gain, Hertz, PositiveSeconds, Radians, Seconds, Volts, VoltsPerSecond
from rig.stimuli import Array
from rig.units import quantity

MAX_SAMPLES = 50_000_000
"""Longest plan: 0.4 GB of samples each way."""

Fraction = Annotated[float, BeforeValidator(lambda value: quantity(value, "")), Field(gt=0, lt=0.5)]
Count = Annotated[int, Field(ge=1, le=100_000)]


@dataclass(frozen=True)
class Setting:
    """What a step is drawn in: the sample rate, and how long the rig takes to settle.

    ``settling_s`` maps a remaining fraction of a step to a time in s; it raises MisfitError when no rig is known.
    """

    rate_hz: float
    settling_s: Callable[[float], float]

    def samples(self, time_s: float, what: str) -> int:
        """Return the number of samples nearest to ``time_s``; raise MisfitError for none at all or far too many."""
        count = round(time_s * self.rate_hz) if time_s * self.rate_hz <= MAX_SAMPLES else MAX_SAMPLES + 1
        if count < 1:
            raise MisfitError(f"{what} is shorter than a sample", value=f"{time_s:g} s",
                              allowed=f"at least {1 / self.rate_hz:g} s at {self.rate_hz:g} Hz")
        if count > MAX_SAMPLES:
            raise MisfitError(f"{what} is too long", value=f"{time_s:.6g} s",
                              allowed=f"up to {MAX_SAMPLES / self.rate_hz:.6g} s ({MAX_SAMPLES} samples) at "
                                      f"{self.rate_hz:g} Hz", do="shorten it or lower acquisition.rate")
        return count

    def below_nyquist(self, frequency_hz: float) -> None:
        """Raise MisfitError unless more than two samples fall on a period."""
        if frequency_hz >= self.rate_hz / 2:
            raise MisfitError("frequency above Nyquist", value=f"{frequency_hz:g} Hz",
                              allowed=f"below {self.rate_hz / 2:g} Hz, half of acquisition.rate",
                              do="raise acquisition.rate or lower the frequency")


@dataclass(frozen=True)
class Drawn:
    """The samples of one step, V; frequencies and times in them that should be whole; remarks for the operator."""

    u: Array
    frequencies_hz: tuple[float, ...] = ()
    time_s: float = 0.0
    notes: tuple[str, ...] = field(default=())


class Stimulus(Form):
    """One kind of step."""

    kind: ClassVar[str]

    @abstractmethod
    def draw(self, setting: Setting) -> Drawn:
        """Return the samples; raise MisfitError when they cannot be made at this rate."""

    @abstractmethod
    def title(self) -> str:
        """Return the label used when the protocol gives none."""


class SettleForm(Form):
    """A dwell that lasts until the rig has settled to a fraction of its step, and ``hold`` longer."""

    settle: Fraction
    hold: Seconds = 0.0


class RangeForm(Form):
    """Levels from one to another, both included, in equal steps."""

    start: Volts = Field(alias="from")
    stop: Volts = Field(alias="to")
    step: Annotated[Volts, Field(gt=0)]

    @model_validator(mode="after")
    def _fits(self) -> "RangeForm":
        if not stimuli.is_whole(abs(self.stop - self.start) / self.step):
            raise MisfitError("the range is no whole number of steps", value=f"{self.step:g} V",
                              allowed=f"a step that divides {abs(self.stop - self.start):g} V")
        return self

    def levels(self) -> list[float]:
        """Return the levels in V, each a whole number of steps from the first."""
        count = round(abs(self.stop - self.start) / self.step)
        return [float(level) for level in np.linspace(self.start, self.stop, count + 1)]


Levels = Annotated[Annotated[RangeForm, Tag("mapping")] | Annotated[Volts, Tag("plain")], BY_SHAPE]
Dwell = Annotated[Annotated[SettleForm, Tag("mapping")] | Annotated[PositiveSeconds, Tag("plain")], BY_SHAPE]


class StaircaseForm(Stimulus):
    """Levels held one after the other."""

    kind = "staircase"
    levels: Annotated[list[Levels], Field(min_length=1)]
    dwell: Dwell
    scale: Gain = 1.0

    def walk(self) -> list[float]:
        """Return the levels in V in the order they are visited, ranges written out, scaled."""
        parts = [entry.levels() if isinstance(entry, RangeForm) else [entry] for entry in self.levels]
        return [self.scale * level for part in parts for level in part]

    def draw(self, setting: Setting) -> Drawn:
        """Return the samples of the walk; every level lasts equally long."""
        walk, dwell_s = self.walk(), self._dwell_s(setting)
        setting.samples(dwell_s * len(walk), "the staircase")
        u = stimuli.staircase(walk, setting.samples(dwell_s, "the dwell"))
        return Drawn(u, notes=self._settled_note(dwell_s, setting))

    def _dwell_s(self, setting: Setting) -> float:
        if isinstance(self.dwell, SettleForm):
            return setting.settling_s(self.dwell.settle) + self.dwell.hold
        return self.dwell

    def _settled_note(self, dwell_s: float, setting: Setting) -> tuple[str, ...]:
        if not isinstance(self.dwell, SettleForm):
            return ()
        settling_s = setting.settling_s(self.dwell.settle)
        return (f"dwell {dwell_s:.4g} s: settles to {self.dwell.settle:.3g} of a step in {settling_s:.4g} s",)

    def title(self) -> str:
        """Return the number of levels and their range."""
        walk = self.walk()
        return f"staircase of {len(walk)} levels, {min(walk):g} to {max(walk):g} V"


class HoldForm(Stimulus):
    """One level for a time."""

    kind = "hold"
    level: Volts
    time: PositiveSeconds

    def draw(self, setting: Setting) -> Drawn:
        """Return the level for the time."""
        return Drawn(stimuli.staircase([self.level], setting.samples(self.time, "the hold")))

    def title(self) -> str:
        """Return the level and the time."""
        return f"hold {self.level:g} V for {self.time:g} s"


class SineForm(Stimulus):
    """offset + amplitude cos(2 pi frequency t + phase) over a number of periods, eq. (20)."""

    kind = "sine"
    frequency: Hertz
    amplitude: Volts
    periods: Count
    phase: Radians = 0.0
    offset: Volts = 0.0

    def draw(self, setting: Setting) -> Drawn:
        """Return the samples of the periods."""
        setting.below_nyquist(self.frequency)
        time_s = self.periods / self.frequency
        at = stimuli.turns(setting.samples(time_s, "the sine"), self.frequency, setting.rate_hz)
        return Drawn(stimuli.sine(self.amplitude, at, self.phase, self.offset), (self.frequency,), time_s)

    def title(self) -> str:
        """Return frequency and amplitude."""
        return f"sine {self.frequency:.6g} Hz {self.amplitude:g} V"


class TriangleForm(Stimulus):
    """A triangle over a number of periods, starting at its offset and going up."""

    kind = "triangle"
    frequency: Hertz
    amplitude: Volts
    periods: Count
    offset: Volts = 0.0

    def draw(self, setting: Setting) -> Drawn:
        """Return the samples of the periods."""
        setting.below_nyquist(self.frequency)
        time_s = self.periods / self.frequency
        at = stimuli.turns(setting.samples(time_s, "the triangle"), self.frequency, setting.rate_hz)
        return Drawn(stimuli.triangle(self.amplitude, at, self.offset), (self.frequency,), time_s)

    def title(self) -> str:
        """Return frequency and amplitude."""
        return f"triangle {self.frequency:.6g} Hz {self.amplitude:g} V"


class MultisineForm(Stimulus):
    """Sines of equal amplitude together, each line ``amplitude``, or scaled to a common ``peak``.

    ``phases: zero`` starts every line at its maximum, as eq. (45); ``schroeder`` keeps the peak low.
    """

    kind = "multisine"
    frequencies: Annotated[list[Hertz], Field(min_length=1, max_length=1000)]
    time: PositiveSeconds
    amplitude: Volts | None = None
    peak: Annotated[Volts, Field(gt=0)] | None = None
    phases: Literal["zero", "schroeder"] = "schroeder"

    @model_validator(mode="after")
    def _one_size(self) -> "MultisineForm":
        if (self.amplitude is None) == (self.peak is None):
            raise MisfitError("a multisine has one size", allowed="amplitude (of each line) or peak (of the sum)")
        return self

    def draw(self, setting: Setting) -> Drawn:
        """Return the sum of the lines."""
        setting.below_nyquist(max(self.frequencies))
        samples, lines = setting.samples(self.time, "the multisine"), len(self.frequencies)
        phases = stimuli.schroeder_phases(lines) if self.phases == "schroeder" else np.zeros(lines)
        u = np.zeros(samples)
        for frequency, phase in zip(self.frequencies, phases, strict=True):
            u += stimuli.sine(self.amplitude or 1.0, stimuli.turns(samples, frequency, setting.rate_hz), float(phase))
        if self.peak is not None:
            u *= self.peak / np.abs(u).max()
        return Drawn(u, tuple(self.frequencies), self.time)

    def title(self) -> str:
        """Return the number of lines and their band."""
        band = f"{min(self.frequencies):.6g} to {max(self.frequencies):.6g} Hz"
        return f"multisine of {len(self.frequencies)} lines, {band}"


class MinorLoopsForm(Stimulus):
    """Triangles of one slope and several amplitudes, nested around an offset."""

    kind = "minor_loops"
    amplitudes: Annotated[list[Annotated[Volts, Field(gt=0)]], Field(min_length=1, max_length=1000)]
    slope: VoltsPerSecond
    loops: Count = 1
    offset: Volts = 0.0

    def draw(self, setting: Setting) -> Drawn:
        """Return the loops in the order of their amplitudes."""
        points = stimuli.minor_loops(self.amplitudes, self.slope, self.loops, self.offset)
        samples = setting.samples(float(points[0][-1]), "the minor loops")
        return Drawn(stimuli.table(points, samples, setting.rate_hz, straight=True))

    def title(self) -> str:
        """Return the number of amplitudes and the largest."""
        return f"minor loops of {len(self.amplitudes)} amplitudes up to {max(self.amplitudes):g} V"


class TableForm(Stimulus):
    """An arbitrary table of times and levels; the last time is the end."""

    kind = "table"
    times: Annotated[list[Seconds], Field(min_length=2)]
    levels: Annotated[list[Volts], Field(min_length=2)]
    between: Literal["held", "linear"] = "held"

    @model_validator(mode="after")
    def _ascending(self) -> "TableForm":
        if len(self.times) != len(self.levels):
            raise MisfitError("times and levels differ in number", value=f"{len(self.times)} and {len(self.levels)}")
        if self.times[0] != 0 or np.any(np.diff(self.times) <= 0):
            raise MisfitError("the times of a table start at 0 s and ascend", value=f"from {self.times[0]:g} s")
        return self

    def draw(self, setting: Setting) -> Drawn:
        """Return the table on the sample grid."""
        points = np.asarray(self.times), np.asarray(self.levels)
        samples = setting.samples(self.times[-1], "the table")
        return Drawn(stimuli.table(points, samples, setting.rate_hz, straight=self.between == "linear"))

    def title(self) -> str:
        """Return the number of points."""
        return f"table of {len(self.times)} points"


STIMULI: dict[str, type[Stimulus]] = {
    form.kind: form
    for form in (StaircaseForm, SineForm, MultisineForm, TriangleForm, HoldForm, MinorLoopsForm, TableForm)
}
