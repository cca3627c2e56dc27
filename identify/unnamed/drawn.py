"""Which current that hangs on the level loads a filter: a varistor, a leaking capacitor, diodes across a resistor?"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify import loading
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.maps import OverLevel, spline


@dataclass(frozen=True)
class Drawn(OverLevel):
    """A current drawn from the capacitor of a filter, by a law of its own level, V over the filter's resistance.

    To what the filter would put out it adds what the capacitor makes of that current: at rest it is a bent scale, on
    the way it comes later than one. ``tau`` is the time constant of resistance and capacitor, s.
    """

    form = "current over the level"
    kind = "a load current that goes with the level"
    equation = "s' = s - e, tau de/dt = c(s') - e, c a cubic spline through the knots, beyond them as at the last"
    knot_unit = "V"
    weights = (("draw", "V"),)
    places = (Place.G1, Place.G2)
    constants: ClassVar[tuple[tuple[str, str], ...]] = (("tau", "s"),)
    least = 4
    even = True
    sums = False  # the level that it hangs on is what is left
    tau: float = 1e-3

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return what is left of the signal, the capacitor without charge at first."""
        rows, first, step = spline(self.knots, self.split(values)[0]), self.knots[0], self.knots[1] - self.knots[0]
        state = (0.0, 0.0)

        def run(block: Block) -> Array:
            nonlocal state
            out = np.empty_like(block.signal)
            state = loading.loaded(first, step, rows, self.tau / grid.step_s, state, block.signal, out)
            return out

        return run
