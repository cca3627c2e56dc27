"""At which frequencies does a residual have its power?"""

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft
from scipy.signal import zoom_fft

from identify.trace import Array, Mask

PADDED = 4  # zeros to as many times the length: the peak of a line is near one of the frequencies
SLOWEST = 8 * PADDED  # of the frequencies: what makes fewer turns than eight in a run is no line


def highest_peak_hz(residual: Array, use: Mask, sample_s: float) -> float:
    """Return the frequency at which a residual, shape (N,), has its highest peak, Hz, zero excluded.

    Under a Hann window, so that what is strong far off does not show.
    """
    size = next_fast_len(PADDED * residual.size, real=True)
    lines = rfft(residual * np.where(use, np.hanning(residual.size), 0.0), size)
    return (SLOWEST + int(np.argmax(np.abs(lines[SLOWEST:])))) / (size * sample_s)


def matched(
    residual: Array, line: NDArray[np.complex128], use: Mask, sample_s: float, widest_hz: float, count: int
) -> Array:
    """Return the power that a residual has of a line whose frequency is off by -widest_hz to widest_hz, shape (count,).

    ``line`` is what the line, turning in the complex plane, makes of the answer, in units of the noise as ``residual``
    is; both are of the samples in ``use`` (N,). Of white noise of variance one the power is 2 on average.
    """
    energy = float(np.sum(np.square(np.abs(line))))
    if energy == 0.0:
        return np.zeros(count)
    product = np.zeros(use.size, dtype=np.complex128)
    product[use] = residual * np.conj(line)
    found = zoom_fft(product, [-widest_hz, widest_hz], count, fs=1.0 / sample_s, endpoint=True)
    return np.asarray(np.square(np.abs(found)) * (2.0 / energy))
