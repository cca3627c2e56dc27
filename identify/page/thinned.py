"""Which points of a long signal does a picture need, so that it stays small and no peak is lost?"""

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array, Mask

Cells = NDArray[np.int64]

BINS = 400  # columns of the area of a long signal's extremes
LATTICE = 1500  # parts across a picture: more than it has pixels
INSIDE = 0.95  # share of the columns in which noise alone stays within its band


def envelope(values: Array, bins: int = BINS) -> tuple[Array, Array, Array]:
    """Return sample index (M,), lowest and highest value (M,) of at most ``bins`` stretches; NaN is passed over."""
    size = values.size
    if size <= 2 * bins:
        return np.arange(size, dtype=np.float64), values, values
    first = np.linspace(0, size, bins, endpoint=False).astype(np.int64)
    low, high = np.fmin.reduceat(values, first), np.fmax.reduceat(values, first)
    middle = 0.5 * (first + np.append(first[1:], size) - 1)
    return middle, np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)


def spread(time: Array, values: Array) -> tuple[Array, Array, Array]:
    """Return times (M,), lowest and highest value (M,) to draw a signal by; both are the signal where it is short."""
    index, low, high = envelope(values)
    return (time, values, values) if low is high else (np.interp(index, np.arange(time.size), time), low, high)


def noise_reach(size: int, bins: int = BINS) -> float:
    """Return within how many standard deviations white noise of ``size`` samples stays in 95 of 100 columns drawn."""
    from scipy.special import ndtri

    column = 1.0 if size <= 2 * bins else size / bins
    return float(ndtri(0.5 * (1.0 + INSIDE ** (1.0 / column))))


def outline(x: Array, y: Array) -> tuple[Array, Array]:
    """Return a path in the plane with each piece of it once, NaN between pieces; detail too fine to see is lost."""
    cell = cells(x) * LATTICE + cells(y)
    moved = np.flatnonzero(np.diff(cell))
    pieces = np.unique(cell[moved] * LATTICE**2 + cell[moved + 1])
    begins, ends = np.divmod(pieces, LATTICE**2)
    points = np.column_stack((begins, ends))
    return _between_gaps(x, points // LATTICE), _between_gaps(y, points % LATTICE)


def cells(x: Array) -> Cells:
    """Return which of ``LATTICE`` equal parts of its range every value of x is in."""
    return np.asarray(np.rint((x - np.min(x)) / (float(np.ptp(x)) or 1.0) * (LATTICE - 1)), dtype=np.int64)


def _between_gaps(x: Array, pairs: Cells) -> Array:
    """Return the values of x that pairs of cells (M, 2) stand for, NaN behind every pair, shape (3 M,)."""
    values = np.min(x) + pairs * float(np.ptp(x)) / (LATTICE - 1)
    return np.asarray(np.column_stack((values, np.full(values.shape[0], np.nan))).ravel(), dtype=np.float64)


def longest_stretch(use: Mask) -> slice:
    """Return the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], use, [False])).astype(np.int8)))
    starts, stops = edges[::2], edges[1::2]
    if starts.size == 0:
        return slice(0, 0)
    at = int(np.argmax(stops - starts))
    return slice(int(starts[at]), int(stops[at]))
