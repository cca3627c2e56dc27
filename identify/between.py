"""What is the source voltage between the samples of u?"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from identify.trace import Array, Intersample, Samples, Stored, Trace

AT_ONCE = 1 << 24  # instants of a run that are kept: 128 MB
HALF_WIDTH = 64  # samples to either side that a band-limited signal is drawn from, piece by piece
SIDE_LOBES = 12.0  # of the Kaiser window: what lies above 0.47 of the sample rate is lost, the rest is good to 1e-6


def source_voltage(u: Array, intersample: Intersample, substeps: int, before: float = 0.0) -> Array:
    """Return the source voltage just before each instant, shape (N * substeps,).

    Held: u[k] acts from its own instant on, so the voltage just before it is still u[k-1] (``before`` for k = 0).
    """
    if intersample == "held":
        fine = np.repeat(u, substeps)
        return np.concatenate(([before], fine[:-1]))
    if substeps == 1:
        return u
    if intersample == "bandlimited":
        from scipy.signal import resample

        return np.asarray(resample(u, u.size * substeps), dtype=np.float64)
    sample = np.arange(u.size * substeps) / substeps
    return np.asarray(np.interp(sample, np.arange(u.size), u), dtype=np.float64)


def source_of(trace: Trace, substeps: int) -> Samples:
    """Return the source voltage of a run just before each instant: kept when it is small, else drawn as it is read.

    What is drawn by repeating samples or straight between them is had faster in the cache than kept outside of it.
    """
    drawn_fast = substeps > 1 and trace.intersample != "bandlimited"
    if isinstance(trace.u, np.ndarray) and trace.size * substeps <= AT_ONCE and not drawn_fast:
        return source_voltage(trace.u, trace.intersample, substeps)
    return Drawn(trace.size * substeps, trace.u, trace.intersample, substeps)


@dataclass(frozen=True)
class Drawn(Stored):
    """The source voltage of a run on a grid of ``substeps`` instants to a sample of ``u``, drawn where it is read."""

    u: Samples
    intersample: Intersample
    substeps: int

    def read(self, start: int, stop: int) -> Array:
        """Return the voltage at the instants [start, stop)."""
        first, last = start // self.substeps, -(-stop // self.substeps)
        return self._of_samples(first, last)[start - first * self.substeps : stop - first * self.substeps]

    def _of_samples(self, first: int, stop: int) -> Array:
        """Return the voltage at all instants of the samples [first, stop)."""
        if self.intersample == "held":
            joined = self.u[max(first - 1, 0) : stop]
            before, piece = (float(joined[0]), joined[1:]) if first else (0.0, joined)
            return source_voltage(piece, "held", self.substeps, before)
        if self.substeps == 1:
            return self.u[first:stop]
        if self.intersample == "bandlimited":
            return _band_limited(self.u, first, stop, self.substeps)
        piece = self.u[first : stop + 1]
        sample = np.arange(first * self.substeps, stop * self.substeps) / self.substeps
        return np.asarray(np.interp(sample, np.arange(first, first + piece.size), piece), dtype=np.float64)


def _band_limited(u: Samples, first: int, stop: int, substeps: int) -> Array:
    """Return a stretch of a band-limited signal by windowed sinc interpolation; u stays at its ends beyond them."""
    from scipy.signal import upfirdn

    low, high = first - HALF_WIDTH, stop + HALF_WIDTH
    piece = np.pad(u[max(low, 0) : high], (max(-low, 0), max(high - u.size, 0)), "edge")
    fine = upfirdn(_windowed_sinc(substeps), piece, up=substeps)
    start = 2 * HALF_WIDTH * substeps  # the samples before ``first``, and the delay of the filter
    return np.asarray(fine[start : start + (stop - first) * substeps], dtype=np.float64)


@cache
def _windowed_sinc(substeps: int) -> Array:
    """Return the taps that interpolate between samples."""
    reach = HALF_WIDTH * substeps
    return np.sinc(np.arange(-reach, reach + 1) / substeps) * np.kaiser(2 * reach + 1, SIDE_LOBES)
