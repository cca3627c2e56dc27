"""The stage of a backlash whose borders are bent: eq. (7) between any two rising curves (the paper's own outlook)."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from identify import kernels
from identify.bent.border import Border, border
from identify.model import CurvedBacklash, Points
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Stage, Values
from identify.trace import Array

SIDES = {"L": "loading", "U": "unloading"}


@dataclass(frozen=True)
class CurvedPlay(Stage):
    """F with memory and bent borders, starting from w as close to 0 as the borders allow.

    The knots in v stay; of each border the level at its middle knot is fitted, and the rises from knot to knot in log
    coordinates, so that no search ever meets a border that falls.
    """

    start: CurvedBacklash
    name: str = "F"
    place: Place = Place.F

    def parameters(self) -> tuple[Parameter, ...]:
        """Return ``F.L.level, F.L.rise1, ... , F.U.level, F.U.rise1 ...``."""
        return (*_parameters("L", self.start.loading), *_parameters("U", self.start.unloading))

    def start_values(self) -> Values:
        """Return the values of the borders the stage was made with."""
        return (*_values(self.start.loading), *_values(self.start.unloading))

    def backlash(self, values: Values) -> CurvedBacklash:
        """Return the borders at fitted values, as points."""
        count = len(self.start.loading)
        return CurvedBacklash(
            _points(self.start.loading, values[:count]), _points(self.start.unloading, values[count:])
        )

    def borders(self, values: Values) -> tuple[Border, Border]:
        """Return the loading and the unloading border at fitted values; ValueError where a rise is lost in rounding."""
        count = len(self.start.loading)
        return _border(self.start.loading, values[:count]), _border(self.start.unloading, values[count:])

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running operator."""
        low, high = self.borders(values)
        w = 0.0

        def run(block: Block) -> Array:
            nonlocal w
            out = np.empty_like(block.signal)
            w = kernels.curved_play(
                low.knots, low.origins, low.rows, high.knots, high.origins, high.rows, w, block.signal, out
            )
            return out

        return run, shape


def _parameters(side: str, points: Points) -> tuple[Parameter, ...]:
    """Return the parameters of one border: its level at the middle knot, then its rises."""
    middle = points[len(points) // 2][0]
    level = Parameter(f"F.{side}.level", "V", scale=0.3 * (points[-1][1] - points[0][1]),
                      label=f"level of the {SIDES[side]} border at v = {middle:.4g} V")  # fmt: skip
    rises = (
        Parameter(f"F.{side}.rise{i}", "V", "log", label=f"rise of the {SIDES[side]} border, v = {a:.4g} to {b:.4g} V")
        for i, ((a, _), (b, _)) in enumerate(pairwise(points), start=1)
    )
    return (level, *rises)


def _values(points: Points) -> Values:
    """Return level and rises of the points of a border."""
    levels = [w for _, w in points]
    return (levels[len(levels) // 2], *(b - a for a, b in pairwise(levels)))


def _levels(values: Values) -> Array:
    """Return w at the knots from level and rises: the inverse of ``_values``."""
    from_first = np.concatenate(([0.0], np.cumsum(values[1:])))
    return np.asarray(from_first + (values[0] - from_first[len(values) // 2]))


def _points(points: Points, values: Values) -> Points:
    """Return the points of a border at fitted values."""
    return tuple((v, float(w)) for (v, _), w in zip(points, _levels(values), strict=True))


def _border(points: Points, values: Values) -> Border:
    """Return a border at fitted values."""
    return border(np.array([v for v, _ in points]), _levels(values))
