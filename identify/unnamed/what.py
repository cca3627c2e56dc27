"""What may a law of free form change: the zero of a signal, its gain, how soon it comes, or the gap?

By what it changes that is another question: a law is one of these and of what it goes with, whose ``course`` it follows
(identify/unnamed/past.py, turned.py, timed.py, sudden.py, rates.py).
"""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify import kernels
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction, PlayCorrection

PAST, PAST_S = 400, 0.04  # steps of the grid, or s where these are more, that a signal may come later at most


@dataclass(frozen=True)
class Going(Correction):
    """A law that goes with something, of a signal mostly: ``axes`` are what that is called at every place."""

    axes: ClassVar[Mapping[Place, str]]

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return self.axes[self.followed(self.place)]

    @classmethod
    def followed(cls, place: Place) -> Place:
        """Return the place whose signal a law at a place goes with."""
        return place

    @abstractmethod
    def course(self, weights: Values | Array, grid: Grid) -> Run:
        """Return the running course, weighed."""


@dataclass(frozen=True)
class Offset(Going):
    """A zero that follows a course, V."""

    at_once = True

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the course."""
        course = self.course(values, grid)
        return lambda block: np.asarray(block.signal + course(block))


@dataclass(frozen=True)
class Gain(Going):
    """A gain that follows a course, V/V."""

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal times one plus the course."""
        course = self.course(values, grid)
        return lambda block: np.asarray(block.signal * (1.0 + course(block)))


@dataclass(frozen=True)
class Lead(Going):
    """A delay that follows a course, s; it stands for dynamics that do, as far as their lags are short."""

    quick = True
    sums = False

    @property
    def nearly_at(self) -> tuple[Place, ...]:
        """Return further places at which this gives nearly the same data: what G1 makes of a lag is as late."""
        return (*super().nearly_at, *((Place.SOURCE,) if self.place is Place.G1 else ()))

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return what the signal was or, going on straight, will be."""
        return led(self.course(values, grid), grid)


@dataclass(frozen=True)
class Gap(Going, PlayCorrection):
    """A gap of which either border follows a course of its own, V."""

    @classmethod
    def followed(cls, place: Place) -> Place:
        """Return G1: it goes with what is in front of it, v."""
        return Place.G1

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator whose borders follow the course."""
        return widened_play(borders, *(self.course(part, grid) for part in self.split(values)))


def led(lead_s: Run, grid: Grid) -> Run:
    """Return what a signal was or, going on straight, will be: ``lead_s`` later, s, as far as the past is kept."""
    past = max(PAST, round(PAST_S / grid.step_s))
    before: Array | None = None

    def run(block: Block) -> Array:
        nonlocal before
        before = np.full(past, block.signal[0]) if before is None else before
        known = np.concatenate([before, block.signal])
        before = known[-past:]
        out = np.empty_like(block.signal)
        kernels.led(known, past, lead_s(block) / grid.step_s, out)
        return out

    return run


def widened_play(borders: Values, widened: Run, other: Run | None = None) -> Run:
    """Return the play operator whose half gap is wider by a running signal, V; by an ``other`` one at the border U."""
    s_l, d_l, s_u, d_u = borders
    w = 0.0

    def run(block: Block) -> Array:
        nonlocal w
        wider = widened(block)
        further = wider if other is None else other(block)
        lower, upper = s_l * (block.signal - d_l - wider), s_u * (block.signal - d_u + further)
        w = kernels.play_between(lower, upper, w, lower)
        return np.asarray(lower)

    return run
