"""The stages of the plain model: the source with its delay, linear blocks, and F with or without memory."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from identify import kernels
from identify.discretise import Stepper, stepper
from identify.model import Backlash, LinearF, Rational
from identify.sections import Section, product, sections
from identify.stage import Block, Grid, Held, Parameter, Place, Ramp, Run, Shape, Stage, Values, memoryless
from identify.trace import Array

KNOWN = 64  # steps that a block remembers
TOLERANCE_FACTOR = 3.0  # a refitted value of a linear block's denominator stays within this factor of the rig file's


@dataclass(frozen=True)
class Source(Stage):
    """The generator's output: held between its updates, or continuous."""

    held: bool = True
    name: str = "source"
    place: Place = Place.SOURCE

    def parameters(self) -> tuple[Parameter, ...]:
        """Return none."""
        return ()

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the signal as it is: Block.source is already the voltage just before each instant."""
        return (lambda block: block.signal), Held() if self.held else Ramp()


def delay_line(whole: int) -> Run:
    """Return a pure shift by ``whole`` instants, of a signal that was 0 before.

    What is kept is never longer than what was played: first order may ask for a delay of years.
    """
    past, silent = np.empty(0), whole

    def run(block: Block) -> Array:
        nonlocal past, silent
        if whole == 0:
            return block.signal
        zeros = min(silent, block.signal.size)
        joined, out = np.concatenate((past, block.signal)), block.signal.size - zeros
        past, silent = joined[out:], silent - zeros
        return np.concatenate((np.zeros(zeros), joined[:out])) if zeros else joined[:out]

    return run


@dataclass(frozen=True)
class LinearBlock(Stage):
    """G1 or G2: a rational function of s whose DC gain stays as the rig file gives it (it is F's to scale).

    Fitted are the denominator's sections of second order, 1 + s1 s + s2 s^2, in log coordinates within a factor of the
    start (one section of first order where the order is odd), so that every value is stable; and the numerator's
    coefficients over its constant term, linear, so that zeros may lie anywhere.

    What it puts out may be late, by ``fixed_delay_s`` and by what is fitted. A delay moves freely along a chain of
    time-invariant blocks (physics.md 1.1); behind a linear block it is exact between instants, in front of F it would
    not be, since F then turns where no instant is.
    """

    start: Rational
    name: str
    place: Place
    within: float | None = TOLERANCE_FACTOR
    fixed_delay_s: float = 0.0
    delays: tuple[Parameter, ...] = ()

    def parameters(self) -> tuple[Parameter, ...]:
        """Return those of ``coefficients``, then the fitted dead times."""
        return (*self.coefficients(), *self.delays)

    def coefficients(self) -> tuple[Parameter, ...]:
        """Return ``NAME.den.s2 NAME.den.s1``, from third order ``NAME.den.section1.s2 ...``; ``NAME.num.s1 ...``."""
        degree = len(self.start.num) - 1
        scales = [self._numerator_scale(k) for k in range(degree, 0, -1)]
        num = (Parameter(f"{self.name}.num.s{k}", f"s^{k}", scale=scales[degree - k]) for k in range(degree, 0, -1))
        return (*self._denominator(), *num)

    def _denominator(self) -> tuple[Parameter, ...]:
        """Return the parameters of the sections."""
        order = len(self.start.den) - 1
        powers = [tuple(range(size, 0, -1)) for size in _sizes(order)]
        prefixes = [""] if order <= 2 else [f"section{i}." for i in range(1, len(powers) + 1)]
        return tuple(
            Parameter(f"{self.name}.den.{prefix}s{k}", f"s^{k}", "log", within=self.within)
            for prefix, part in zip(prefixes, powers, strict=False) for k in part
        )

    def _numerator_scale(self, power: int) -> float:
        """Return the natural size of a coefficient: a share of the block's own time constant, or of the start."""
        order = len(self.start.den) - 1
        time_s = abs(self.start.den[0] / self.start.den[-1]) ** (1.0 / max(order, 1))
        given = abs(self.start.num[-1 - power] / self.start.num[-1])
        return float(max(0.1 * time_s**power, 0.3 * given))

    def start_values(self) -> Values:
        """Return the rig file's coefficients; ValueError when its denominator, of third order on, is not stable."""
        num = self.start.num
        den = tuple(value for part in sections(self.start.den) for value in part)
        return den + tuple(b / num[-1] for b in num[:-1])

    def rational(self, values: Values) -> Rational:
        """Return the block with fitted coefficients, in descending powers of s."""
        order, last = len(self.start.den) - 1, len(values) - len(self.delays)
        num = tuple(self.start.dc_gain * b for b in (*values[order:last], 1.0))
        if order <= 2:
            return Rational(num, (*values[:order], 1.0), self.start.dead_time_s)
        return Rational(num, product(self.parts(values)), self.start.dead_time_s)

    def fitted(self, values: Mapping[str, float]) -> Rational:
        """Return the block with those of ``values``, by full name, that are its own."""
        return self.rational(tuple(values[p.name] for p in self.parameters()))

    def parts(self, values: Values) -> list[Section]:
        """Return the sections of the denominator with fitted coefficients."""
        ends = np.cumsum((0, *_sizes(len(self.start.den) - 1))).tolist()
        return [values[first:last] for first, last in pairwise(ends)]

    def delay_s(self, values: Values) -> float:
        """Return by how much what it puts out is late, s."""
        return max(self.fixed_delay_s + sum(values[len(values) - len(self.delays) :]), 0.0)

    def late(self, values: Values, grid: Grid) -> tuple[int, float]:
        """Return by how many whole steps, and by which fraction of one, it is late; G2 has the device's delay, too."""
        steps = (self.delay_s(values) + (grid.late_s if self.place is Place.G2 else 0.0)) / grid.step_s
        whole = int(np.floor(steps + 1e-9))
        return whole, max(steps - whole, 0.0)

    def stepper(self, values: Values, grid: Grid, shape: Shape) -> Stepper:
        """Return the block's exact step on ``grid`` for an input of ``shape``, late by a fraction of it."""
        return self.step(values, grid, shape)[0]

    def step(self, values: Values, grid: Grid, shape: Shape) -> tuple[Stepper, int, float]:
        """Return that step, and by how many whole steps, and by which fraction of one, the block is late.

        What was asked last is known: most simulations of a fit have most blocks as they were.
        """
        key = values, grid.step_s, grid.late_s, shape
        if key not in self._known:
            if len(self._known) >= KNOWN:
                self._known.clear()
            fitted, (whole, fraction) = self.rational(values), self.late(values, grid)
            given = ("held", shape.fraction) if isinstance(shape, Held) else ("ramp", 0.0)
            self._known[key] = stepper(fitted.num, fitted.den, grid.step_s, *given, fraction), whole, fraction
        return self._known[key]

    @cached_property
    def _known(self) -> dict[object, tuple[Stepper, int, float]]:
        """Return the steps that were asked for."""
        return {}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running block; one without dynamics keeps the shape of its input, a held one late."""
        step, whole, fraction = self.step(values, grid, shape)
        late, through = delay_line(whole), run_linear(step)
        out_shape = shape if len(self.start.den) == 1 else Ramp()
        if isinstance(out_shape, Held):
            out_shape = Held(out_shape.fraction + fraction)
        return (lambda block: through(block.holding(late(block)))) if whole else through, out_shape


def _sizes(order: int) -> tuple[int, ...]:
    """Return the orders of the sections of a denominator."""
    return (2,) * (order // 2) + (1,) * (order % 2)


def run_linear(step: Stepper) -> Run:
    """Return a running linear block, at rest."""
    state, last = step.at_rest(), 0.0

    def run(block: Block) -> Array:
        nonlocal state, last
        out = np.empty_like(block.signal)
        state, last = kernels.linear(step.one, step.four, state, last, block.signal, out)
        return out

    return run


def run_filter(num: tuple[float, ...], den: tuple[float, ...], grid: Grid, shape: Shape) -> tuple[Run, Shape]:
    """Return num(s)/den(s) at work, at rest, and the shape of what it puts out; ValueError where no circuit can be."""
    if isinstance(shape, Held):
        out_shape = Ramp() if len(den) > 1 else shape
        return run_linear(stepper(num, den, grid.step_s, "held", shape.fraction)), out_shape
    return run_linear(stepper(num, den, grid.step_s, "ramp")), Ramp()


@dataclass(frozen=True)
class Play(Stage):
    """F with memory: the play operator of eqs. (6)-(7), starting from w as close to 0 as the borders allow."""

    start: Backlash
    name: str = "F"
    place: Place = Place.F

    def parameters(self) -> tuple[Parameter, ...]:
        """Return S_L, D_L, S_U, D_U."""
        slope, gap = abs(self.start.s_l), max(abs(self.start.d_l_v), abs(self.start.d_u_v), 1e-3)
        return (
            Parameter("F.S_L", "V/V", scale=0.3 * slope),
            Parameter("F.D_L", "V", scale=0.3 * gap),
            Parameter("F.S_U", "V/V", scale=0.3 * slope),
            Parameter("F.D_U", "V", scale=0.3 * gap),
        )

    def start_values(self) -> Values:
        """Return the rig file's borders."""
        return (self.start.s_l, self.start.d_l_v, self.start.s_u, self.start.d_u_v)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running play operator."""
        return run_play(values), shape


def run_play(borders: Values) -> Run:
    """Return a running play operator with borders S_L, D_L, S_U, D_U."""
    s_l, d_l, s_u, d_u = borders
    w = 0.0

    def run(block: Block) -> Array:
        nonlocal w
        out = np.empty_like(block.signal)
        w = kernels.play(s_l, d_l, s_u, d_u, w, block.signal, out)
        return out

    return run


@dataclass(frozen=True)
class Gain(Stage):
    """F without memory: w = gain v + offset."""

    start: LinearF
    name: str = "F"
    place: Place = Place.F

    def parameters(self) -> tuple[Parameter, ...]:
        """Return gain and offset."""
        size = abs(self.start.gain) or 1.0
        return (Parameter("F.gain", "V/V", scale=0.3 * size), Parameter("F.offset", "V", scale=0.1))

    def start_values(self) -> Values:
        """Return the rig file's gain and offset."""
        return (self.start.gain, self.start.offset_v)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the gain at work."""
        gain, offset = values
        return memoryless(lambda v: gain * v + offset, shape)
