"""What can a step of a protocol ask for, and which samples does it mean?

One form per stimulus. A form knows its keys, draws its samples in a ``Setting``, and says where the samples are not
quite what was asked for. A new stimulus is one more form and its entry in ``STIMULI``.
"""

from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, model_validator

from rig import stimuli
from rig.errors import FileError, MisfitError
from rig.forms import Form, Gain, Hertz, PositiveSeconds, Radians, Seconds, Volts, VoltsPerSecond, either
from rig.readers import open_table
from rig.references import file_meant, stays_inside
from rig.signals import altered, drawn, drawn_once, extremes
from rig.stairs import Dwell, Levels, RangeForm, SettleForm
from rig.stimulus import Drawn, Setting, Stimulus

Count = Annotated[int, Field(ge=1, le=100_000)]


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
        dwell = setting.samples(dwell_s, "the dwell")
        u = drawn(len(walk) * dwell, lambda start, stop: stimuli.staircase(walk, dwell, start, stop))
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
        samples = setting.samples(self.time, "the hold")
        return Drawn(drawn(samples, lambda start, stop: np.full(stop - start, self.level)))

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
        samples = setting.samples(time_s, "the sine")
        at = partial(stimuli.turns, samples, self.frequency, setting.rate_hz)
        u = drawn(samples, lambda *ends: stimuli.sine(self.amplitude, at(*ends), self.phase, self.offset))
        return Drawn(u, (self.frequency,), time_s)

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
        samples = setting.samples(time_s, "the triangle")
        at = partial(stimuli.turns, samples, self.frequency, setting.rate_hz)
        u = drawn(samples, lambda *ends: stimuli.triangle(self.amplitude, at(*ends), self.offset))
        return Drawn(u, (self.frequency,), time_s)

    def title(self) -> str:
        """Return frequency and amplitude."""
        return f"triangle {self.frequency:.6g} Hz {self.amplitude:g} V"


class MultisineForm(Stimulus):
    """Sines of equal amplitude together, each line ``amplitude``, or scaled to a common ``peak``.

    It lasts a ``time``, or so many ``periods`` of its lowest line. ``phases: zero`` starts every line at its maximum,
    as eq. (45); ``schroeder`` keeps the peak low.
    """

    model_config = ConfigDict(
        json_schema_extra={"allOf": [either(("amplitude",), ("peak",)), either(("time",), ("periods",))]})
    kind = "multisine"
    frequencies: Annotated[list[Hertz], Field(min_length=1, max_length=1000)]
    time: PositiveSeconds | None = None
    periods: Count | None = None
    amplitude: Volts | None = None
    peak: Annotated[Volts, Field(gt=0)] | None = None
    phases: Literal["zero", "schroeder"] = "schroeder"

    @model_validator(mode="after")
    def _one_size(self) -> "MultisineForm":
        if (self.amplitude is None) == (self.peak is None):
            raise MisfitError("a multisine has one size", allowed="amplitude (of each line) or peak (of the sum)")
        if (self.time is None) == (self.periods is None):
            raise MisfitError("a multisine has one length", allowed="time, or periods (of its lowest line)")
        return self

    def draw(self, setting: Setting) -> Drawn:
        """Return the sum of the lines."""
        setting.below_nyquist(max(self.frequencies))
        time_s = self.time or (self.periods or 1) / min(self.frequencies)
        samples = setting.samples(time_s, "the multisine")
        u = drawn_once(samples, partial(self._sum, samples, setting.rate_hz))
        if self.peak is not None:
            factor = self.peak / extremes(u).peak_v
            u = altered(u, lambda values: values * factor)
        return Drawn(u, tuple(self.frequencies), time_s)

    def _sum(self, samples: int, rate_hz: float, start: int, stop: int) -> stimuli.Array:
        """Return the samples [start, stop) of the sum of the lines, before it is scaled to a peak."""
        lines = len(self.frequencies)
        phases = stimuli.schroeder_phases(lines) if self.phases == "schroeder" else np.zeros(lines)
        u = np.zeros(stop - start)
        for frequency, phase in zip(self.frequencies, phases, strict=True):
            at = stimuli.turns(samples, frequency, rate_hz, start, stop)
            u += stimuli.sine(self.amplitude or 1.0, at, float(phase))
        return u

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
        return Drawn(drawn(samples, stimuli.along(points, setting.rate_hz, straight=True)))

    def title(self) -> str:
        """Return the number of amplitudes and the largest."""
        return f"minor loops of {len(self.amplitudes)} amplitudes up to {max(self.amplitudes):g} V"


class FileForm(Form):
    """Two columns of a table, by name or number: times in s and levels in V, or in the units of their headings."""

    path: Annotated[str, AfterValidator(stays_inside)]
    time: str | int = 1
    level: str | int = 2

    def points(self, folder: Path) -> stimuli.Points:
        """Return times and levels from the file as seen from ``folder``; raise FileError."""
        try:
            found = file_meant(self.path, folder)
        except MisfitError as error:
            raise error.placed(str(folder / self.path)) from error
        if found is None:
            raise FileError("no such file", where=str(folder / self.path))
        table = open_table(found)
        return table.column(str(self.time), "s"), table.column(str(self.level), "V")


class TableForm(Stimulus):
    """An arbitrary table of times and levels, written out or in a file of two columns; the last time is the end."""

    model_config = ConfigDict(json_schema_extra=either(("times", "levels"), ("file",)))
    kind = "table"
    times: list[Seconds] | None = None
    levels: list[Volts] | None = None
    file: FileForm | None = None
    between: Literal["held", "linear"] = "held"

    @model_validator(mode="after")
    def _one_source(self) -> "TableForm":
        written = (self.times is not None, self.levels is not None)
        if any(written) != all(written) or any(written) == (self.file is not None):
            raise MisfitError("a table has one source", allowed="times and levels, or file")
        return self

    def draw(self, setting: Setting) -> Drawn:
        """Return the table on the sample grid."""
        times, levels = self._points(setting)
        if times.size != levels.size or times.size < 2:
            raise MisfitError("times and levels do not pair up", value=f"{times.size} and {levels.size}",
                              allowed="equally many, at least 2")
        if times[0] != 0 or np.any(np.diff(times) <= 0):
            raise MisfitError("the times of a table start at 0 s and ascend", value=f"from {times[0]:g} s")
        samples = setting.samples(float(times[-1]), "the table")
        return Drawn(drawn(samples, stimuli.along((times, levels), setting.rate_hz, straight=self.between == "linear")))

    def _points(self, setting: Setting) -> stimuli.Points:
        if self.file is not None:
            return self.file.points(setting.folder)
        return np.asarray(self.times, dtype=np.float64), np.asarray(self.levels, dtype=np.float64)

    def title(self) -> str:
        """Return the file, or the number of points."""
        return f"table {self.file.path}" if self.file is not None else f"table of {len(self.times or ())} points"


STIMULI: dict[str, type[Stimulus]] = {
    form.kind: form
    for form in (StaircaseForm, SineForm, MultisineForm, TriangleForm, HoldForm, MinorLoopsForm, TableForm)
}
