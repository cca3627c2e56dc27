"""Which laws remember where a signal turned, how long it is since, or how far it ever went?"""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.maps import LEVELS
from identify.unnamed.what import Gain, Gap, Going, Lead, Offset

SINCE_TURN = "time since a turn"
REST_V = 1e-9  # a level that moves less than this between two instants rests


@dataclass(frozen=True)
class Remembered(Going):
    """A course straight between knots of what is remembered: of the signal of its place, or of v in front of F."""

    axes: ClassVar[Mapping[Place, str]] = LEVELS

    @abstractmethod
    def remembered(self, grid: Grid) -> Run:
        """Return what of a running signal is remembered."""

    def course(self, weights: Values | Array, grid: Grid) -> Run:
        """Return the table at what is remembered."""
        told = self.remembered(grid)
        return lambda block: np.interp(told(block), self.knots, weights)


def _turns() -> Callable[[Array], tuple[Array, Array]]:
    """Return what tells, at every instant of a stretch, the latest turn in it, -1 before the first, and the signal.

    The signal is with the value before the stretch in front: at the index of a turn it stands where it turned.
    """
    last, way = 0.0, 0.0

    def run(stretch: Array) -> tuple[Array, Array]:
        nonlocal last, way
        signal = np.concatenate(([last], stretch))
        moves = np.diff(signal)
        ways = _kept(np.concatenate(([way], np.where(np.abs(moves) > REST_V, np.sign(moves), 0.0))))
        turns = ways[1:] * ways[:-1] < 0.0
        last, way = float(signal[-1]), float(ways[-1])
        return np.maximum.accumulate(np.where(turns, np.arange(turns.size), -1)), signal

    return run


def turn_age(signal: Array) -> Array:
    """Return how many samples it is at each of a whole signal that it turned, or began."""
    latest = _turns()(signal)[0]
    return np.asarray(np.arange(latest.size) - np.maximum(latest, 0))


def _kept(signs: Array) -> Array:
    """Return signs with every zero as the one before it."""
    latest = np.maximum.accumulate(np.where(signs != 0.0, np.arange(signs.size), 0))
    return np.asarray(signs[latest])


def _turning_point() -> Run:
    """Return how far a signal was from zero where it turned last, V."""
    turns, turned = _turns(), 0.0

    def run(block: Block) -> Array:
        nonlocal turned
        latest, signal = turns(block.signal)
        at = np.where(latest >= 0, np.abs(signal[latest]), turned)
        turned = float(at[-1])
        return at

    return run


def _since_turn(grid: Grid) -> Run:
    """Return the time since a signal turned, or since the run began, s."""
    turns, before = _turns(), 0

    def run(block: Block) -> Array:
        nonlocal before
        latest, _ = turns(block.signal)
        at = np.arange(latest.size)
        steps = np.where(latest >= 0, at - latest, before + at)
        before = int(steps[-1]) + 1
        return np.asarray(steps * grid.step_s)

    return run


def _farthest() -> Run:
    """Return how far from zero a signal ever was in the run, V."""
    farthest = 0.0

    def run(block: Block) -> Array:
        nonlocal farthest
        ever = np.maximum.accumulate(np.concatenate(([farthest], np.abs(block.signal))))
        farthest = float(ever[-1])
        return ever[1:]

    return run


@dataclass(frozen=True)
class AfterTurn(Remembered):
    """What remembers how far the signal last went before it turned."""

    knot_unit = "V"

    def remembered(self, grid: Grid) -> Run:
        """Return how far it was from zero where it turned last, V."""
        return _turning_point()


@dataclass(frozen=True)
class SinceTurn(Remembered):
    """What goes on since the signal turned."""

    knot_unit = "s"
    axes: ClassVar[Mapping[Place, str]] = {p: level.replace("level", SINCE_TURN) for p, level in LEVELS.items()}

    def remembered(self, grid: Grid) -> Run:
        """Return the time since it turned, s."""
        return _since_turn(grid)


@dataclass(frozen=True)
class AfterFarthest(Remembered):
    """What remembers how far the signal ever went in the run: it gives way for good."""

    knot_unit = "V"

    def remembered(self, grid: Grid) -> Run:
        """Return how far from zero it ever was, V."""
        return _farthest()


@dataclass(frozen=True)
class GapAfterTurn(AfterTurn, Gap):
    """A gap that remembers how far v last went before it turned."""

    form = "gap after a turn"
    kind = "a gap that depends on where the signal last turned"
    equation = "D_L + c_L(abs(v_0)), D_U - c_U(abs(v_0)), v_0 where v turned last, both straight between the knots"
    weights = (("L", "V"), ("U", "V"))


@dataclass(frozen=True)
class GapAfterFarthest(AfterFarthest, Gap):
    """A gap that gives way for good: it remembers how far v ever went in the run."""

    form = "gap after the farthest"
    kind = "a gap that depends on how far the signal ever went"
    equation = "D_L + c_L(p), D_U - c_U(p), p the largest abs(v) of the run so far, both straight between the knots"
    weights = (("L", "V"), ("U", "V"))


@dataclass(frozen=True)
class GainAfterFarthest(AfterFarthest, Gain):
    """A gain that gives way for good."""

    form = "gain after the farthest"
    kind = "a gain that depends on how far the signal ever went"
    equation = "s' = s (1 + c(p)), p the largest abs(s) of the run so far, c straight between the knots"
    weights = (("grow", "V/V"),)
    places = (Place.SOURCE, Place.G1, Place.F, Place.SENSE)


@dataclass(frozen=True)
class OffsetAfterFarthest(AfterFarthest, Offset):
    """A zero that gives way for good."""

    form = "offset after the farthest"
    kind = "an offset that depends on how far the signal ever went"
    equation = "s' = s + c(p), p the largest abs(s) of the run so far, c straight between the knots"
    places = (Place.G1, Place.F, Place.SENSE)


@dataclass(frozen=True)
class GapSinceTurn(SinceTurn, Gap):
    """A gap that settles, or sets, after every turn of v."""

    form = "gap since a turn"
    kind = "a gap that goes on changing after every turn"
    equation = "D_L + c_L(t), D_U - c_U(t), t since v turned last, both straight between the knots"
    weights = (("L", "V"), ("U", "V"))


@dataclass(frozen=True)
class GainSinceTurn(SinceTurn, Gain):
    """A gain that settles after every turn of the signal."""

    form = "gain since a turn"
    kind = "a gain that goes on changing after every turn"
    equation = "s' = s (1 + c(t)), t since s turned last, c straight between the knots"
    weights = (("grow", "V/V"),)
    places = GainAfterFarthest.places


@dataclass(frozen=True)
class OffsetSinceTurn(SinceTurn, Offset):
    """A zero that settles after every turn of the signal."""

    form = "offset since a turn"
    kind = "an offset that goes on changing after every turn"
    equation = "s' = s + c(t), t since s turned last, c straight between the knots"
    places = (Place.G1, Place.F, Place.SENSE)


@dataclass(frozen=True)
class LeadSinceTurn(SinceTurn, Lead):
    """Dynamics that are others the longer the signal has not turned."""

    form = "delay since a turn"
    kind = "dynamics that go on changing after every turn"
    equation = "s'(t) = s(t + c(t')), t' since s turned last, c straight between the knots"
    weights = (("lead", "s"),)
    places = (Place.G1, Place.G2)
    dynamics = True


FARTHEST: tuple[type[Remembered], ...] = (GapAfterTurn, GapAfterFarthest, GainAfterFarthest, OffsetAfterFarthest)
SINCE: tuple[type[Remembered], ...] = (GapSinceTurn, GainSinceTurn, OffsetSinceTurn, LeadSinceTurn)
