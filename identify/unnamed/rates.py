"""Which free-form laws go with how fast a signal moves?"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify import kernels
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.maps import RATES
from identify.unnamed.what import Gain, Gap, Going, Offset


@dataclass(frozen=True)
class OverRate(Correction):
    """A law that goes with how fast the signal moves."""

    quick = True
    knot_unit = "V/s"

    @property
    def axis(self) -> str:
        """Return the rate of the signal at the place."""
        return RATES[self.place]


def rate_of(grid: Grid) -> Run:
    """Return how fast a signal moves, V/s."""
    last: float | None = None

    def run(block: Block) -> Array:
        nonlocal last
        rate = np.diff(block.signal, prepend=block.signal[0] if last is None else last) / grid.step_s
        last = float(block.signal[-1])
        return rate

    return run


@dataclass(frozen=True)
class RateMap(OverRate, Offset):
    """A law of how fast the signal moves, straight between knots."""

    form = "map of the rate"
    kind = "a law of the rate of change"
    equation = "s' = s + c(ds/dt), c straight between the knots"
    places = (Place.G1, Place.F, Place.G2, Place.SENSE)

    def course(self, weights: Values | Array, grid: Grid) -> Run:
        """Return the table at the rate of change."""
        rate = rate_of(grid)
        return lambda block: np.interp(rate(block), self.knots, weights)


@dataclass(frozen=True)
class OverSpeed(OverRate, Going):
    """What goes with how fast the signal moves either way, straight between knots; v in front of F."""

    @property
    def axis(self) -> str:
        """Return the rate of the signal."""
        return RATES[self.followed(self.place)]

    def course(self, weights: Values | Array, grid: Grid) -> Run:
        """Return the table at the speed."""
        rate = rate_of(grid)
        return lambda block: np.interp(np.abs(rate(block)), self.knots, weights)


@dataclass(frozen=True)
class GainOverRate(OverSpeed, Gain):
    """A gain that goes with how fast the signal moves: an amplifier near its limits, say."""

    form = "gain over the rate"
    kind = "a gain that goes with the rate of change"
    equation = "s' = s (1 + c(abs(ds/dt))), c straight between the knots"
    weights = (("grow", "V/V"),)
    places = (Place.G1, Place.F, Place.SENSE)


@dataclass(frozen=True)
class GapOverRate(OverSpeed, Gap):
    """Contact later or sooner on both sides by a law of how fast v moves."""

    form = "gap over the rate"
    kind = "a gap that depends on the speed"
    equation = "D_L + c(abs(dv/dt)), D_U - c(abs(dv/dt)), c straight between the knots"
    weights: ClassVar[tuple[tuple[str, str], ...]] = (("widen", "V"),)


@dataclass(frozen=True)
class BorderOverRate(OverSpeed, Gap):
    """Contact later or sooner by how fast v moves, on either side by a law of its own: one diode of two, say."""

    form = "either border over the rate"
    kind = "a border that depends on the speed"
    equation = "D_L + c_L(abs(dv/dt)), D_U - c_U(abs(dv/dt)), both straight between the knots"
    weights = (("L", "V"), ("U", "V"))


@dataclass(frozen=True)
class Trailing(OverRate):
    """What stays behind a largest rate and catches up afterwards, for every knot: above zero rising, below falling."""

    form = "lag behind a rate"
    kind = "something that cannot follow fast enough"
    equation = "s' = s - sum of a_k e_k, de_k/dt = ds/dt - q_k as long as e_k has the sign of q_k, else 0"
    weights = (("behind", "V/V"),)
    places = (Place.G1, Place.F, Place.G2)
    curved = False
    single = True
    least = 1

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal less what is behind."""
        last: float | None = None
        used = np.flatnonzero(values)
        weights, rates = np.array(values)[used], np.array(self.knots)[used]
        behind = np.zeros(used.size)

        def run(block: Block) -> Array:
            nonlocal last
            out = block.signal.copy()
            before = float(block.signal[0]) if last is None else last
            kernels.less_behind(weights, rates, grid.step_s, behind, before, block.signal, out)
            last = float(block.signal[-1])
            return out

        return run
