"""Which free-form laws let one thing change another: a load the gain or the gap, the level the speed?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.blocks import run_linear
from identify.discretise import stepper
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction, PlayCorrection
from identify.unnamed.maps import LEVELS
from identify.unnamed.memory import widened_play


@dataclass(frozen=True)
class Warming(Correction):
    """A gain that follows the load of the recent past: the square of the signal behind lags, the knots."""

    form = "gain after load"
    kind = "a gain that follows the load of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = s^2 / (1 + s tau_k) in operator form"
    knot_unit = "s"
    weights = (("warm", "V^-2"),)
    places = (Place.G1, Place.F, Place.SENSE)
    curved = False
    least = 1

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return LEVELS[self.place]

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal times one plus the weighted lags of its square."""
        warmth = _warmth(self.knots, values, grid)
        return lambda block: np.asarray(block.signal * (1.0 + warmth(block)))


@dataclass(frozen=True)
class GapAfterLoad(PlayCorrection):
    """A gap that follows the load of the recent past: the square of v behind lags, the knots."""

    form = "gap after load"
    kind = "a gap that follows the load of the recent past"
    equation = "D_L + c, D_U - c, c = sum of a_k T_k, T_k = v^2 / (1 + s tau_k) in operator form"
    knot_unit = "s"
    weights = (("warm", "V^-1"),)
    curved = False
    least = 1

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return LEVELS[Place.G1]

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator whose gap follows the load."""
        return widened_play(borders, _warmth(self.knots, values, grid))


def _warmth(lags_s: Sequence[float], weights: Values, grid: Grid) -> Run:
    """Return what the square of a signal warms behind lags, weighed."""
    lags = [run_linear(stepper((1.0,), (tau, 1.0), grid.step_s, "ramp")) for tau in lags_s]

    def run(block: Block) -> Array:
        load = Block(np.square(block.signal), block.source, block.first, block.grid)
        return np.asarray(sum(a * lag(load) for a, lag in zip(weights, lags, strict=True)))

    return run


@dataclass(frozen=True)
class Swiftness(Correction):
    """Dynamics that depend on the level: it comes sooner or later by a time that is straight between levels."""

    form = "swiftness over the level"
    kind = "dynamics that depend on the level"
    equation = "s'(t) = s(t + c(s)), c straight between the knots"
    quick = True
    knot_unit = "V"
    weights = (("lead", "s"),)
    places = (Place.G1, Place.G2)

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return LEVELS[self.place]

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return what the signal was or, going on straight, will be."""
        past = max(int(np.ceil(-min(*values, 0.0) / grid.step_s)), 1)
        before: Array | None = None

        def run(block: Block) -> Array:
            nonlocal before
            before = np.full(past, block.signal[0]) if before is None else before
            known = np.concatenate([before, block.signal])
            before = known[-past:]
            steps = np.interp(block.signal, self.knots, values) / grid.step_s
            here = np.arange(past, known.size)
            rate = known[past:] - known[past - 1 : -1]
            was = np.interp(here + np.minimum(steps, 0.0), np.arange(known.size), known)
            return np.asarray(was + np.maximum(steps, 0.0) * rate)

        return run
