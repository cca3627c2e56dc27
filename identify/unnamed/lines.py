"""Which free-form laws have one frequency that is free of the stimulus: added, on the gain, the delay or the gap?"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify import kernels
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction, PlayCorrection
from identify.unnamed.rates import rate_of
from identify.unnamed.what import widened_play

PARTS = ("sine", "cosine")


@dataclass(frozen=True)
class OneLine(Correction):
    """Something that goes at one frequency, the knot, with an amplitude and a phase of its own in every run."""

    knot_unit = "Hz"
    local = True
    searched = True
    curved = False
    least = 1

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "mains lines"

    def line(self, values: Values, grid: Grid) -> Run:
        """Return a sin(2 pi f t) + b cos(2 pi f t) at the instants of a block; time runs from the start of the run.

        Further pairs of weights are those of overtones.
        """
        sine, cosine = np.array(values[::2]), np.array(values[1::2])
        orders, sizes, angles = np.arange(1, sine.size + 1), np.hypot(sine, cosine), np.arctan2(cosine, sine)
        turn = 2.0 * np.pi * self.knots[0] * grid.step_s

        def run(block: Block) -> Array:
            out = np.zeros(block.signal.size)
            kernels.waveform(turn * block.first, turn, orders, sizes, angles, out)
            return out

        return run


@dataclass(frozen=True)
class Line(OneLine):
    """A line added to a signal."""

    form = "line"
    kind = "a line free of the stimulus"
    equation = "s' = s + a sin(2 pi f t) + b cos(2 pi f t), a and b free in every run"
    weights: ClassVar[tuple[tuple[str, str], ...]] = tuple((part, "V") for part in PARTS)
    places = (Place.SENSE, Place.G1)

    @property
    def same_at(self) -> tuple[Place, ...]:
        """Return its place; what u has, v has (amplitude and phase are free), and added to v it moves both borders."""
        return (Place.G1, Place.SOURCE, Place.F) if self.place is Place.G1 else super().same_at

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the line."""
        line = self.line(values, grid)
        return lambda block: block.signal + line(block)


@dataclass(frozen=True)
class Wave(Line):
    """A line with overtones added to a signal: what a supply that switches puts on it."""

    form = "line with overtones"
    kind = "a wave free of the stimulus"
    equation = "s' = s + sum of a_k sin(2 pi k f t) + b_k cos(2 pi k f t), k = 1 to 4, all free in every run"
    weights = tuple((f"{order}{part}", "V") for order in ("", "second_", "third_", "fourth_") for part in PARTS)


@dataclass(frozen=True)
class Ripple(OneLine):
    """A gain that ripples."""

    form = "ripple of the gain"
    kind = "a ripple of the gain, free of the stimulus"
    equation = "s' = s (1 + a sin(2 pi f t) + b cos(2 pi f t)), a and b free in every run"
    weights = (("sine", "V/V"), ("cosine", "V/V"))
    places = (Place.SOURCE, Place.G1, Place.SENSE)

    @property
    def nearly_at(self) -> tuple[Place, ...]:
        """Return the source for G1 and G1 for it: on plateaus v is u, and between them little is told of either.

        Behind the gap G2 leaves amplitude and phase free, and a signal that moves slower than the line is the same.
        """
        return {Place.SOURCE: (Place.G1,), Place.G1: (Place.SOURCE,)}.get(self.place, (Place.F,))

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal times one plus the line."""
        line = self.line(values, grid)
        return lambda block: block.signal * (1.0 + line(block))


@dataclass(frozen=True)
class Flutter(OneLine):
    """A delay that ripples: a clock that flutters, or two converters in turn of which one is late."""

    form = "ripple of the delay"
    kind = "a ripple of the delay, free of the stimulus"
    equation = "s' = s + (a sin(2 pi f t) + b cos(2 pi f t)) ds/dt, a and b free in every run"
    quick = True
    weights = (("sine", "s"), ("cosine", "s"))
    places = (Place.SENSE, Place.G1)

    @property
    def nearly_at(self) -> tuple[Place, ...]:
        """Return the source for G1: a line on the delay of u is nearly one on that of v."""
        return (Place.SOURCE,) if self.place is Place.G1 else ()

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal a little sooner or later: to first order, of delays that are short against it."""
        line, rate = self.line(values, grid), rate_of(grid)
        return lambda block: np.asarray(block.signal + line(block) * rate(block))


@dataclass(frozen=True)
class GapRipple(OneLine, PlayCorrection):
    """A gap that ripples."""

    form = "ripple of the gap"
    kind = "a ripple of the gap, free of the stimulus"
    equation = "D_L + c(t), D_U - c(t), c = a sin(2 pi f t) + b cos(2 pi f t), a and b free in every run"
    weights = (("sine", "V"), ("cosine", "V"))
    places = (Place.F,)

    def played(self, borders: Values, values: Values, grid: Grid) -> Run:
        """Return the operator whose gap ripples."""
        return widened_play(borders, self.line(values, grid))
