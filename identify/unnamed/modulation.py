"""Which free-form laws let one thing change another: a load the gain, the zero or the gap, the level the speed?"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify.blocks import run_linear
from identify.discretise import stepper
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction, PlayCorrection
from identify.unnamed.maps import LEVELS, RATES, OverLevel, rate_of
from identify.unnamed.memory import widened_play


@dataclass(frozen=True)
class Felt:
    """What of a signal is felt later: the coordinates it goes with, and what makes it of the signal on a grid.

    Of what is ``travelled``, a rate, the way of the recent past is felt: it counts times the lag.
    """

    axes: Mapping[Place, str]
    made: Callable[[Grid], Run]
    travelled: bool = False

    def past(self, lags_s: Sequence[float], weights: Values | Array, grid: Grid) -> Run:
        """Return what is felt behind lags, s, weighed."""
        felt_now = self.made(grid)
        lags = [
            (a * tau if self.travelled else a, run_linear(stepper((1.0,), (tau, 1.0), grid.step_s, "ramp")))
            for a, tau in zip(weights, lags_s, strict=True) if a
        ]  # fmt: skip

        def run(block: Block) -> Array:
            felt = block.holding(felt_now(block))
            return np.asarray(sum(a * lag(felt) for a, lag in lags))

        return run


def _motion(grid: Grid) -> Run:
    """Return how fast a signal moves either way, V/s."""
    rate = rate_of(grid)
    return lambda block: np.abs(rate(block))


LOAD = Felt(LEVELS, lambda grid: lambda block: np.square(block.signal))  # heat goes with the square
USE = Felt(LEVELS, lambda grid: lambda block: np.abs(block.signal))
LEVEL = Felt(LEVELS, lambda grid: lambda block: block.signal)
MOTION = Felt(RATES, _motion, travelled=True)


@dataclass(frozen=True)
class Warming(Correction):
    """A gain that follows the load of the recent past: the square of the signal behind lags, the knots."""

    form = "gain after load"
    kind = "a gain that follows the load of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = s^2 / (1 + s tau_k) in operator form"
    knot_unit = "s"
    weights = (("warm", "V^-2"),)
    places: ClassVar[tuple[Place, ...]] = (Place.SOURCE, Place.G1, Place.F, Place.SENSE)
    felt: ClassVar[Felt] = LOAD
    curved = False
    single = True
    least = 1

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return self.felt.axes[self.place]

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal times one plus the weighted lags of what is felt."""
        past = self.felt.past(self.knots, values, grid)
        return lambda block: np.asarray(block.signal * (1.0 + past(block)))


@dataclass(frozen=True)
class Sag(Warming):
    """A gain that follows the size of the signal in the recent past, as behind a supply that gives way."""

    form = "gain after use"
    kind = "a gain that follows the use of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = abs(s) / (1 + s tau_k) in operator form"
    weights = (("sag", "V^-1"),)
    felt = USE


@dataclass(frozen=True)
class Leaning(Warming):
    """A gain that follows the level of the recent past, as behind two supplies of which one gives way."""

    form = "gain after level"
    kind = "a gain that follows the level of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = s / (1 + s tau_k) in operator form"
    weights = (("lean", "V^-1"),)
    places = (Place.SOURCE, Place.G1, Place.SENSE)
    felt = LEVEL


@dataclass(frozen=True)
class Moved(Warming):
    """A gain that follows how much the signal has moved of late, as in a part that every movement warms."""

    form = "gain after motion"
    kind = "a gain that follows the motion of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = tau_k abs(ds/dt) / (1 + s tau_k) in operator form"
    weights = (("move", "V^-1"),)
    felt = MOTION


@dataclass(frozen=True)
class Heated(Warming):
    """A zero that follows the load of the recent past, as thermocouples in a part that warms make."""

    form = "offset after load"
    kind = "an offset that follows the load of the recent past"
    equation = "s' = s + sum of a_k T_k, T_k = s^2 / (1 + s tau_k) in operator form"
    weights = (("warm", "V^-1"),)
    places = (Place.G1, Place.F, Place.SENSE)

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the weighted lags of what is felt."""
        past = self.felt.past(self.knots, values, grid)
        return lambda block: np.asarray(block.signal + past(block))


@dataclass(frozen=True)
class Rectified(Heated):
    """A zero that follows the size of the signal in the recent past, as where a part of it is rectified and stored."""

    form = "offset after use"
    kind = "an offset that follows the use of the recent past"
    equation = "s' = s + sum of a_k T_k, T_k = abs(s) / (1 + s tau_k) in operator form"
    weights = (("sag", "V/V"),)
    felt = USE


@dataclass(frozen=True)
class Stirred(Heated):
    """A zero that follows how much the signal has moved of late, as of a charge that every movement brings along."""

    form = "offset after motion"
    kind = "an offset that follows the motion of the recent past"
    equation = "s' = s + sum of a_k T_k, T_k = tau_k abs(ds/dt) / (1 + s tau_k) in operator form"
    weights = (("move", "V/V"),)
    felt = MOTION


@dataclass(frozen=True)
class GapAfterLoad(PlayCorrection):
    """A gap that follows the load of the recent past: the square of v behind lags, the knots."""

    form = "gap after load"
    kind = "a gap that follows the load of the recent past"
    equation = "D_L + c_L, D_U - c_U, each a sum of a_k T_k, T_k = v^2 / (1 + s tau_k) in operator form"
    plainly = Heated.form
    knot_unit = "s"
    weights = (("L", "V^-1"), ("U", "V^-1"))
    felt: ClassVar[Felt] = LOAD
    curved = False
    single = True
    least = 1

    @property
    def axis(self) -> str:
        """Return the coordinate: it is v whose past is felt."""
        return self.felt.axes[Place.G1]

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator whose borders follow what is felt."""
        lower, upper = (self.felt.past(self.knots, part, grid) for part in self.split(values))
        return widened_play(borders, lower, upper)


@dataclass(frozen=True)
class GapAfterUse(GapAfterLoad):
    """A gap that follows the size of v in the recent past."""

    form = "gap after use"
    plainly = Rectified.form
    kind = "a gap that follows the use of the recent past"
    equation = "D_L + c_L, D_U - c_U, each a sum of a_k T_k, T_k = abs(v) / (1 + s tau_k) in operator form"
    weights = (("L", "V/V"), ("U", "V/V"))
    felt = USE


@dataclass(frozen=True)
class GapAfterMotion(GapAfterLoad):
    """A gap that follows how much v has moved of late, as of a lubricant that movement heats."""

    form = "gap after motion"
    plainly = Stirred.form
    kind = "a gap that follows the motion of the recent past"
    equation = "D_L + c_L, D_U - c_U, each a sum of a_k T_k, T_k = tau_k abs(dv/dt) / (1 + s tau_k) in operator form"
    weights = (("L", "V/V"), ("U", "V/V"))
    felt = MOTION


AFTER = (  # all that follow the recent past
    Warming, Sag, Leaning, Moved, Heated, Rectified, Stirred, GapAfterLoad, GapAfterUse, GapAfterMotion,
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
        return led(lambda block: np.interp(block.signal, self.knots, values), min(values), grid)


def led(lead_s: Run, least_s: float, grid: Grid) -> Run:
    """Return what a signal was or, going on straight, will be: ``lead_s`` later, s, at least ``least_s``."""
    past = max(int(np.ceil(-min(least_s, 0.0) / grid.step_s)), 1)
    before: Array | None = None

    def run(block: Block) -> Array:
        nonlocal before
        before = np.full(past, block.signal[0]) if before is None else before
        known = np.concatenate([before, block.signal])
        before = known[-past:]
        steps = lead_s(block) / grid.step_s
        here = np.arange(past, known.size)
        rate = known[past:] - known[past - 1 : -1]
        was = np.interp(here + np.minimum(steps, 0.0), np.arange(known.size), known)
        return np.asarray(was + np.maximum(steps, 0.0) * rate)

    return run
