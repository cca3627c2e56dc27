"""Which free-form laws let one thing change another: a load the gain, the zero or the gap, the level the speed?"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify.blocks import run_linear
from identify.discretise import stepper
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import PlayCorrection
from identify.unnamed.maps import LEVELS, RATES, OverLevel, rate_of
from identify.unnamed.memory import widened_play


@dataclass(frozen=True)
class Warming(OverLevel):
    """A gain that follows the load of the recent past: the square of the signal behind lags, the knots."""

    form = "gain after load"
    kind = "a gain that follows the load of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = s^2 / (1 + s tau_k) in operator form"
    knot_unit = "s"
    weights = (("warm", "V^-2"),)
    places: ClassVar[tuple[Place, ...]] = (Place.SOURCE, Place.G1, Place.F, Place.SENSE)
    travelled: ClassVar[bool] = False  # whether what is felt is the way of the recent past: a rate times the lag
    curved = False
    single = True
    least = 1

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal times one plus the weighted lags of its load."""
        past = _past(self.knots, values, grid, self.load(grid), self.travelled)
        return lambda block: np.asarray(block.signal * (1.0 + past(block)))

    def load(self, grid: Grid) -> Run:
        """Return what of the signal is felt later."""
        return _heat


@dataclass(frozen=True)
class Sag(Warming):
    """A gain that follows the size of the signal in the recent past, as behind a supply that gives way."""

    form = "gain after use"
    kind = "a gain that follows the use of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = abs(s) / (1 + s tau_k) in operator form"
    weights = (("sag", "V^-1"),)

    def load(self, grid: Grid) -> Run:
        """Return the size of the signal."""
        return _size


@dataclass(frozen=True)
class Leaning(Warming):
    """A gain that follows the level of the recent past, as behind two supplies of which one gives way."""

    form = "gain after level"
    kind = "a gain that follows the level of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = s / (1 + s tau_k) in operator form"
    weights = (("lean", "V^-1"),)
    places = (Place.SOURCE, Place.G1, Place.SENSE)

    def load(self, grid: Grid) -> Run:
        """Return the signal."""
        return _level


@dataclass(frozen=True)
class Moved(Warming):
    """A gain that follows how much the signal has moved of late, as in a part that every movement warms."""

    form = "gain after motion"
    kind = "a gain that follows the motion of the recent past"
    equation = "s' = s (1 + sum of a_k T_k), T_k = tau_k abs(ds/dt) / (1 + s tau_k) in operator form"
    weights = (("move", "V^-1"),)
    travelled = True
    places = (Place.SOURCE, Place.G1, Place.F, Place.SENSE)

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return RATES[self.place]

    def load(self, grid: Grid) -> Run:
        """Return how fast the signal moves either way, V/s."""
        return _motion(grid)


@dataclass(frozen=True)
class Heated(Warming):
    """A zero that follows the load of the recent past, as thermocouples in a part that warms make."""

    form = "offset after load"
    kind = "an offset that follows the load of the recent past"
    equation = "s' = s + sum of a_k T_k, T_k = s^2 / (1 + s tau_k) in operator form"
    weights = (("warm", "V^-1"),)
    places = (Place.G1, Place.F, Place.SENSE)

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the weighted lags of its load."""
        past = _past(self.knots, values, grid, self.load(grid), self.travelled)
        return lambda block: np.asarray(block.signal + past(block))


@dataclass(frozen=True)
class Rectified(Heated):
    """A zero that follows the size of the signal in the recent past, as where a part of it is rectified and stored."""

    form = "offset after use"
    kind = "an offset that follows the use of the recent past"
    equation = "s' = s + sum of a_k T_k, T_k = abs(s) / (1 + s tau_k) in operator form"
    weights = (("sag", "V/V"),)

    def load(self, grid: Grid) -> Run:
        """Return the size of the signal."""
        return _size


@dataclass(frozen=True)
class Stirred(Heated):
    """A zero that follows how much the signal has moved of late, as of a charge that every movement brings along."""

    form = "offset after motion"
    kind = "an offset that follows the motion of the recent past"
    equation = "s' = s + sum of a_k T_k, T_k = tau_k abs(ds/dt) / (1 + s tau_k) in operator form"
    weights = (("move", "V/V"),)
    travelled = True

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return RATES[self.place]

    def load(self, grid: Grid) -> Run:
        """Return how fast the signal moves either way, V/s."""
        return _motion(grid)


@dataclass(frozen=True)
class GapAfterLoad(PlayCorrection):
    """A gap that follows the load of the recent past: the square of v behind lags, the knots."""

    form = "gap after load"
    kind = "a gap that follows the load of the recent past"
    equation = "D_L + c_L, D_U - c_U, each a sum of a_k T_k, T_k = v^2 / (1 + s tau_k) in operator form"
    plainly = Heated.form
    knot_unit = "s"
    weights = (("L", "V^-1"), ("U", "V^-1"))
    travelled: ClassVar[bool] = False  # whether what is felt is the way of the recent past: a rate times the lag
    curved = False
    single = True
    least = 1

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return LEVELS[Place.G1]

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator whose borders follow the load."""
        lower, upper = (
            _past(self.knots, part, grid, self.load(grid), self.travelled) for part in self.split(values)
        )
        return widened_play(borders, lower, upper)

    def load(self, grid: Grid) -> Run:
        """Return what of v is felt later."""
        return _heat


@dataclass(frozen=True)
class GapAfterUse(GapAfterLoad):
    """A gap that follows the size of v in the recent past."""

    form = "gap after use"
    plainly = Rectified.form
    kind = "a gap that follows the use of the recent past"
    equation = "D_L + c_L, D_U - c_U, each a sum of a_k T_k, T_k = abs(v) / (1 + s tau_k) in operator form"
    weights = (("L", "V/V"), ("U", "V/V"))

    def load(self, grid: Grid) -> Run:
        """Return the size of v."""
        return _size


@dataclass(frozen=True)
class GapAfterMotion(GapAfterLoad):
    """A gap that follows how much v has moved of late, as of a lubricant that movement heats."""

    form = "gap after motion"
    plainly = Stirred.form
    kind = "a gap that follows the motion of the recent past"
    equation = "D_L + c_L, D_U - c_U, each a sum of a_k T_k, T_k = tau_k abs(dv/dt) / (1 + s tau_k) in operator form"
    weights = (("L", "V/V"), ("U", "V/V"))
    travelled = True

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return RATES[Place.G1]

    def load(self, grid: Grid) -> Run:
        """Return how fast v moves either way, V/s."""
        return _motion(grid)


def _heat(block: Block) -> Array:
    """Return what a signal heats a part by, in units of its own: heat goes with its square."""
    return np.square(block.signal)


def _size(block: Block) -> Array:
    """Return the size of a signal."""
    return np.abs(block.signal)


def _level(block: Block) -> Array:
    """Return a signal."""
    return block.signal


def _motion(grid: Grid) -> Run:
    """Return how fast a signal moves either way, V/s."""
    rate = rate_of(grid)
    return lambda block: np.abs(rate(block))


def _past(lags_s: Sequence[float], weights: Values | Array, grid: Grid, load: Run, travelled: bool) -> Run:
    """Return what a load makes behind lags, weighed; of a rate that is ``travelled``, each times its lag."""
    lags = [
        (a * tau if travelled else a, run_linear(stepper((1.0,), (tau, 1.0), grid.step_s, "ramp")))
        for a, tau in zip(weights, lags_s, strict=True) if a
    ]  # fmt: skip

    def run(block: Block) -> Array:
        felt = block.holding(load(block))
        return np.asarray(sum(a * lag(felt) for a, lag in lags))

    return run


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
