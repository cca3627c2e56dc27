"""Which corrections say where a mismatch enters, without saying what it is?

A correction is a stage with free-form parameters: a map of a level, a filter, wider plays, a table over the clock. It
is the most that any physics of its kind at its place could explain, so it locates what has no name, and it judges a
name: physics that explains much less than the correction at the same place and along the same axis is the wrong one.
"""

from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from identify.blocks import Play, run_linear
from identify.chain import Chain
from identify.discretise import stepper
from identify.evidence import Evidence
from identify.kernels import play
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Stage, Values
from identify.trace import Array

KNOTS = 12
DAMPING = 0.3  # of the resonances in a free-form filter
GAPS = (0.04, 0.1, 0.2, 0.4)  # of the range of w: how much wider the further plays of a hysteresis are


@dataclass(frozen=True)
class Correction(Stage):
    """Something added to the signal at a place: the sum of ``size`` shapes, each times its parameter in V."""

    place: Place
    name: str = "correction"
    size: int = 0
    kind: ClassVar[str]  # what it is, as a sentence needs it

    @property
    @abstractmethod
    def axis(self) -> str:
        """Return the coordinate along which it acts."""

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the weights of the shapes."""
        return tuple(Parameter(f"{self.name}.{i}", "V") for i in range(self.size))

    @property
    def absent(self) -> dict[str, float]:
        """Return the weights that change nothing, by full name."""
        return {p.name: 0.0 for p in self.parameters()}

    def put_in(self, chain: Chain) -> Chain:
        """Return ``chain`` with this correction in it, still without effect."""
        return chain.with_stage(self, self.absent)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running sum; absent weights cost nothing."""
        if not any(values):
            return (lambda block: block.signal), shape
        return self.summed(values, grid, shape), shape

    @abstractmethod
    def summed(self, values: Values, grid: Grid, shape: Shape) -> Run:
        """Return the running signal plus the weighted shapes."""


@dataclass(frozen=True)
class LevelMap(Correction):
    """A free-form memoryless law: straight between knots over the level of the signal."""

    knots: tuple[float, ...] = ()
    kind = "a memoryless law"

    @property
    def axis(self) -> str:
        """Return the level of the signal at the place."""
        return {Place.SOURCE: "level of u", Place.F: "level of w"}.get(self.place, "level of y")

    def summed(self, values: Values, grid: Grid, shape: Shape) -> Run:
        """Return the signal plus the interpolated correction."""
        return lambda block: block.signal + np.interp(block.signal, self.knots, values)


@dataclass(frozen=True)
class RateMap(Correction):
    """A free-form law of how fast the signal moves, in V/s."""

    knots: tuple[float, ...] = ()
    kind = "a law of the rate of change"

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "rate of w"

    def summed(self, values: Values, grid: Grid, shape: Shape) -> Run:
        """Return the signal plus the correction at its rate of change."""
        last: float | None = None

        def run(block: Block) -> Array:
            nonlocal last
            rate = np.diff(block.signal, prepend=block.signal[0] if last is None else last) / grid.step_s
            last = float(block.signal[-1])
            return np.asarray(block.signal + np.interp(rate, self.knots, values))

        return run


@dataclass(frozen=True)
class Filter(Correction):
    """A free-form linear block: high-passes and resonances over all time scales, none with a gain at zero frequency."""

    taus_s: tuple[float, ...] = ()
    kind = "a linear filter"

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "frequency"

    def summed(self, values: Values, grid: Grid, shape: Shape) -> Run:
        """Return the signal plus the weighted high-passes s tau / (1 + s tau) and resonances."""
        blocks = [run_linear(stepper(num, den, grid.step_s, "ramp")) for num, den in self._shapes()]
        used = [(weight, block) for weight, block in zip(values, blocks, strict=True) if weight]

        def run(block: Block) -> Array:
            out = block.signal.copy()
            for weight, shaped in used:
                out += weight * shaped(block)
            return out

        return run

    def _shapes(self) -> list[tuple[tuple[float, ...], tuple[float, ...]]]:
        """Return numerators and denominators: a real pole and a damped pair at every time scale."""
        real = [((tau, 0.0), (tau, 1.0)) for tau in self.taus_s]
        pairs = [((tau, 0.0), (tau**2, 2.0 * DAMPING * tau, 1.0)) for tau in self.taus_s]
        return [*real, *pairs]


@dataclass(frozen=True)
class Bypass(Correction):
    """A free-form linear path from the generator past the circuit: u and lags of u."""

    taus_s: tuple[float, ...] = ()
    kind = "a path past the circuit"

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "level of u"

    def summed(self, values: Values, grid: Grid, shape: Shape) -> Run:
        """Return the signal plus the weighted copies of the source voltage."""
        lags = [run_linear(stepper((1.0,), (tau, 1.0), grid.step_s, "ramp")) for tau in self.taus_s]

        def run(block: Block) -> Array:
            bare = Block(block.source, block.source, block.first, block.grid)
            copies = [block.source, *(lag(bare) for lag in lags)]
            return np.asarray(block.signal + sum(a * copy for a, copy in zip(values, copies, strict=True)))

        return run


@dataclass(frozen=True)
class Hysteresis(Correction):
    """Further plays, each wider than F's, so that turning points other than F's matter (Prandtl-Ishlinskii)."""

    half_gaps_v: tuple[float, ...] = ()
    kind = "a second, wider hysteresis"

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "branch"

    def summed(self, values: Values, grid: Grid, shape: Shape) -> Run:
        """Return the signal plus the weighted plays."""
        levels = [0.0] * len(self.half_gaps_v)

        def run(block: Block) -> Array:
            out = block.signal.copy()
            wider = np.empty_like(out)
            for i, (weight, r) in enumerate(zip(values, self.half_gaps_v, strict=True)):
                levels[i] = play(1.0, r, 1.0, -r, levels[i], block.signal, wider)
                out += weight * (wider - block.signal)
            return out

        return run


@dataclass(frozen=True)
class Plateau(Correction):
    """A free-form flow on plateaus: while the signal rests, it creeps at a rate that depends on its level, V/s."""

    knots: tuple[float, ...] = ()
    rest_v: float = field(default=1e-9)
    kind = "a creep on plateaus"

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "time on a plateau"

    def summed(self, values: Values, grid: Grid, shape: Shape) -> Run:
        """Return the signal plus what has crept since it last moved."""
        last, crept = 0.0, 0.0

        def run(block: Block) -> Array:
            nonlocal last, crept
            moved = np.abs(np.diff(block.signal, prepend=last)) > self.rest_v
            creep = np.interp(block.signal, self.knots, values) * grid.step_s
            total = crept + np.cumsum(np.where(moved, 0.0, creep))
            since = np.maximum.accumulate(np.where(moved, np.arange(moved.size), -1))
            base = np.where(since >= 0, total[since], 0.0)
            out = block.signal + total - base
            last, crept = float(block.signal[-1]), float(total[-1] - base[-1])
            return np.asarray(out)

        return run


@dataclass(frozen=True)
class ClockMap(Correction):
    """A free-form table over clock time, added to the signal or multiplying it."""

    knots: tuple[float, ...] = ()
    times: bool = False
    kind = "a table over the clock"

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "clock time"

    def summed(self, values: Values, grid: Grid, shape: Shape) -> Run:
        """Return the signal plus the table, or times one plus the table."""

        def run(block: Block) -> Array:
            table = np.interp(block.time_s(), self.knots, values)
            return np.asarray(block.signal + (block.signal * table if self.times else table))

        return run


@dataclass(frozen=True)
class Line(Correction):
    """A free line: one frequency, amplitude and phase of its own in every run."""

    frequency_hz: float = 0.0
    kind = "a line free of the stimulus"

    @property
    def axis(self) -> str:
        """Return the coordinate."""
        return "mains lines"

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the two components, in V, of every run."""
        return tuple(Parameter(f"{self.name}.{i}", "V", local=True) for i in range(2))

    def summed(self, values: Values, grid: Grid, shape: Shape) -> Run:
        """Return the signal plus the line."""

        def run(block: Block) -> Array:
            count = np.arange(block.first, block.first + block.signal.size)
            turn = 2.0 * np.pi * self.frequency_hz * grid.step_s * count
            return np.asarray(block.signal + values[0] * np.sin(turn) + values[1] * np.cos(turn))

        return run


def corrections(evidence: Evidence) -> Iterator[Correction]:
    """Yield every correction that makes sense for the chain and the data."""
    longest_s = max(o.trace.size for o in evidence.observations) * evidence.sample_s
    taus = tuple(np.geomspace(0.5 * evidence.sample_s, 0.3 * longest_s, 8).tolist())
    level = {place: _spread(*evidence.range(place)) for place in Place}
    yield from (LevelMap(place, size=KNOTS, knots=level[place]) for place in (Place.SOURCE, Place.F, Place.SENSE))
    yield from (Filter(place, size=2 * len(taus), taus_s=taus) for place in (Place.G1, Place.G2))
    yield Bypass(Place.SENSE, size=4, taus_s=taus[1:7:2])
    rates = evidence.rates(Place.F)
    yield RateMap(Place.F, size=len(rates), knots=rates)
    yield from _clock_maps(evidence)
    yield Line(Place.SENSE, size=2, frequency_hz=evidence.strongest_line_hz)
    if evidence.chain.stage_of(Play) is not None:
        width = level[Place.F][-1] - level[Place.F][0]
        yield Hysteresis(Place.F, size=len(GAPS), half_gaps_v=tuple(share * width for share in GAPS))
        yield Plateau(Place.F, size=6, knots=tuple(np.linspace(level[Place.F][0], level[Place.F][-1], 6).tolist()))


def _clock_maps(evidence: Evidence) -> Iterator[Correction]:
    """Yield tables over the clock, added and multiplied."""
    starts = [o.trace.start_s for o in evidence.observations]
    ends = [o.trace.start_s + o.trace.size * evidence.sample_s for o in evidence.observations]
    knots = tuple(np.linspace(min(starts), max(ends), 6).tolist())
    yield from (ClockMap(Place.SENSE, size=6, knots=knots, times=times) for times in (False, True))


def _spread(low: float, high: float) -> tuple[float, ...]:
    """Return knots over a range."""
    margin = 1e-3 * (high - low) + 1e-9
    return tuple(np.linspace(low - margin, high + margin, KNOTS).tolist())
