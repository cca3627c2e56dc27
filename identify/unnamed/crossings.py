"""What happens as a signal changes its sign: as the largest bit of a DAC turns, or one half of a driver takes over?"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from identify.blocks import run_linear
from identify.discretise import stepper
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.maps import LEVELS


@dataclass(frozen=True)
class Pulse(Correction):
    """A pulse whenever the signal changes its sign, that dies away with a time constant, a knot.

    It may come as the signal goes above zero or no longer is, as it goes below or no longer is, or as it does either.
    """

    form = "pulse at zero"
    kind = "a pulse whenever the signal changes its sign"
    equation = (
        "s' = s + sum of p_k, dp_k/dt = -p_k / tau_k; p_k leaps by a_k as s comes above zero or leaves that, by b_k as "
        "it comes below or leaves that"
    )
    quick = True
    knot_unit = "s"
    weights = (("above", "V"), ("below", "V"))
    places = (Place.SOURCE,)
    curved = False
    single = True
    least = 1

    @property
    def axis(self) -> str:
        """Return the level of the signal."""
        return LEVELS[self.place]

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus its pulses: of leaps held for good, what a lag of them has not followed yet."""
        above, below = self.split(values)
        lags = [
            (a, b, run_linear(stepper((1.0,), (tau, 1.0), grid.step_s, "held")))
            for a, b, tau in zip(above, below, self.knots, strict=True) if a or b
        ]  # fmt: skip
        leapt_above, leapt_below = _changes(1.0), _changes(-1.0)

        def run(block: Block) -> Array:
            ups, downs, out = leapt_above(block.signal), leapt_below(block.signal), block.signal.copy()
            for a, b, lag in lags:
                leaps = a * ups + b * downs
                out += leaps - lag(block.holding(leaps))
            return out

        return run


def _changes(sign: float) -> Callable[[Array], Array]:
    """Return what counts how often a running signal came to have a sign, or lost it."""
    last: bool | None = None
    count = 0.0

    def run(signal: Array) -> Array:
        nonlocal last, count
        there = sign * signal > 0.0
        counts = count + np.cumsum(np.diff(there, prepend=there[0] if last is None else last))
        last, count = bool(there[-1]), float(counts[-1])
        return counts

    return run
