"""What does one settled period look like, and how noisy is each of its harmonics (paper eqs. 29-35)?

Averaging M periods leaves what repeats. What does not repeat is the noise: its size at every line is the scatter of
that line from period to period, so that coloured noise is weighed as it is and physics that repeats is no noise.

Lines are complex amplitudes: a signal is Re sum of line_k exp(j 2 pi k f t), f = 1 / period, t from the first sample of
the period. (29b) as printed loses the quadrant and (29c) doubles n = 0 (physics.md 1.7); complex lines do neither.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identify.noise import good, period_of, stretches
from identify.trace import Array, Intersample, Trace, part

Complex = NDArray[np.complex128]
POWERFUL = 0.01  # share of the largest line above which a line of u counts as played
PURE = 1e-4  # share of the played power that other lines may hold before u is no sine or multisine
LONGEST = 1 << 21  # samples of a period that is looked at
BATCH = 1 << 20  # samples transformed at once: bounds memory
AROUND = 8  # neighbours on either side whose scatter is pooled with a line's own


@dataclass(frozen=True, eq=False)
class Period:
    """The mean of the settled periods of one stimulus.

    ``u`` (P,) in V is one period as sampled, ``lines`` (P // 2 + 1,) those of y in V, ``sd_v`` of the same shape the
    standard deviation of their real and of their imaginary parts. ``played`` are the indices of the lines u holds.
    """

    name: str
    kind: str
    rate_hz: float
    intersample: Intersample
    count: int
    u: Array
    lines: Complex
    sd_v: Array
    played: tuple[int, ...]

    @property
    def base_hz(self) -> float:
        """Return the frequency of line 1."""
        return self.rate_hz / self.u.size

    @property
    def mean_u_v(self) -> float:
        """Return the level u swings about."""
        return float(np.mean(self.u))

    def drive(self, lines: ArrayLike) -> Complex:
        """Return the lines of u, but not the mean, as G1 feels them, V: held, they are smaller and half a sample late.

        Beyond half the sample rate they are the images of what was sampled.
        """
        k = np.asarray(lines)
        sampled = np.fft.fft(self.u)[k % self.u.size] * (2.0 / self.u.size)
        share = k / self.u.size
        if self.intersample == "held":
            return np.asarray(sampled * np.sinc(share) * np.exp(-1j * np.pi * share))
        return np.asarray(sampled * (np.sinc(share) ** 2 if self.intersample == "linear" else share < 0.5))

    def mean_y_v(self) -> Array:
        """Return the averaged period of eq. (30), V, shape (P,)."""
        halved = np.concatenate((self.lines[:1], 0.5 * self.lines[1:]))
        if self.u.size % 2 == 0:
            halved[-1] *= 2.0
        return np.asarray(np.fft.irfft(halved, self.u.size) * self.u.size)


def periods(trace: Trace, settle_s: float, noise_v: float) -> tuple[Period, ...]:
    """Return the averaged period of every settled periodic stimulus of a recording that is a sine or a multisine.

    ``settle_s`` is skipped at the start of each stimulus. A single period has no scatter: ``noise_v`` stands for it.
    """
    found = (_period(trace, start, stop, settle_s, noise_v) for start, stop in stretches(trace))
    return tuple(period for period in found if period is not None)


def _period(trace: Trace, start: int, stop: int, settle_s: float, noise_v: float) -> Period | None:
    """Return the averaged period of one stretch; None when it has none, or u has lines that nobody put there."""
    size = period_of(part(trace.u, start, stop))
    first = start + max(round(settle_s * trace.rate_hz), size)
    if not 8 <= size <= LONGEST or stop - first < size:
        return None
    u = np.array(trace.u[first : first + size])
    played = _played(u)
    if not played:
        return None
    whole = _intact(trace, first, stop, size)
    if whole.size == 0:
        return None
    lines, scatter = _averaged(trace, whole, size)
    lines = lines * np.exp(2j * np.pi * np.arange(lines.size) / size * trace.rate_hz * trace.late_s)
    if scatter is None:
        scatter = np.full(lines.size, noise_v * np.sqrt(2.0 / size))
    kind = next((s.kind for s in trace.steps if s.start <= first < s.stop), "")
    label = next((s.label for s in trace.steps if s.start <= first < s.stop), trace.name)
    sd = np.maximum(scatter, 1e-12 * np.max(np.abs(lines))) / np.sqrt(whole.size)
    return Period(label, kind, trace.rate_hz, trace.intersample, int(whole.size), u, lines, sd, played)


def _played(u: Array) -> tuple[int, ...]:
    """Return the strong lines of one period of u; none when the others hold more than a trace of its power."""
    power = np.abs(np.fft.rfft(u - np.mean(u))) ** 2
    strong = np.flatnonzero(power > POWERFUL**2 * np.max(power))
    return tuple(strong.tolist()) if np.sum(power[strong]) > (1.0 - PURE) * np.sum(power) else ()


def _intact(trace: Trace, first: int, stop: int, size: int) -> NDArray[np.int64]:
    """Return the first samples of all whole periods without a lost sample."""
    starts = np.arange(first, stop - size + 1, size)
    ok = good(trace)[first : first + starts.size * size].reshape(starts.size, size).all(axis=1)
    return starts[ok]


def _averaged(trace: Trace, starts: NDArray[np.int64], size: int) -> tuple[Complex, Array | None]:
    """Return the mean lines over all periods and the sd of one period's (None for a single period)."""
    total, squares = np.zeros(size // 2 + 1, dtype=np.complex128), np.zeros(size // 2 + 1)
    reference = _transformed(trace.y[starts[0] : starts[0] + size], size)[0]  # near the mean: no digits are lost
    each = max(BATCH // size, 1)
    for group in np.split(starts, range(each, starts.size, each)):
        y = trace.y[group[0] : group[-1] + size]
        apart = _transformed(y, size)[(group - group[0]) // size] - reference
        total += apart.sum(axis=0)
        squares += np.sum(np.abs(apart) ** 2, axis=0)
    mean = total / starts.size
    if starts.size < 2:
        return reference + mean, None
    variance = np.maximum(squares / starts.size - np.abs(mean) ** 2, 0.0) * starts.size / (starts.size - 1)
    return reference + mean, np.sqrt(_pooled(variance))


def _transformed(y: Array, size: int) -> Complex:
    """Return the lines of successive periods, shape (periods, size // 2 + 1)."""
    lines = np.fft.rfft(y.reshape(-1, size), axis=1) * (2.0 / size)
    lines[:, 0] *= 0.5
    return np.asarray(lines)


def _pooled(variance: Array) -> Array:
    """Return the variance of a real part, pooled with its neighbours; line 0 is real and has half the variance."""
    own = 0.5 * variance
    own[0] *= 4.0  # |line 0|^2 is one square of a mean, half as wide as a real part of the others
    width = min(AROUND, own.size - 1)
    padded = np.concatenate((own[width:0:-1], own, own[-2 : -width - 2 : -1]))
    pooled = np.convolve(padded, np.ones(2 * width + 1) / (2 * width + 1), "valid")
    pooled[0] *= 0.5
    return np.asarray(pooled)
