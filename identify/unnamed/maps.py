"""Which free-form laws act on a level: the signal's own, or that of the source?"""

from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from identify import kernels
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.what import Gain, Going, Offset

LEVELS = {
    Place.SOURCE: "level of u", Place.G1: "level of v", Place.F: "level of w", Place.G2: "level of x",
    Place.SENSE: "level of y",
}  # fmt: skip
RATES = {place: level.replace("level", "rate") for place, level in LEVELS.items()}


def spline(knots: tuple[float, ...], values: Array) -> Array:
    """Return the natural cubic spline through evenly spaced knots, a row (4,) of ascending powers a piece.

    The last row is the straight line that goes on beyond the last knot.
    """
    return np.asarray(np.tensordot(_cardinal(knots), values, axes=1))


@lru_cache(maxsize=64)
def _cardinal(knots: tuple[float, ...]) -> NDArray[np.float64]:
    """Return the rows of the splines that are one at a single knot, shape (K, 4, K): a spline is a sum of these."""
    curve = CubicSpline(knots, np.eye(len(knots)), bc_type="natural")
    rows = np.zeros((len(knots), 4, len(knots)))
    rows[:-1] = np.moveaxis(curve.c[::-1], 1, 0)
    rows[-1, :2] = np.eye(len(knots))[-1], curve(knots[-1], 1)
    return rows


@dataclass(frozen=True)
class OverLevel(Correction):
    """A law that goes with the signal's own level."""

    @property
    def axis(self) -> str:
        """Return the level of the signal at the place."""
        return LEVELS[self.place]


@dataclass(frozen=True)
class LevelMap(OverLevel):
    """A memoryless law of the signal's own level: a natural cubic spline over it, straight beyond its ends."""

    form = "map of the level"
    kind = "a memoryless law"
    equation = "s' = s + c(s), c a cubic spline through the knots"
    knot_unit = "V"
    places = tuple(Place)
    least = 4
    even = True
    at_once = True

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the spline of it."""
        rows, first, step = spline(self.knots, self.split(values)[0]), self.knots[0], self.knots[1] - self.knots[0]

        def run(block: Block) -> Array:
            out = np.empty_like(block.signal)
            kernels.plus_curve(first, step, rows, block.signal, out)
            return out

        return run


@dataclass(frozen=True)
class BrokenMap(OverLevel):
    """A memoryless law of the signal's own level that jumps and bends at the knots and is straight between."""

    form = "corners of the level"
    kind = "a memoryless law with corners"
    equation = "s' = s + sum of j_k (s > c_k) + b_k max(s - c_k, 0)"
    knot_unit = "V"
    weights = (("jump", "V"), ("bend", "V/V"))
    places = tuple(Place)
    least = 1
    at_once = True

    @property
    def outward(self) -> Array:
        """Return the side of every corner on which it acts: 1 above it, -1 below it, shape (knots,)."""
        return np.ones(len(self.knots))

    def shapes(self, level: Array) -> NDArray[np.float64]:
        """Return what a unit of every weight adds at levels, V, shape (weights, levels)."""
        outward, above = self.outward[:, None], level - np.array(self.knots)[:, None]
        beyond = above * outward > 0.0
        return np.concatenate([np.where(beyond, outward, 0.0), np.where(beyond, above, 0.0)])

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the jumps and bends."""
        corners, sides, (jumps, bends) = np.array(self.knots), self.outward, self.split(values)
        used = (jumps != 0.0) | (bends != 0.0)
        corners, sides, jumps, bends = corners[used], sides[used], (jumps * sides)[used], bends[used]

        def run(block: Block) -> Array:
            out = np.empty_like(block.signal)
            kernels.plus_corners(corners, sides, jumps, bends, block.signal, out)
            return out

        return run


@dataclass(frozen=True)
class OuterMap(BrokenMap):
    """The same, of which every corner acts beyond it as seen from zero, where signals rest: rails, say.

    To first order it is the same law, as the plain values make up for any straight line; far from it, it is not.
    """

    form = "corners outwards"
    equation = "s' = s + sum of j_k sign(c_k) + b_k (s - c_k) over the corners c_k that s is beyond, as seen from zero"

    @property
    def outward(self) -> Array:
        """Return 1 for every corner that is not below zero, else -1."""
        return np.where(np.array(self.knots) < 0.0, -1.0, 1.0)


@dataclass(frozen=True)
class LevelTable(OverLevel):
    """An error of its own at every level that the source rests on, straight between: codes of a DAC, say."""

    form = "table of the level"
    kind = "an error of its own at every level held"
    equation = "s' = s + c(s), c straight between the knots"
    knot_unit = "V"
    places = (Place.SOURCE,)
    least = 4

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus what the table says of its level."""
        return lambda block: np.asarray(block.signal + np.interp(block.signal, self.knots, values))


@dataclass(frozen=True)
class OverSource(Going):
    """What goes with what the generator puts out, past the circuit: a natural cubic spline over u."""

    knot_unit = "V"
    places: ClassVar[tuple[Place, ...]] = (Place.SENSE,)
    least = 4
    even = True

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return LEVELS[Place.SOURCE]

    def course(self, weights: Values | Array, grid: Grid) -> Run:
        """Return the spline of the source voltage."""
        rows, first, step = spline(self.knots, np.array(weights)), self.knots[0], self.knots[1] - self.knots[0]

        def run(block: Block) -> Array:
            out = np.empty_like(block.source)
            kernels.plus_curve(first, step, rows, block.source, out)
            return out - block.source

        return run


@dataclass(frozen=True)
class SourceMap(OverSource, Offset):
    """A memoryless law of what the generator puts out, past the circuit."""

    form = "map of the source"
    kind = "a law of the source voltage, past the circuit"
    equation = "s' = s + c(u), c a cubic spline through the knots"


@dataclass(frozen=True)
class SourceGain(OverSource, Gain):
    """A gain that goes with what the generator puts out: a supply that both share, say."""

    form = "gain over the source"
    kind = "a gain that goes with the source voltage"
    equation = "s' = s (1 + c(u)), c a cubic spline through the knots"
    weights = (("grow", "V/V"),)
