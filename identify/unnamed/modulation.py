"""Which free-form laws let one thing change another: a load the gain, the level the speed?"""

from dataclasses import dataclass

import numpy as np

from identify.blocks import run_linear
from identify.discretise import stepper
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.maps import LEVELS


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
        lags = [run_linear(stepper((1.0,), (tau, 1.0), grid.step_s, "ramp")) for tau in self.knots]

        def run(block: Block) -> Array:
            load = Block(np.square(block.signal), block.source, block.first, block.grid)
            warmth = sum(a * lag(load) for a, lag in zip(values, lags, strict=True))
            return np.asarray(block.signal * (1.0 + warmth))

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
