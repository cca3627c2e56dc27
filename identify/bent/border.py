"""What is the shape of a border of the backlash that is not straight?

A border is points (v, w) that rise, joined by a cubic spline: twice differentiable, exact for a line and for a cubic,
off by the fourth power of the distance of the points for any other smooth curve. Where such a spline would fall
between points, its slope there is held to what keeps every piece rising (Fritsch and Carlson, SIAM J. Numer. Anal. 17
(1980) 238); dw/dv stays continuous. Beyond the first and last point the border goes on straight.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.model import CurvedBacklash, Points
from identify.trace import Array

FLATTEST, STEEPEST = 0.1, 3.0  # slope at a point over the rises beside it that keeps a piece rising
BETWEEN = 16  # places looked at between two points


@dataclass(frozen=True)
class Border:
    """A border as pieces: the i-th holds up to ``knots[i]``, the last beyond all of them.

    On a piece w = sum over k of rows[i, k] (v - origins[i])^k, all in V.
    """

    knots: Array
    origins: Array
    rows: NDArray[np.float64]

    def at(self, v: Array) -> Array:
        """Return w on the border, V, at v, V."""
        piece = np.searchsorted(self.knots, v)
        t, c = v - self.origins[piece], self.rows[piece]
        return np.asarray(c[:, 0] + t * (c[:, 1] + t * (c[:, 2] + t * c[:, 3])))


def border(v: Array, w: Array) -> Border:
    """Return the border through points; ValueError unless there are two at least and both columns rise."""
    if v.size < 2:
        raise ValueError("a border takes two points at least")
    width, rise = np.diff(v), np.diff(w)
    if not (np.all(width > 0.0) and np.all(rise > 0.0)):
        raise ValueError("the points of a border rise in v and in w")
    mean = rise / width
    slope = slopes(v, w)
    first, second = slope[:-1], slope[1:]
    rows = np.zeros((v.size + 1, 4))
    rows[1:-1] = np.column_stack(
        (w[:-1], first, (3.0 * mean - 2.0 * first - second) / width, (first + second - 2.0 * mean) / width**2)
    )
    rows[0, :2], rows[-1, :2] = (w[0], slope[0]), (w[-1], slope[-1])
    return Border(v, np.concatenate((v[:1], v)), rows)


def slopes(v: Array, w: Array) -> Array:
    """Return dw/dv at every point: of the cubic spline, held between bounds by the mean slopes beside it."""
    from scipy.interpolate import CubicSpline

    mean = np.diff(w) / np.diff(v)
    free = CubicSpline(v, w)(v, 1)
    beside = np.column_stack((np.concatenate((mean[:1], mean)), np.concatenate((mean, mean[-1:]))))
    least = np.min(beside, axis=1)
    return np.asarray(np.clip(free, FLATTEST * least, STEEPEST * least))


def of_points(points: Points) -> Border:
    """Return the border through the points of a model; ValueError unless they rise."""
    table = np.array(points, dtype=np.float64).reshape(-1, 2)
    return border(table[:, 0], table[:, 1])


def crossing(f: CurvedBacklash) -> tuple[float, float, float] | None:
    """Return v and both levels, V, where the loading border lies highest above the unloading one; None when nowhere."""
    loading, unloading = of_points(f.loading), of_points(f.unloading)
    knots = np.unique(np.concatenate((loading.knots, unloading.knots)))
    place = np.arange(BETWEEN * (knots.size - 1) + 1) / BETWEEN
    v = np.interp(place, np.arange(knots.size), knots)
    low, high = loading.at(v), unloading.at(v)
    worst = int(np.argmax(low - high))
    return (float(v[worst]), float(low[worst]), float(high[worst])) if low[worst] > high[worst] else None
