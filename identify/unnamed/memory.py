"""Which free-form laws change the gap: bent borders, a gap that is not constant, a way past it, plateaus that creep?"""

from dataclasses import dataclass

import numpy as np

from identify import altered_kernels, kernels
from identify.blocks import run_play
from identify.stage import Block, Grid, Run, Values
from identify.trace import Array
from identify.unnamed.correction import PlayCorrection
from identify.unnamed.maps import spline


@dataclass(frozen=True)
class BorderMap(PlayCorrection):
    """A map of level and branch: each border of the backlash bent in its own way over v."""

    form = "map of level and branch"
    kind = "a law of its own on either border of the backlash"
    equation = "border L: S_L (v - D_L) + c_L(v), border U: S_U (v - D_U) + c_U(v), both cubic splines"
    knot_unit = "V"
    weights = (("L", "V"), ("U", "V"))
    least = 4
    even = True

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator between the bent borders."""
        s_l, d_l, s_u, d_u = borders
        curves = [spline(self.knots, part) for part in self.split(values)]
        first, step, w = self.knots[0], self.knots[1] - self.knots[0], 0.0

        def run(block: Block) -> Array:
            nonlocal w
            bent = [np.empty_like(block.signal) for _ in curves]
            for curve, out in zip(curves, bent, strict=True):
                kernels.plus_curve(first, step, curve, block.signal, out)
            lower = bent[0] + (s_l - 1.0) * block.signal - s_l * d_l
            upper = bent[1] + (s_u - 1.0) * block.signal - s_u * d_u
            w = kernels.play_between(lower, upper, w, lower)
            return np.asarray(lower)

        return run


@dataclass(frozen=True)
class Leak(PlayCorrection):
    """What of v comes through to w whatever the gap does: a map of v, added behind it."""

    form = "map past the gap"
    kind = "a path past the gap"
    equation = "w' = w + c(v), c a cubic spline through the knots"
    knot_unit = "V"
    least = 4
    even = True

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "level of v"

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator plus the map of what enters it."""
        rows, first, step = spline(self.knots, self.split(values)[0]), self.knots[0], self.knots[1] - self.knots[0]
        plain = run_play(borders)

        def run(block: Block) -> Array:
            passed = np.empty_like(block.signal)
            kernels.plus_curve(first, step, rows, block.signal, passed)
            return np.asarray(plain(block) + passed - block.signal)

        return run


@dataclass(frozen=True)
class Plateau(PlayCorrection):
    """A flow on plateaus: while neither border holds w, it creeps at a rate that depends on its level."""

    form = "creep on plateaus"
    kind = "a creep on plateaus"
    equation = "between the borders dw/dt = c(w), c straight between the knots, beyond them as at the last"
    knot_unit = "V"
    weights = (("creep", "V/s"),)
    even = True

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "time on a plateau"

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator whose w creeps."""
        s_l, d_l, s_u, d_u = borders
        moves = np.array(values) * grid.step_s
        first, step, w = self.knots[0], self.knots[1] - self.knots[0], 0.0

        def run(block: Block) -> Array:
            nonlocal w
            lower, upper = s_l * (block.signal - d_l), s_u * (block.signal - d_u)
            w = altered_kernels.creeping_play(lower, upper, first, step, moves, w, lower)
            return np.asarray(lower)

        return run
