"""At which frequencies does a residual have its power?"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len, rfft
from scipy.signal import ZoomFFT

from identify.trace import Array, Mask

Turning = NDArray[np.complex128]

PADDED = 4  # zeros to as many times the length: the peak of a line is near one of the frequencies
AT_ONCE = 0.02  # of a turn
ALIKE = 1e-6  # of what lines make, from below which combinations of them are not told
SLOWEST = 8 * PADDED  # of the frequencies: what makes fewer turns than eight in a run is no line


def highest_peak_hz(residual: Array, use: Mask, sample_s: float) -> float:
    """Return the frequency at which a residual, shape (N,), has its highest peak, Hz, zero excluded.

    Under a Hann window, so that what is strong far off does not show.
    """
    size = next_fast_len(PADDED * residual.size, real=True)
    lines = rfft(residual * np.where(use, np.hanning(residual.size), 0.0), size)
    return (SLOWEST + int(np.argmax(np.abs(lines[SLOWEST:])))) / (size * sample_s)


def turned(products: Turning, use: Mask, sample_s: float, widest_hz: Array, count: int) -> Turning:
    """Return the sums of products turned back, one by -widest_hz to widest_hz of its own each, shape (rows, count).

    ``products`` are of the samples in ``use`` (N,), shape (rows, samples used). They turn slowly: neighbours are added
    before, as many as make ``AT_ONCE`` of the fastest turn at most, which takes 1e-3 of a sum at the ends.
    """
    few = max(int(AT_ONCE / (float(np.max(widest_hz)) * sample_s)), 1)
    whole = np.zeros((products.shape[0], -(-use.size // few) * few), dtype=np.complex128)
    whole[:, : use.size][:, use] = products
    coarse = whole.reshape(products.shape[0], -1, few).sum(axis=2)
    wide, rows = np.unique(widest_hz, return_inverse=True)
    found = np.empty((products.shape[0], count), dtype=np.complex128)
    for i, each in enumerate(wide.tolist()):
        found[rows == i] = _zoom(coarse.shape[1], each, count, 1.0 / (few * sample_s))(coarse[rows == i])
    return found


@lru_cache(maxsize=256)  # runs are as long again and again, and what a transform needs takes longer than the transform
def _zoom(size: int, widest_hz: float, count: int, rate_hz: float) -> ZoomFFT:
    """Return the transform of ``size`` samples to ``count`` frequencies from -widest_hz to widest_hz."""
    return ZoomFFT(size, [-widest_hz, widest_hz], count, fs=rate_hz, endpoint=True)


def matched(
    residual: Array, lines: Turning, orders: Array, use: Mask, sample_s: float, widest_hz: float, count: int
) -> Array:
    """Return the fall of chi-squared by lines together whose first order is off by -widest_hz to widest_hz, (count,).

    ``lines`` are what each, turning in the complex plane, makes of the answer, in units of the noise as ``residual``
    is, of the samples in ``use`` (N,): shape (lines, samples used). Behind a gap two may make nearly the same.
    """
    size = orders.size
    if size == 0:
        return np.zeros(count)
    one, other = np.triu_indices(size)
    against = turned(np.asarray(residual * np.conj(lines)), use, sample_s, orders * widest_hz, count)
    crossed = np.concatenate([np.conj(lines[one]) * lines[other], np.conj(lines[one] * lines[other])])
    turns = np.concatenate([orders[one] - orders[other], orders[one] + orders[other]])
    apart, along = np.conj(turned(crossed, use, sample_s, turns * widest_hz, count)).reshape(2, one.size, count)
    matrix = np.zeros((count, 2, size, 2, size))
    for i, j, p, q in zip(one, other, apart, along, strict=True):  # real parts of the turning lines, then imaginary
        parts = 0.5 * np.array([[p.real + q.real, q.imag - p.imag], [q.imag + p.imag, p.real - q.real]])
        matrix[:, :, i, :, j] = parts.transpose(2, 0, 1)
        matrix[:, :, j, :, i] = parts.transpose(2, 1, 0)
    square = matrix.reshape(count, 2 * size, 2 * size)
    right = np.concatenate([against.real, -against.imag]).T
    solved = np.linalg.pinv(square, hermitian=True, rcond=ALIKE) @ right[:, :, None]
    return np.asarray(np.einsum("ij,ij->i", right, solved[:, :, 0]))
