"""Which free-form filters are there: of a signal, of what rises and what falls of it, on a way past the circuit?"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from identify.blocks import run_linear
from identify.discretise import stepper
from identify.stage import Block, Grid, Place, Run, Values
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.maps import RATES

Ratio = tuple[tuple[float, ...], tuple[float, ...]]
DAMPING = 0.3  # of the resonances in a free-form filter


@dataclass(frozen=True)
class Filter(Correction):
    """A free-form linear block: a high-pass and a resonance at every time constant, none with a gain at 0 Hz."""

    form = "filter"
    kind = "a linear filter"
    equation = "s' = s + sum of a_k s tau_k / (1 + s tau_k) + b_k s tau_k / (1 + 0.6 s tau_k + (s tau_k)^2)"
    quick = True
    knot_unit = "s"
    weights: ClassVar[tuple[tuple[str, str], ...]] = (("real", "V/V"), ("pair", "V/V"))
    places: ClassVar[tuple[Place, ...]] = (Place.G1, Place.G2)
    dynamics = True
    curved = False
    least = 1

    @property
    def same_at(self) -> tuple[Place, ...]:
        """Return the places it may move between: in front of G1 it does the same, as both are linear."""
        return (Place.G1, Place.SOURCE) if self.place is Place.G1 else super().same_at

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "frequency"

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the weighted high-passes and resonances."""
        used = [
            (weight, run_linear(stepper(num, den, grid.step_s, "ramp")))
            for weight, (num, den) in zip(values, self._shapes(), strict=True) if weight
        ]  # fmt: skip

        def run(block: Block) -> Array:
            out = block.signal.copy()
            for weight, shaped in used:
                out += weight * shaped(block)
            return out

        return run

    def responses(self, frequency_hz: Array) -> NDArray[np.complex128]:
        """Return the frequency response of every shape, shape (shapes, frequencies)."""
        at = 2j * np.pi * frequency_hz
        return np.array([np.polyval(num, at) / np.polyval(den, at) for num, den in self._shapes()])

    def _shapes(self) -> list[Ratio]:
        """Return numerators and denominators: the real poles, then the damped pairs."""
        return [*self._real(), *(((tau, 0.0), (tau**2, 2.0 * DAMPING * tau, 1.0)) for tau in self.knots)]

    def _real(self) -> list[Ratio]:
        """Return the high-passes."""
        return [((tau, 0.0), (tau, 1.0)) for tau in self.knots]


@dataclass(frozen=True)
class SlowFilter(Filter):
    """Creep and coupling slower than the circuit: lags over time constants beyond its own."""

    form = "slow filter"
    kind = "a slow creep or coupling"
    equation = "s' = s + sum of a_k s tau_k / (1 + s tau_k)"
    weights = (("real", "V/V"),)
    quick = False
    dynamics = False
    places = (Place.SENSE, Place.F, Place.SOURCE)

    @property
    def same_at(self) -> tuple[Place, ...]:
        """Return the places it may move between: all that is linear on its side of F."""
        side = (Place.SOURCE, Place.G1) if self.place < Place.F else (Place.F, Place.G2, Place.SENSE)
        return (self.place, *(place for place in side if place != self.place))

    def _shapes(self) -> list[Ratio]:
        """Return the lags alone."""
        return self._real()


@dataclass(frozen=True)
class OneWay(Correction):
    """Filters of its own for what rises and for what falls of the signal, as of a stage that only pulls one way."""

    form = "filter by direction"
    kind = "dynamics that depend on the direction"
    equation = "s' = s + sum of a_k H_k r + b_k H_k f, H_k = s tau_k / (1 + s tau_k), r what rises, f what falls"
    quick = True
    knot_unit = "s"
    weights = (("rise", "V/V"), ("fall", "V/V"))
    places = (Place.SOURCE, Place.G1, Place.F, Place.G2)
    dynamics = True
    plainly = Filter.form
    curved = False
    least = 1

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return RATES[self.place]

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the weighted high-passes of what rises and what falls of it."""
        used = [
            (way, [(a, run_linear(stepper((tau, 0.0), (tau, 1.0), grid.step_s, "ramp")))
                   for a, tau in zip(weights, self.knots, strict=True) if a])
            for weights, way in zip(self.split(values), (np.maximum, np.minimum), strict=True)
        ]  # fmt: skip
        last, heights = 0.0, np.zeros(len(used))

        def run(block: Block) -> Array:
            nonlocal last
            moves = np.diff(block.signal, prepend=last)
            last = float(block.signal[-1])
            out = block.signal.copy()
            for i, (way, highs) in enumerate(used):
                if highs:
                    part = heights[i] + np.cumsum(way(moves, 0.0))
                    heights[i] = part[-1]
                    out += sum(a * high(block.holding(part)) for a, high in highs)
            return out

        return run


@dataclass(frozen=True)
class Bypass(Correction):
    """A linear path from the generator past the circuit: u and lags of u, the knots their time constants."""

    form = "path past the circuit"
    kind = "a path past the circuit"
    equation = "s' = s + sum of a_k u / (1 + s tau_k)"
    quick = True
    knot_unit = "s"
    weights = (("pass", "V/V"),)
    places = (Place.SENSE,)
    curved = False
    least = 1

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "level of u"

    @property
    def nearly_at(self) -> tuple[Place, ...]:
        """Return F: what passes the gap alone, linearly, has the way through G1 and G2 besides."""
        return (Place.F,)

    def summed(self, values: Values, grid: Grid) -> Run:
        """Return the signal plus the weighted copies of the source voltage."""
        steps = [stepper((1.0,), (tau, 1.0), grid.step_s, "ramp") for tau in self.knots if tau > 0.0]
        lags = [run_linear(step) for step in steps]

        def run(block: Block) -> Array:
            bare = Block(block.source, block.source, block.first, block.grid)
            direct = [block.source] * (len(self.knots) - len(lags))
            copies = [*direct, *(lag(bare) for lag in lags)]
            return np.asarray(block.signal + sum(a * copy for a, copy in zip(values, copies, strict=True)))

        return run
