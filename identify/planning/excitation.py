"""What does a step of a protocol ask of the gap: which frequencies or levels, how long, and how far does v go?

Everything is read off the samples themselves, so that a plan and a recording are seen with the same eyes.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.model import Rational
from identify.noise import period_of, settled_dwells
from identify.trace import Array, Samples, Step, Trace, part

LONGEST = 1 << 21  # samples of a step that are looked at at once
SMOOTH = 16  # distinct levels in a period from which it is a wave and not a walk
STRONG = 1e-3  # share of the largest line above which a line of a period counts
FINE, FINEST = 4096, 1 << 20  # instants in a period on which the peaks of v are read off
WALKS, WAVES = ("staircase", "hold"), ("sine", "multisine", "triangle")


@dataclass(frozen=True, eq=False)
class Wave:
    """One period of a periodic stimulus: its mean, its lines (Hz) and their complex amplitudes (V)."""

    label: str
    rate_hz: float
    period_s: float
    time_s: float
    offset_v: float
    lines_hz: Array
    amplitudes: NDArray[np.complex128]

    @property
    def is_sine(self) -> bool:
        """Return whether there is one line only."""
        return self.lines_hz.size == 1

    @property
    def size_v(self) -> float:
        """Return half of the swing of u, V: the amplitude of a sine."""
        high, low = self.swing_behind(Rational((1.0,), (1.0,)))
        return 0.5 * (high - low)

    def swing_behind(self, block: Rational) -> tuple[float, float]:
        """Return how far the settled output goes above and (negative) below its mean, V; exact for a sine."""
        if self.is_sine:
            size = float(np.abs(self.amplitudes[0] * response(block, self.lines_hz)[0]))
            return size, -size
        over = self.behind(block) - self.offset_v * block.dc_gain
        return float(np.max(over)), float(np.min(over))

    def behind(self, block: Rational) -> Array:
        """Return the settled output of ``block`` over a period, V, on FINE instants or more."""
        orders = np.rint(self.lines_hz * self.period_s).astype(int)
        size = min(1 << int(np.ceil(np.log2(max(FINE, 16 * int(orders[-1]))))), FINEST)
        kept = orders <= size // 2
        spectrum = np.zeros(size // 2 + 1, dtype=np.complex128)
        spectrum[orders[kept]] = 0.5 * size * (self.amplitudes * response(block, self.lines_hz))[kept]
        return np.asarray(np.fft.irfft(spectrum, size) + self.offset_v * block.dc_gain)


@dataclass(frozen=True, eq=False)
class Walk:
    """Levels held one after the other, V, the shortest of them for ``dwell_s``."""

    label: str
    rate_hz: float
    levels_v: Array
    dwell_s: float


def response(block: Rational, frequencies_hz: Array) -> NDArray[np.complex128]:
    """Return G(j 2 pi f) without its dead time, complex, shape of ``frequencies_hz``."""
    s = 2j * np.pi * np.asarray(frequencies_hz)
    return np.asarray(np.polyval(block.num, s) / np.polyval(block.den, s))


def named_steps(trace: Trace) -> tuple[Step, ...]:
    """Return the steps of a trace; one with the trace's own name where it has none."""
    return trace.steps or (Step(trace.name, "", 0, trace.size),)


def excitations(trace: Trace) -> Iterator[Wave | Walk]:
    """Yield what every step asks, each label once; a step that is neither wave nor walk is left out."""
    seen: set[str] = set()
    for step in named_steps(trace):
        if step.label not in seen:
            seen.add(step.label)
            u = part(trace.u, step.start, step.stop)
            found = excitation(step, u[:LONGEST], trace.rate_hz)
            if isinstance(found, Walk) and u.size > LONGEST:
                found = _long_walk(step, u, trace.rate_hz) or found
            if found is not None:
                yield found


def excitation(step: Step, u: Array, rate_hz: float) -> Wave | Walk | None:
    """Return what the samples ``u`` of a step, or its first ones, are; None when neither wave nor walk."""
    if step.kind in WALKS or (step.kind not in WAVES and _stands(u)):
        return _walk(step, u, rate_hz)
    period = u[: period_of(u) or u.size]
    if not np.ptp(u) > 0.0 or (step.kind not in WAVES and not _is_wave(u, period)):
        return None
    spectrum = np.fft.rfft(period) * 2.0 / period.size
    sizes = np.abs(spectrum[1:])
    strong = np.flatnonzero(sizes > STRONG * np.max(sizes)) + 1
    return Wave(
        step.label, rate_hz, period.size / rate_hz, (step.stop - step.start) / rate_hz, float(spectrum[0].real) / 2.0,
        strong * rate_hz / period.size, spectrum[strong],
    )  # fmt: skip


def _is_wave(u: Array, period: Array) -> bool:
    """Return whether u repeats, and goes through many levels meanwhile."""
    return period.size < u.size and np.unique(period).size > SMOOTH


def _stands(u: Array) -> bool:
    """Return whether u stands still most of the time."""
    return bool(np.count_nonzero(np.diff(u)) < u.size // 20)


def _long_walk(step: Step, u: Samples, rate_hz: float) -> Walk | None:
    """Return the levels that were held for at least two samples; None when there are none."""
    dwells = settled_dwells(u, 0)
    if not dwells:
        return None
    levels = np.concatenate([u[start : start + 1] for start, _ in dwells])
    return Walk(step.label, rate_hz, levels, min(stop - start + 1 for start, stop in dwells) / rate_hz)


def _walk(step: Step, u: Array, rate_hz: float) -> Walk:
    """Return the levels; the last dwell does not count when it was cut off or the step has others."""
    edges = np.concatenate(([0], np.flatnonzero(np.diff(u)) + 1, [u.size]))
    dwells = np.diff(edges)
    whole = dwells[:-1] if u.size < step.stop - step.start and dwells.size > 1 else dwells
    return Walk(step.label, rate_hz, u[edges[:-1]], float(np.min(whole)) / rate_hz)
