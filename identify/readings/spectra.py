"""What power has the noise of a recording at every frequency, told from what repeats?

The difference of two repeats of one stimulus holds no answer of the rig, only noise, and what changes with the clock
(offset, scale, time base), which it is freed of by regression; the mains are left out.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import log

import numpy as np
from scipy.special import exprel

from identify.noise import good, repeated
from identify.trace import Array, Mask, Trace

MAINS_HZ = (50.0, 60.0)
BESIDE_MAINS_HZ = 1.0
HARMONICS = 10
LOWEST = 3  # ordinates: what is left of drifts
BANDS = 30  # a decade: the power law bends little in one
LEAST = 400  # readings of a pair of repeats
ONE_BY_ONE = 32  # lines whose powers are summed as they are


@dataclass(frozen=True)
class Spectrum:
    """Power of the difference of two repeats per sqrt(2), V^2, at frequencies in Hz, each the mean of ``count``.

    ``lines_hz`` are the recording's own frequencies, over which coloured noise has its rms.
    """

    frequency_hz: Array
    power: Array
    count: Array
    lines_hz: Array

    def expected(self, white_v: float, sd_v: float, slope: float) -> Array:
        """Return the mean power of white and coloured noise together."""
        return power_of(self.frequency_hz, self.lines_hz, white_v, sd_v, slope)


def power_of(frequency_hz: Array, lines_hz: Array, white_v: float, sd_v: float, slope: float) -> Array:
    """Return the power of noise whose coloured part has rms ``sd_v`` over the lines of a recording, V^2."""
    return np.asarray(white_v**2 + sd_v**2 / mean_law(lines_hz, slope) * frequency_hz**-slope)


def mean_law(lines_hz: Array, slope: float) -> float:
    """Return the mean of ``lines_hz`` to the power of -slope over lines that are evenly apart.

    The first, where it falls much from line to line, one by one; the rest by the Euler-Maclaurin formula (DLMF 2.10.1).
    """
    few = lines_hz[:ONE_BY_ONE]
    total = float(np.sum(few**-slope))
    if lines_hz.size > few.size:
        low, high, apart = float(few[-1]), float(lines_hz[-1]), float(few[-1] - few[-2])
        folds = log(high / low)
        total += low ** (1.0 - slope) * folds * float(exprel((1.0 - slope) * folds)) / apart
        total += 0.5 * (high**-slope - low**-slope)
        total -= apart * slope / 12.0 * (high ** (-slope - 1.0) - low ** (-slope - 1.0))
    return total / lines_hz.size


def lines_of(trace: Trace) -> Array:
    """Return the frequencies of a recording, from one period in it to half its rate, Hz."""
    return np.asarray(trace.rate_hz / trace.size * np.arange(1, trace.size // 2 + 1))


def spectra(traces: Sequence[Trace], settle_s: float) -> list[Spectrum]:
    """Return the power of the difference between the repeats of every recording that has any."""
    return [_spectrum(trace, *pair) for trace in traces for pair in repeats(trace, settle_s)]


def repeats(trace: Trace, settle_s: float) -> Iterator[tuple[int, int]]:
    """Yield where pairs of repeats begin, and how many samples they are apart and long."""
    for first, stop, period in repeated(trace, round(settle_s * trace.rate_hz)):
        lag = (stop - first) // (2 * period) * period
        if lag >= LEAST:
            yield first, lag


def difference(trace: Trace, first: int, lag: int) -> tuple[Array, Mask]:
    """Return the difference between two stretches ``lag`` samples apart, freed of drifts, and which of it counts."""
    use = good(trace)[first : first + lag] & good(trace)[first + lag : first + 2 * lag]
    once, again = trace.y[first : first + lag], trace.y[first + lag : first + 2 * lag]
    t, mean = np.linspace(-1.0, 1.0, lag), 0.5 * (once + again)
    columns = np.stack((np.ones(lag), t, mean, t * mean, np.gradient(mean)), axis=1)
    difference = np.where(use, again - once, 0.0) / np.sqrt(2.0)
    return difference - columns @ np.linalg.lstsq(columns, difference, rcond=None)[0], use


def _spectrum(trace: Trace, first: int, lag: int) -> Spectrum:
    """Return the periodogram of the difference between two stretches ``lag`` samples apart, freed of drifts."""
    return spectrum(trace, *difference(trace, first, lag))


def spectrum(trace: Trace, noise: Array, use: Mask) -> Spectrum:
    """Return the periodogram of noise in a recording, V, shape (n,), where it counts.

    Seen through a window of Hann, every second ordinate stands for itself.
    """
    window = np.hanning(noise.size)
    power = np.square(np.abs(np.fft.rfft(np.where(use, noise, 0.0) * window))) / float(window @ (window * use))
    frequency = np.fft.rfftfreq(noise.size, 1.0 / trace.rate_hz)
    kept = np.arange(frequency.size) % 2 == 0
    kept[:LOWEST], kept[-1] = False, False
    for line in np.outer(MAINS_HZ, np.arange(1, HARMONICS + 1)).ravel():
        kept &= np.abs(frequency - line) > max(BESIDE_MAINS_HZ, 3.0 * trace.rate_hz / noise.size)
    return _gathered(frequency[kept], power[kept], lines_of(trace))


def _gathered(frequency: Array, power: Array, lines_hz: Array) -> Spectrum:
    """Return a spectrum by means over narrow bands, even in log frequency."""
    band = np.floor(BANDS * np.log10(frequency)).astype(np.int64)
    _, which, count = np.unique(band, return_inverse=True, return_counts=True)
    middle, mean = (np.bincount(which, values) / count for values in (frequency, power))
    return Spectrum(middle, mean, count.astype(np.float64), lines_hz)
