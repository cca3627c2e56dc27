"""What was played and what came back: the one form in which data enter identification."""

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import DTypeLike, NDArray

from identify.interval import Interval
from identify.natural_units import shown
from identify.notebook.glance import Glance, Seen

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Intersample = Literal["held", "linear", "bandlimited"]

LONG = 1 << 20  # samples read at once by what looks at a whole recording: 8 MB a signal


@dataclass(frozen=True)
class Stored(ABC):
    """A signal in V that stays where it is kept: a slice of it is read when it is asked for, ``[:]`` is all of it."""

    size: int

    @abstractmethod
    def read(self, start: int, stop: int) -> Array:
        """Return the samples [start, stop), 0 <= start < stop <= size."""

    def __getitem__(self, at: slice) -> Array:
        """Return a slice, its step above 0."""
        start, stop, step = at.indices(self.size)
        if step < 1:
            raise ValueError(f"a stored signal is read forwards, not in steps of {step}")
        return self.read(start, stop)[::step] if start < stop else np.empty(0)

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> Array:
        """Return all of it."""
        return np.asarray(self[:], dtype=dtype)


Samples = Array | Stored
"""A signal in V, shape (N,), of which slices can be had."""


@dataclass(frozen=True)
class Part(Stored):
    """A stretch of a stored signal, from its sample ``first`` on."""

    whole: Stored
    first: int

    def read(self, start: int, stop: int) -> Array:
        """Return the samples [start, stop), counted from the beginning of the part."""
        return self.whole.read(self.first + start, self.first + stop)


def part(signal: Samples, start: int, stop: int) -> Samples:
    """Return the samples [start, stop) of a signal, read when they are asked for where the signal is."""
    return Part(stop - start, signal, start) if isinstance(signal, Stored) else signal[start:stop]


def blocks(start: int, stop: int, size: int = LONG) -> Iterator[tuple[int, int]]:
    """Yield [start, stop) in successive stretches of ``size`` samples, the last one shorter."""
    return ((first, min(first + size, stop)) for first in range(start, stop, size))


def regrouped(pieces: Iterable[Array], size: int = LONG) -> Iterator[Array]:
    """Yield the values of all pieces, in order, in stretches of ``size`` values, the last one shorter."""
    held: list[Array] = []
    count = 0
    for piece in pieces:
        held.append(piece)
        count += piece.size
        if count >= size:
            joined = np.concatenate(held)
            whole = count // size * size
            yield from (joined[first:stop] for first, stop in blocks(0, whole, size))
            held, count = [joined[whole:]], count - whole
    if count:
        yield np.concatenate(held)


def frozen_array(values: object, dtype: type = np.float64) -> NDArray[np.float64]:
    """Return a read-only one-dimensional copy-free view of ``values``; raise ValueError on another shape."""
    array: NDArray[np.float64] = np.asarray(values, dtype=dtype).view()
    if array.ndim != 1:
        raise ValueError(f"a signal has one dimension, this one has shape {array.shape}")
    array.flags.writeable = False
    return array


def frozen(signal: Samples) -> Samples:
    """Return a signal that cannot be written to."""
    return signal if isinstance(signal, Stored) else frozen_array(signal)


@dataclass(frozen=True)
class Step:
    """A stretch of samples [start, stop) with one stimulus; equal labels with different ``repeat`` are repeats."""

    label: str
    kind: str
    start: int
    stop: int
    repeat: int = 0


@dataclass(frozen=True)
class KnownDevice:
    """What is known of the device of a recording: how late it reads, s, with its 95 % interval, and from where.

    ``unused`` says why the delay is not left out of the rig's, empty when it is. ``facts`` are further quantities with
    their units, by name: told, not used.
    """

    late: Interval
    origin: str
    unused: str = ""
    facts: tuple[tuple[str, Interval, str], ...] = ()


@dataclass(frozen=True, repr=False)
class Trace(Seen):
    """One recording on a uniform time base.

    ``u`` and ``y`` are in V, shape (N,). y[k] is read at t[k] = start_s + k / rate_hz, just before u[k] acts.
    ``intersample`` says what u is between samples: held (a DAC), linear or bandlimited (a measured signal).
    ``valid`` is False where a sample was lost; None when every sample is there. ``from_rest`` is False when the rig
    was already in motion at the first sample, so that its state there is unknown. The delay of a known ``device`` is
    not the rig's, and not searched.
    """

    name: str
    rate_hz: float
    u: Samples
    y: Samples
    intersample: Intersample = "held"
    start_s: float = 0.0
    steps: tuple[Step, ...] = ()
    valid: Mask | None = field(default=None)
    from_rest: bool = True
    device: KnownDevice | None = None

    def __post_init__(self) -> None:
        """Freeze the arrays and refuse what cannot be a recording (ValueError)."""
        object.__setattr__(self, "u", frozen(self.u))
        object.__setattr__(self, "y", frozen(self.y))
        if self.u.size != self.y.size or self.u.size == 0:
            raise ValueError(
                f"{self.name}: u has {self.u.size} samples and y has {self.y.size}; both must be equal and > 0"
            )
        if not self.rate_hz > 0:
            raise ValueError(f"{self.name}: sample rate is {self.rate_hz} Hz, it must be > 0")

    @property
    def size(self) -> int:
        """Return the number of samples."""
        return int(self.u.size)

    @property
    def clock_s(self) -> Array:
        """Return the clock at every sample, s, shape (N,)."""
        return np.asarray(self.start_s + np.arange(self.size) / self.rate_hz)

    def glance(self) -> Glance:
        """Return how long it is, what was played, what is missing."""
        length = f"{self.size} samples at {shown(self.rate_hz, 'Hz')}, {shown(self.size / self.rate_hz, 's')}"
        steps = tuple((step.label, f"{step.stop - step.start} samples") for step in self.steps)
        lost = 0 if self.valid is None else self.size - int(np.count_nonzero(self.valid))
        missing = (("missing", f"{lost} samples"),) if lost else ()
        return Glance("Trace", f"{self.name}, {length}, u {self.intersample} between samples", (*missing, *steps))

    def plot(self) -> "list[Axes]":
        """Draw u and y over time, what is missing left out, on axes of pyplot; return them."""
        from identify.notebook.plots import signals

        return signals(self.name, self.rate_hz, {"u": self.u, "y": self.y}, self.valid, self.start_s)

    @property
    def late_s(self) -> float:
        """Return by how much the readings are known to be late by the device alone, s."""
        return 0.0 if self.device is None or self.device.unused else self.device.late.value

    def until(self, size: int) -> "Trace":
        """Return the run up to sample ``size``, the step there ending with it; itself when it is no longer."""
        if size >= self.size:
            return self
        steps = tuple(replace(step, stop=min(step.stop, size)) for step in self.steps if step.start < size)
        valid = None if self.valid is None else self.valid[:size]
        return replace(self, u=part(self.u, 0, size), y=part(self.y, 0, size), steps=steps, valid=valid)


def intersample_of(traces: Sequence[Trace]) -> Intersample:
    """Return what u is between samples; ValueError when recordings differ in it."""
    kinds = {trace.intersample for trace in traces}
    if len(kinds) > 1:
        raise ValueError(f"recordings with {' and '.join(sorted(kinds))} inputs cannot be fitted together")
    return next(iter(kinds))
