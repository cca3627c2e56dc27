"""Which free-form laws add hysteresis of their own: further plays, relays?"""

from dataclasses import dataclass

import numpy as np

from identify import kernels
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction


@dataclass(frozen=True)
class Hysteresis(Correction):
    """Further plays with half gaps at the knots, so that turning points other than F's matter (Prandtl-Ishlinskii)."""

    form = "second hysteresis"
    kind = "a second hysteresis"
    equation = "s' = s + sum of a_k (play of s with half gap r_k, less s)"
    quick = True
    knot_unit = "V"
    weights = (("weight", "V/V"),)
    places = (Place.SOURCE, Place.G1, Place.F, Place.SENSE)
    curved = False
    least = 1

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "branch"

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the weighted plays."""
        used = [(weight, r) for weight, r in zip(values, self.knots, strict=True) if weight]
        levels = [0.0] * len(used)

        def run(block: Block) -> Array:
            out = block.signal.copy()
            wider = np.empty_like(out)
            for i, (weight, r) in enumerate(used):
                levels[i] = kernels.play(1.0, r, 1.0, -r, levels[i], block.signal, wider)
                out += weight * (wider - block.signal)
            return out

        return run


@dataclass(frozen=True)
class Relays(Correction):
    """Something that switches on above a level and off below minus that level, a relay for every knot (Preisach).

    It adds something, or a gain.
    """

    form = "relays"
    kind = "something that switches with hysteresis"
    equation = "s' = s + sum of (a_k + b_k s) R_k, R_k = 1 from s > r_k on, 0 from s < -r_k on"
    knot_unit = "V"
    weights = (("switch", "V"), ("gain", "V/V"))
    places = (Place.G1, Place.F, Place.SENSE)
    curved = False
    least = 1
    single = True
    jumps = True

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "branch"

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus what is switched on."""
        used = [(a, b, r) for a, b, r in zip(*self.split(values), self.knots, strict=True) if a or b]
        states = np.zeros(len(used))

        def run(block: Block) -> Array:
            out = block.signal.copy()
            for i, (a, b, r) in enumerate(used):
                events = np.where(block.signal > r, 1, np.where(block.signal < -r, -1, 0))
                latest = np.maximum.accumulate(np.where(events != 0, np.arange(events.size), -1))
                on = np.where(latest >= 0, events[latest] > 0, states[i] > 0.0)
                states[i] = float(on[-1])
                out += (a + b * block.signal) * on
            return out

        return run
