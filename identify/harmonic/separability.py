"""Which points of G1 and G2 can sines tell apart, with the borders known and no model of the blocks (paper section 5)?

A sine of w shows the lines Y_n = c_n(U |G1|, phi_1) G2(n w). Unknown are log |G1| and phi_1 at every played frequency
and log |G2| and phi_2 at every harmonic that stands out of the noise. Their sensitivities, in units of the noise of a
line, are decomposed: a direction along which the data bound nothing tells which points cannot be had. No set of
frequencies bounds a common delay (physics.md 1.1), so the phase of G1 at the lowest frequency is taken as given.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.harmonic.harmonics import Complex, coefficients, slopes, threshold_v
from identify.model import Backlash, Model, Rational
from identify.trace import Array

NEEDED = 0.1  # sd of a log gain or a phase from which a point counts as not told: parts are known that well unmeasured
VISIBLE = 5.0  # a harmonic counts from this many standard deviations of its line
HIGHEST = 21  # harmonics looked at: those of a play fall as 1 / n^2
ROUNDING = 1e-12  # relative sensitivity that is nothing but rounding

Part = Literal["gain", "phase"]


@dataclass(frozen=True)
class Tone:
    """One sine of a plan or a recording: ``samples`` readings at ``rate_hz``, each with ``noise_v``."""

    frequency_hz: float
    amplitude_v: float
    samples: float
    rate_hz: float
    noise_v: float
    offset_v: float = 0.0

    @property
    def line_sd_v(self) -> float:
        """Return the standard deviation of either part of a measured line, V; that of the mean is sqrt(2) smaller."""
        return self.noise_v * sqrt(2.0 / self.samples)


@dataclass(frozen=True)
class Point:
    """One unknown: log gain or phase of a block at one frequency."""

    block: str
    frequency_hz: float
    part: Part


@dataclass(frozen=True, eq=False)
class Separability:
    """The unknown points, and how much a set of sines tells of each: ``sensitivity`` (lines, points) per noise sd.

    ``stuck`` are the sines during which F never moves.
    """

    points: tuple[Point, ...]
    sensitivity: NDArray[np.float64]
    stuck: tuple[Tone, ...]

    @cached_property
    def _axes(self) -> tuple[Array, NDArray[np.float64]]:
        """Return the standard deviation along every principal direction, infinity for none, and the directions."""
        _, values, axes = np.linalg.svd(self.sensitivity)
        bounded = np.zeros(len(self.points))
        bounded[: values.size] = np.where(values > ROUNDING * np.max(values, initial=0.0), values, 0.0)
        with np.errstate(divide="ignore"):
            return 1.0 / bounded, axes

    @cached_property
    def free(self) -> NDArray[np.float64]:
        """Return the directions, one a row over ``points``, along which the sines tell less than is needed."""
        sd, axes = self._axes
        return axes[sd > NEEDED]

    @cached_property
    def sd(self) -> Array:
        """Return the standard deviation of every point: relative for a gain, rad for a phase; infinity when free."""
        sd, axes = self._axes
        shares = np.square(axes)
        unbounded = np.isinf(sd)
        known = np.sqrt(np.square(sd[~unbounded]) @ shares[~unbounded])
        return np.where(shares[unbounded].sum(axis=0) > 1e-12, np.inf, known)

    def sd_of(self, block: str, frequency_hz: float, part: Part) -> float:
        """Return the standard deviation of one point; infinity when it is no unknown of these sines."""
        for point, sd in zip(self.points, self.sd, strict=True):
            if (point.block, point.part) == (block, part) and _same(point.frequency_hz, frequency_hz):
                return float(sd)
        return float("inf")

    def untold(self, block: str, part: Part) -> tuple[float, ...]:
        """Return the frequencies, Hz, at which one part of a block is not told to what is needed."""
        pairs = zip(self.points, self.sd, strict=True)
        return tuple(p.frequency_hz for p, sd in pairs if (p.block, p.part) == (block, part) and sd > NEEDED)


def separability(
    model: Model, tones: Sequence[Tone], mean: bool = True, delay_known: bool = True
) -> Separability:
    """Return what ``tones`` tell of the points of a rig near ``model``; without its rational functions.

    ``mean`` counts the mean of the reading, which takes G2(0) and the offset of the reading as known; ``delay_known``
    takes the phase of G1 at the lowest frequency as given. Raises ValueError for a rig whose F is not a backlash with
    straight borders, or whose borders cross within reach.
    """
    if not isinstance(model.f, Backlash):
        raise ValueError("harmonics are known for a backlash with straight borders only")
    return _separated([_Lines.of(model, tone) for tone in tones], mean, delay_known)


def _separated(lines: Sequence["_Lines"], mean: bool = True, delay_known: bool = True) -> Separability:
    """Return what the lines of some sines tell."""
    moving = [line for line in lines if line.moves]
    points = _points(moving)
    rows = [row for line in moving for row in line.rows(points, mean)]
    sensitivity = np.array(rows).reshape(len(rows), len(points))
    if points and delay_known:
        given = [p.part for p in points].index("phase")
        points, sensitivity = points[:given] + points[given + 1 :], np.delete(sensitivity, given, axis=1)
    return Separability(tuple(points), sensitivity, tuple(line.tone for line in lines if not line.moves))


@dataclass(frozen=True, eq=False)
class _Lines:
    """The visible lines of one sine: orders, values and derivatives in log |G1|, V, and whether F moves at all."""

    tone: Tone
    orders: NDArray[np.int64]
    values: Complex
    by_gain: Complex
    moves: bool

    @classmethod
    def of(cls, model: Model, tone: Tone) -> "_Lines":
        """Return the lines below half the sample rate that stand out of the noise; order 0 always."""
        assert isinstance(model.f, Backlash)
        centre_v = tone.offset_v * model.g1.dc_gain
        f = replace(model.f, d_l_v=model.f.d_l_v - centre_v, d_u_v=model.f.d_u_v - centre_v)
        highest = min(HIGHEST, int(np.ceil(0.5 * tone.rate_hz / tone.frequency_hz)) - 1)
        orders = np.arange(max(highest, 1) + 1)
        before = complex(at(model.g1, tone.frequency_hz)) * tone.amplitude_v
        behind = at(model.g2, tone.frequency_hz * orders.astype(np.float64))
        amplitude_v, phase_rad = abs(before), float(np.angle(before))
        values = coefficients(amplitude_v, phase_rad, f, orders) * behind
        by_gain = amplitude_v * slopes(amplitude_v, phase_rad, f, orders)[0] * behind
        floor = max(VISIBLE * tone.line_sd_v, ROUNDING * float(np.max(np.abs(values))))
        shown = (np.abs(values) > floor) | (orders == 0)
        return cls(tone, orders[shown], values[shown], by_gain[shown], amplitude_v > threshold_v(f))

    def rows(self, points: Sequence[Point], mean: bool) -> list[Array]:
        """Return the sensitivity of every line, real and imaginary part, against every point, per noise sd."""
        hz = self.tone.frequency_hz
        table = np.zeros((self.orders.size, len(points)), dtype=np.complex128)
        (played,) = _places(points, "G1", np.array([hz]))
        table[:, played] = self.by_gain
        table[:, played + 1] = 1j * self.orders * self.values
        shown, lines = _places(points, "G2", hz * self.orders[1:].astype(np.float64)), np.arange(1, self.orders.size)
        table[lines, shown] = self.values[1:]
        table[lines, shown + 1] = 1j * self.values[1:]
        table /= self.tone.line_sd_v
        rows = [*table[1:].real, *table[1:].imag]
        return [*rows, sqrt(2.0) * table[0].real] if mean else rows


def _points(lines: Sequence[_Lines]) -> list[Point]:
    """Return the unknowns of all lines, G1 before G2, each by frequency; equal frequencies are one."""
    played = {("G1", line.tone.frequency_hz) for line in lines}
    shown = {("G2", float(n * line.tone.frequency_hz)) for line in lines for n in line.orders[1:]}
    found: list[tuple[str, float]] = []
    for block, hz in sorted(played | shown):
        if not (found and found[-1][0] == block and _same(found[-1][1], hz)):
            found.append((block, hz))
    parts: tuple[Part, Part] = ("gain", "phase")
    return [Point(block, hz, part) for block, hz in found for part in parts]


def _places(points: Sequence[Point], block: str, frequencies_hz: Array) -> NDArray[np.intp]:
    """Return where the gains of a block at these frequencies stand among the points; its phases stand behind them."""
    first = next((i for i, p in enumerate(points) if p.block == block), 0)
    known = np.array([p.frequency_hz for p in points if p.block == block][::2])
    nearest = np.argmin(np.abs(known[None, :] - np.asarray(frequencies_hz)[:, None]), axis=1) if known.size else []
    return first + 2 * np.asarray(nearest, dtype=np.intp)


def _same(one_hz: float, other_hz: float) -> bool:
    """Return whether two frequencies are one line."""
    return abs(one_hz - other_hz) <= 1e-6 * max(one_hz, other_hz)


def at(block: Rational, frequency_hz: float | Array) -> Complex:
    """Return num(jw)/den(jw) exp(-jw dead_time)."""
    s = 2j * np.pi * np.asarray(frequency_hz, dtype=np.float64)
    return np.asarray(np.polyval(block.num, s) / np.polyval(block.den, s) * np.exp(-s * block.dead_time_s))


def freed_above_v(model: Model, frequency_hz: float) -> float:
    """Return the amplitude of u, V, above which F moves at one frequency (physics.md 1.3)."""
    assert isinstance(model.f, Backlash)
    return threshold_v(model.f) / float(abs(at(model.g1, frequency_hz)))


def second_amplitude(
    model: Model, tones: Sequence[Tone], frequency_hz: float, largest_v: float
) -> tuple[Tone, float] | None:
    """Return the sine at ``frequency_hz``, up to ``largest_v``, that tells |G1| best beside ``tones``, and its sd then.

    None when none of the amplitudes tried tells it to what is needed.
    """
    lines = [_Lines.of(model, tone) for tone in tones]
    played = max((t for t in tones if _same(t.frequency_hz, frequency_hz)), key=lambda t: t.amplitude_v)
    least_v = freed_above_v(model, frequency_hz)
    within = [float(u) for u in np.linspace(1.1 * least_v, largest_v, 6) if least_v < u <= largest_v]
    tried = [replace(played, amplitude_v=u) for u in within]
    told = [(t, _separated([*lines, _Lines.of(model, t)]).sd_of("G1", frequency_hz, "gain")) for t in tried]
    best = min(told, key=lambda pair: pair[1], default=None)
    return best if best is not None and best[1] <= NEEDED else None
