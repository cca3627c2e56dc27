"""At which frequencies does a residual have its power?"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import next_fast_len, rfft

from identify.trace import Array, Mask

PADDED = 4  # zeros to as many times the length: the peak of a line is near one of the frequencies


@dataclass(frozen=True)
class Spectrum:
    """Power at equally spaced frequencies, shape (m,): of white noise of variance one it is 2 on average."""

    step_hz: float
    gains: Array

    def at(self, frequency_hz: Array) -> Array:
        """Return the power at the nearest of the frequencies; none where samples cannot show it."""
        nearest = np.rint(frequency_hz / self.step_hz).astype(np.int64)
        return np.where(nearest < self.gains.size, self.gains[np.minimum(nearest, self.gains.size - 1)], 0.0)

    def median(self, low_hz: float, high_hz: float) -> float:
        """Return the median power from one frequency to another; 0 where samples show none of them."""
        between = self.gains[max(round(low_hz / self.step_hz), 0) : max(round(high_hz / self.step_hz) + 1, 0)]
        return float(np.median(between)) if between.size else 0.0


def spectrum_of(residual: Array, use: Mask, sample_s: float) -> Spectrum:
    """Return the spectrum of a residual in units of the noise, shape (N,), of which the samples in ``use`` count.

    Under a Hann window, so that what is strong far off does not show.
    """
    size = next_fast_len(PADDED * residual.size, real=True)
    weights = np.where(use, np.hanning(residual.size), 0.0)
    lines = rfft(residual * weights, size)
    return Spectrum(1.0 / (size * sample_s), np.square(np.abs(lines)) * (2.0 / max(float(weights @ weights), 1e-300)))
