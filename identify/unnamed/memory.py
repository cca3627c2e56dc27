"""Which free-form laws change the hysteresis: bent borders, further plays, a creep, a gap that is not constant?"""

from dataclasses import dataclass

import numpy as np

from identify import kernels
from identify.blocks import Play
from identify.chain import Chain
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction, PlayCorrection
from identify.unnamed.maps import spline

REST_V = 1e-9  # a level that moves less than this between two instants rests


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

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "branch"

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
class GapOverRate(PlayCorrection):
    """Contact later or sooner on both sides by a law of how fast v moves."""

    form = "gap over the rate"
    kind = "a gap that depends on the speed"
    equation = "D_L + c(abs(dv/dt)), D_U - c(abs(dv/dt)), c straight between the knots"
    quick = True
    knot_unit = "V/s"
    weights = (("widen", "V"),)

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "rate of v"

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator whose gap follows the speed."""
        last: float | None = None

        def widened(block: Block) -> Array:
            nonlocal last
            speed = np.abs(np.diff(block.signal, prepend=block.signal[0] if last is None else last)) / grid.step_s
            last = float(block.signal[-1])
            return np.interp(speed, self.knots, values)

        return widened_play(borders, widened)


@dataclass(frozen=True)
class GapOverClock(PlayCorrection):
    """A gap that grows or shrinks with the clock: wear, warmth."""

    form = "drift of the gap"
    kind = "a drift of the gap"
    equation = "D_L + c(t), D_U - c(t), c straight between the knots, t the clock"
    knot_unit = "s"
    weights = (("widen", "V"),)

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "clock time"

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator whose gap follows the clock."""
        return widened_play(borders, lambda block: np.interp(block.time_s(), self.knots, values))


def widened_play(borders: Values, widened: Run) -> Run:
    """Return the play operator whose half gap is wider by a running signal, V."""
    s_l, d_l, s_u, d_u = borders
    w = 0.0

    def run(block: Block) -> Array:
        nonlocal w
        wider = widened(block)
        lower, upper = s_l * (block.signal - d_l - wider), s_u * (block.signal - d_u + wider)
        w = kernels.play_between(lower, upper, w, lower)
        return np.asarray(lower)

    return run


@dataclass(frozen=True)
class Hysteresis(Correction):
    """Further plays with half gaps at the knots, so that turning points other than F's matter (Prandtl-Ishlinskii)."""

    form = "second hysteresis"
    kind = "a second hysteresis"
    equation = "s' = s + sum of a_k (play of s with half gap r_k, less s)"
    quick = True
    knot_unit = "V"
    weights = (("weight", "V/V"),)
    places = (Place.F, Place.SENSE)
    curved = False
    least = 1

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "branch"

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the weighted plays."""
        levels = [0.0] * len(self.knots)

        def run(block: Block) -> Array:
            out = block.signal.copy()
            wider = np.empty_like(out)
            for i, (weight, r) in enumerate(zip(values, self.knots, strict=True)):
                levels[i] = kernels.play(1.0, r, 1.0, -r, levels[i], block.signal, wider)
                out += weight * (wider - block.signal)
            return out

        return run


@dataclass(frozen=True)
class Plateau(Correction):
    """A flow on plateaus: while the signal rests, it creeps at a rate that depends on its level."""

    form = "creep on plateaus"
    kind = "a creep on plateaus"
    equation = "on plateaus ds/dt = c(s), c straight between the knots"
    knot_unit = "V"
    weights = (("creep", "V/s"),)
    places = (Place.F,)

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "time on a plateau"

    def applicable(self, chain: Chain) -> bool:
        """Return whether there are plateaus."""
        return chain.stage_of(Play) is not None

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus what has crept since it last moved."""
        last, crept = 0.0, 0.0

        def run(block: Block) -> Array:
            nonlocal last, crept
            moved = np.abs(np.diff(block.signal, prepend=last)) > REST_V
            creep = np.interp(block.signal, self.knots, values) * grid.step_s
            total = crept + np.cumsum(np.where(moved, 0.0, creep))
            since = np.maximum.accumulate(np.where(moved, np.arange(moved.size), -1))
            base = np.where(since >= 0, total[since], 0.0)
            out = block.signal + total - base
            last, crept = float(block.signal[-1]), float(total[-1] - base[-1])
            return np.asarray(out)

        return run
