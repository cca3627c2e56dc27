"""Which laws follow the recent past of a signal: its load, its use, its level or its motion, each felt later?"""

from abc import abstractmethod
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify.blocks import run_linear
from identify.discretise import stepper
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.linear import SlowFilter
from identify.unnamed.maps import LEVELS, RATES, OverLevel
from identify.unnamed.rates import rate_of
from identify.unnamed.what import Gain, Gap, Going, Lead, Offset, led


@dataclass(frozen=True)
class Past(Going):
    """A course that is what is felt of a signal behind lags, the knots: the signal of its place, or v in front of F."""

    knot_unit = "s"
    curved = False
    single = True
    least = 1
    axes = LEVELS
    travelled: ClassVar[bool] = False  # whether a rate is felt: the way of the recent past is, a weight times the lag

    @abstractmethod
    def felt(self, grid: Grid) -> Run:
        """Return what of a running signal is felt."""

    def course(self, weights: Values | Array, grid: Grid) -> Run:
        """Return what is felt behind lags, s, weighed."""
        felt_now = self.felt(grid)
        lags = [
            (a * tau if self.travelled else a, run_linear(stepper((1.0,), (tau, 1.0), grid.step_s, "ramp")))
            for a, tau in zip(weights, self.knots, strict=True) if a
        ]  # fmt: skip

        def run(block: Block) -> Array:
            felt = block.holding(felt_now(block))
            return np.asarray(sum((a * lag(felt) for a, lag in lags), np.zeros(felt.signal.size)))

        return run


@dataclass(frozen=True)
class AfterLoad(Past):
    """What follows the load of the recent past: the square of the signal."""

    def felt(self, grid: Grid) -> Run:
        """Return the square of the signal: heat goes with it."""
        return lambda block: np.square(block.signal)


@dataclass(frozen=True)
class AfterUse(Past):
    """What follows the size of the signal in the recent past."""

    def felt(self, grid: Grid) -> Run:
        """Return its size."""
        return lambda block: np.abs(block.signal)


@dataclass(frozen=True)
class AfterLevel(Past):
    """What follows the level of the recent past."""

    def felt(self, grid: Grid) -> Run:
        """Return the signal."""
        return lambda block: block.signal


@dataclass(frozen=True)
class AfterMotion(Past):
    """What follows how much the signal has moved of late."""

    travelled = True
    axes = RATES

    def felt(self, grid: Grid) -> Run:
        """Return how fast it moves either way, V/s."""
        rate = rate_of(grid)
        return lambda block: np.abs(rate(block))


@dataclass(frozen=True)
class GainAfterLoad(AfterLoad, Gain):
    """A gain that follows the load of the recent past."""

    form = "gain after load"
    kind = "a gain that follows the load of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = s^2 / (1 + s tau_k) in operator form"
    weights = (("warm", "V^-2"),)
    places = (Place.SOURCE, Place.G1, Place.F, Place.SENSE)


@dataclass(frozen=True)
class GainAfterUse(AfterUse, Gain):
    """A gain that follows the size of the signal in the recent past, as behind a supply that gives way."""

    form = "gain after use"
    kind = "a gain that follows the use of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = abs(s) / (1 + s tau_k) in operator form"
    weights = (("sag", "V^-1"),)
    places = GainAfterLoad.places


@dataclass(frozen=True)
class GainAfterLevel(AfterLevel, Gain):
    """A gain that follows the level of the recent past, as behind two supplies of which one gives way."""

    form = "gain after level"
    kind = "a gain that follows the level of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = s / (1 + s tau_k) in operator form"
    weights = (("lean", "V^-1"),)
    places = (Place.SOURCE, Place.G1, Place.SENSE)


@dataclass(frozen=True)
class GainAfterMotion(AfterMotion, Gain):
    """A gain that follows how much the signal has moved of late, as in a part that every movement warms."""

    form = "gain after motion"
    kind = "a gain that follows the motion of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = tau_k abs(ds/dt) / (1 + s tau_k) in operator form"
    weights = (("move", "V^-1"),)
    places = GainAfterLoad.places


@dataclass(frozen=True)
class OffsetAfterLoad(AfterLoad, Offset):
    """A zero that follows the load of the recent past, as thermocouples in a part that warms make."""

    form = "offset after load"
    kind = "an offset that follows the load of the recent past"
    equation = "s' = s + sum of a_k T_k, T_k = s^2 / (1 + s tau_k) in operator form"
    weights = (("warm", "V^-1"),)
    places = (Place.G1, Place.F, Place.SENSE)


@dataclass(frozen=True)
class OffsetAfterUse(AfterUse, Offset):
    """A zero that follows the size of the signal in the recent past, as where a part of it is rectified and stored."""

    form = "offset after use"
    kind = "an offset that follows the use of the recent past"
    equation = "s' = s + sum of a_k T_k, T_k = abs(s) / (1 + s tau_k) in operator form"
    weights = (("sag", "V/V"),)
    places = OffsetAfterLoad.places


@dataclass(frozen=True)
class OffsetAfterMotion(AfterMotion, Offset):
    """A zero that follows how much the signal has moved of late, as of a charge that every movement brings along."""

    form = "offset after motion"
    kind = "an offset that follows the motion of the recent past"
    equation = "s' = s + sum of a_k T_k, T_k = tau_k abs(ds/dt) / (1 + s tau_k) in operator form"
    weights = (("move", "V/V"),)
    places = OffsetAfterLoad.places


@dataclass(frozen=True)
class LeadAfterLoad(AfterLoad, Lead):
    """Dynamics that follow the load of the recent past, as of a capacitor that warms."""

    form = "delay after load"
    kind = "dynamics that follow the load of the recent past"
    equation = "s'(t) = s(t + sum of a_k T_k), T_k = s^2 / (1 + s tau_k) in operator form"
    weights = (("warm", "s/V^2"),)
    places = (Place.G1, Place.G2)
    dynamics = True


@dataclass(frozen=True)
class LeadAfterUse(AfterUse, Lead):
    """Dynamics that follow the size of the signal in the recent past."""

    form = "delay after use"
    kind = "dynamics that follow the use of the recent past"
    equation = "s'(t) = s(t + sum of a_k T_k), T_k = abs(s) / (1 + s tau_k) in operator form"
    weights = (("sag", "s/V"),)
    places = LeadAfterLoad.places
    dynamics = True


@dataclass(frozen=True)
class LeadAfterLevel(AfterLevel, Lead):
    """Dynamics that follow the level of the recent past, as of a capacitor that its bias changes slowly."""

    form = "delay after level"
    kind = "dynamics that follow the level of the recent past"
    equation = "s'(t) = s(t + sum of a_k T_k), T_k = s / (1 + s tau_k) in operator form"
    weights = (("lean", "s/V"),)
    places = LeadAfterLoad.places
    dynamics = True


@dataclass(frozen=True)
class LeadAfterMotion(AfterMotion, Lead):
    """Dynamics that follow how much the signal has moved of late."""

    form = "delay after motion"
    kind = "dynamics that follow the motion of the recent past"
    equation = "s'(t) = s(t + sum of a_k T_k), T_k = tau_k abs(ds/dt) / (1 + s tau_k) in operator form"
    weights = (("move", "s/V"),)
    places = LeadAfterLoad.places
    dynamics = True


@dataclass(frozen=True)
class GapAfterLoad(AfterLoad, Gap):
    """A gap that follows the load of the recent past."""

    form = "gap after load"
    kind = "a gap that follows the load of the recent past"
    equation = "D_L + c_L, D_U - c_U, each a sum of a_k T_k, T_k = v^2 / (1 + s tau_k) in operator form"
    plainly = OffsetAfterLoad.form
    weights = (("L", "V^-1"), ("U", "V^-1"))


@dataclass(frozen=True)
class GapAfterUse(AfterUse, Gap):
    """A gap that follows the size of v in the recent past."""

    form = "gap after use"
    kind = "a gap that follows the use of the recent past"
    equation = "D_L + c_L, D_U - c_U, each a sum of a_k T_k, T_k = abs(v) / (1 + s tau_k) in operator form"
    plainly = OffsetAfterUse.form
    weights = (("L", "V/V"), ("U", "V/V"))


@dataclass(frozen=True)
class GapAfterLevel(AfterLevel, Gap):
    """A gap that follows the level of v in the recent past."""

    form = "gap after level"
    kind = "a gap that follows the level of the recent past"
    equation = "D_L + c_L, D_U - c_U, each a sum of a_k T_k, T_k = v / (1 + s tau_k) in operator form"
    plainly = SlowFilter.form
    weights = (("L", "V/V"), ("U", "V/V"))


@dataclass(frozen=True)
class GapAfterMotion(AfterMotion, Gap):
    """A gap that follows how much v has moved of late, as of a lubricant that movement heats."""

    form = "gap after motion"
    kind = "a gap that follows the motion of the recent past"
    equation = "D_L + c_L, D_U - c_U, each a sum of a_k T_k, T_k = tau_k abs(dv/dt) / (1 + s tau_k) in operator form"
    plainly = OffsetAfterMotion.form
    weights = (("L", "V/V"), ("U", "V/V"))


AFTER: tuple[type[Past], ...] = (
    GainAfterLoad, GainAfterUse, GainAfterLevel, GainAfterMotion, OffsetAfterLoad, OffsetAfterUse, OffsetAfterMotion,
    LeadAfterLoad, LeadAfterUse, LeadAfterLevel, LeadAfterMotion, GapAfterLoad, GapAfterUse, GapAfterLevel,
    GapAfterMotion,
)  # fmt: skip


@dataclass(frozen=True)
class Swiftness(OverLevel):
    """Dynamics that depend on the level: it comes sooner or later by a time that is straight between levels."""

    form = "swiftness over the level"
    kind = "dynamics that depend on the level"
    equation = "s'(t) = s(t + c(s)), c straight between the knots"
    quick = True
    knot_unit = "V"
    weights = (("lead", "s"),)
    places = (Place.G1, Place.G2)
    dynamics = True

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return what the signal was or, going on straight, will be."""
        return led(lambda block: np.interp(block.signal, self.knots, values), grid)
