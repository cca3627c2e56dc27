"""Which laws come in at one moment of the clock and stay: a joint that cracks, a part that somebody touches?"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.timed import Ageing, PassedOn
from identify.unnamed.what import Gain, Gap, Going, Offset


@dataclass(frozen=True)
class Sudden(Going):
    """A course that is zero until a moment, the last knot, and stays what it is from then on."""

    quick = True
    knot_unit = "s"
    curved = False
    least = 1

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "clock time"

    def course(self, weights: Values | Array, grid: Grid) -> Run:
        """Return the weight from the moment on."""
        return lambda block: np.where(block.time_s() >= self.knots[-1], weights[0], 0.0)


@dataclass(frozen=True)
class SuddenOffset(Sudden, Offset):
    """A zero that leaps."""

    form = "sudden offset"
    kind = "an offset that is there from one moment on"
    equation = "s' = s + c for t >= T, T the knot, t the clock"
    places: ClassVar[tuple[Place, ...]] = (Place.SOURCE, Place.G1, Place.F, Place.SENSE)


@dataclass(frozen=True)
class SuddenGain(Sudden, Gain):
    """A gain that leaps."""

    form = "sudden gain"
    kind = "a gain that is another from one moment on"
    equation = "s' = s (1 + c) for t >= T, T the knot, t the clock"
    weights = (("grow", "V/V"),)
    places = SuddenOffset.places


@dataclass(frozen=True)
class SuddenGap(Sudden, Gap):
    """A gap that leaps."""

    form = "sudden gap"
    kind = "a gap that is another from one moment on"
    equation = "D_L + c_L, D_U - c_U for t >= T, T the knot, t the clock"
    weights = (("L", "V"), ("U", "V"))


@dataclass(frozen=True)
class SuddenDynamics(Ageing):
    """Dynamics that leap."""

    form = "sudden dynamics"
    kind = "dynamics that are others from one moment on"
    equation = "s' = s + sum of a_k s tau_k / (1 + s tau_k) for t >= T, T the last knot, t the clock"
    weights = (("from", "V/V"),)

    def grown(self, block: Block) -> Array:
        """Return 1 from the moment on."""
        return np.where(block.time_s() >= self.knots[-1], 1.0, 0.0)


@dataclass(frozen=True)
class GainSince(PassedOn, SuddenGain):
    """A gain that is another from one run on."""

    form = "gain from a run on"
    kind = "a gain that is another from one run on"
    equation = "s' = s (1 + c) for t >= T, T the knot, between two runs, t the clock"
    places = (Place.G1, Place.SENSE)


SUDDEN = (SuddenOffset, SuddenGain, SuddenGap)
