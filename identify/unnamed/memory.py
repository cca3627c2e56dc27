"""Which free-form laws change the gap: bent borders, a gap that is not constant, a way past it, plateaus that creep?"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify import kernels
from identify.blocks import Play, run_play
from identify.chain import Chain
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction, PlayCorrection
from identify.unnamed.maps import rate_of, spline

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
    weights: ClassVar[tuple[tuple[str, str], ...]] = (("widen", "V"),)

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "rate of v"

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator whose gap follows the speed."""
        return widened_play(borders, *(self._widened(part, grid) for part in self.split(values)))

    def _widened(self, values: Array, grid: Grid) -> Run:
        """Return by how much a border is farther out, V."""
        rate = rate_of(grid)
        return lambda block: np.interp(np.abs(rate(block)), self.knots, values)


@dataclass(frozen=True)
class BorderOverRate(GapOverRate):
    """Contact later or sooner by how fast v moves, on either side by a law of its own: one diode of two, say."""

    form = "either border over the rate"
    kind = "a border that depends on the speed"
    equation = "D_L + c_L(abs(dv/dt)), D_U - c_U(abs(dv/dt)), both straight between the knots"
    weights = (("L", "V"), ("U", "V"))


@dataclass(frozen=True)
class GapAfterTurn(PlayCorrection):
    """A gap that remembers how far v last went before it turned."""

    form = "gap after a turn"
    kind = "a gap that depends on where the signal last turned"
    equation = "D_L + c_L(abs(v_0)), D_U - c_U(abs(v_0)), v_0 where v turned last, both straight between the knots"
    knot_unit = "V"
    weights = (("L", "V"), ("U", "V"))

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "level of v"

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator whose gap follows the last turn."""
        lower, upper = (self._widened(part) for part in self.split(values))
        return widened_play(borders, lower, upper)

    def _widened(self, values: Array) -> Run:
        """Return by how much a border is farther out, V."""
        last, up, turned = 0.0, 0.0, 0.0

        def widened(block: Block) -> Array:
            nonlocal last, up, turned
            v = np.concatenate(([last], block.signal))
            moves = np.diff(v)
            way = _kept(np.concatenate(([up], np.where(np.abs(moves) > REST_V, np.sign(moves), 0.0))))
            turns = way[1:] * way[:-1] < 0.0
            latest = np.maximum.accumulate(np.where(turns, np.arange(turns.size), -1))
            at = np.where(latest >= 0, np.abs(v[latest]), turned)
            last, up, turned = float(v[-1]), float(way[-1]), float(at[-1])
            return np.interp(at, self.knots, values)

        return widened


@dataclass(frozen=True)
class GapAfterPeak(GapAfterTurn):
    """A gap that gives way for good: it remembers how far v ever went in the run."""

    form = "gap after the farthest"
    kind = "a gap that depends on how far the signal ever went"
    equation = "D_L + c_L(p), D_U - c_U(p), p the largest abs(v) of the run so far, both straight between the knots"

    def _widened(self, values: Array) -> Run:
        """Return by how much a border is farther out, V."""
        farthest = 0.0

        def widened(block: Block) -> Array:
            nonlocal farthest
            ever = np.maximum.accumulate(np.concatenate(([farthest], np.abs(block.signal))))
            farthest = float(ever[-1])
            return np.interp(ever[1:], self.knots, values)

        return widened


def _kept(signs: Array) -> Array:
    """Return signs with every zero as the one before it."""
    latest = np.maximum.accumulate(np.where(signs != 0.0, np.arange(signs.size), 0))
    return np.asarray(signs[latest])


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


def widened_play(borders: Values, widened: Run, other: Run | None = None) -> Run:
    """Return the play operator whose half gap is wider by a running signal, V; by an ``other`` one at the border U."""
    s_l, d_l, s_u, d_u = borders
    w = 0.0

    def run(block: Block) -> Array:
        nonlocal w
        wider = widened(block)
        further = wider if other is None else other(block)
        lower, upper = s_l * (block.signal - d_l - wider), s_u * (block.signal - d_u + further)
        w = kernels.play_between(lower, upper, w, lower)
        return np.asarray(lower)

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
