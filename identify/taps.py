"""What does a chain answer that differs from a known one from some stage on?

The signals of the known chain are kept behind every stage, so that only what comes after the first difference is run.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.between import source_of
from identify.chain import CHUNK, Chain, advance, grid_of
from identify.colour import whitening
from identify.derivatives.moved import AT_ONCE, mover, teams
from identify.discretise import Matrix
from identify.observe import Observation
from identify.stage import Block, Grid, Shape, Values
from identify.trace import Array

FEW = 3  # chains that take no longer one after the other


@dataclass(frozen=True, eq=False)
class Tapped:
    """A chain and one run on the samples' own grid, with the signal behind every stage."""

    chain: Chain
    observation: Observation

    @cached_property
    def grid(self) -> Grid:
        """Return the instants: those of the samples."""
        return grid_of(self.observation.trace)

    @cached_property
    def source(self) -> Array:
        """Return the source voltage just before each instant, V, shape (N,)."""
        return source_of(self.observation.trace, 1)[:]

    @cached_property
    def signals(self) -> tuple[Array, ...]:
        """Return the signal behind every stage, V, shape (N,) each: taps a bench does not have."""
        found, signal = [], self.source
        for i in range(len(self.chain.stages)):
            signal = self._through(self.chain, i, i + 1, signal)
            found.append(signal)
        return tuple(found)

    @cached_property
    def _values(self) -> tuple[Values, ...]:
        """Return the values of every stage in this run."""
        return tuple(self.chain.of(stage, self.grid.run) for stage in self.chain.stages)

    @cached_property
    def _shapes(self) -> tuple[Shape, ...]:
        """Return the shape of what enters every stage, and of the answer."""
        return tuple(self.chain.begun(self.grid)[1])

    def write_changes(self, chains: Sequence[Chain], unit: float, rows: Matrix) -> None:
        """Write how the answers of chains differ where samples count, in units of the noise and per ``unit``, (m, n).
        """
        with np.errstate(over="ignore", invalid="ignore"):
            shared = [self._shared(chain) for chain in chains]
            if len(chains) >= FEW and self._differ_in_one_stage(chains, shared):
                self._write_abreast(chains, shared[0], unit, rows)
                return
            for chain, first, row in zip(chains, shared, rows, strict=True):
                self._write_change(chain, first, unit, row)

    def _differ_in_one_stage(self, chains: Sequence[Chain], shared: list[int]) -> bool:
        """Return whether chains differ from this one in the same stage alone, which this one may not have."""
        stages, first = chains[0].stages, shared[0]
        if first == len(stages) or shared.count(first) < len(shared) or any(c.stages is not stages for c in chains):
            return False
        behind, mine = stages[first + 1 :], self.chain.stages[len(self.chain.stages) - len(stages) + first + 1 :]
        if len(behind) != len(mine) or any(one is not other for one, other in zip(behind, mine, strict=True)):
            return False
        known = self._values[len(self._values) - len(behind) :]
        return all(tuple(c.of(stage, self.grid.run) for stage in behind) == known for c in chains)

    def _write_abreast(self, chains: Sequence[Chain], first: int, unit: float, rows: Matrix) -> None:
        """Write how the answers of chains differ that do so in the ``first`` stage alone."""
        chain, grid, stage = chains[0], self.grid, chains[0].stages[first]
        late = len(self.chain.stages) - len(chain.stages)
        shapes = [*self._shapes[: first + 1], *self._shapes[first + 1 + late :]]
        movers = [mover(c, first, c.of(stage, grid.run), False, grid, shapes) for c in chains]
        taps = (self.source, *self.signals)
        taps = (*taps[: first + 1], *taps[first + 1 + late :])  # as the other chain has them, unmoved
        o, scale = self.observation, 1.0 / (self.observation.noise_v * unit)
        whole = o.colour.white and o.count == self.source.size
        for which, team in teams(chain, grid, movers, shapes):
            changes = rows[which] if whole else np.empty((which.stop - which.start, self.source.size))
            for at in range(0, self.source.size, AT_ONCE):
                there = slice(at, at + AT_ONCE)
                passed = [Block(tap[there], self.source[there], at, grid) for tap in taps]
                team.write_changes(passed, 1, scale, changes[:, there])
            if not whole:
                rows[which] = self._weighed(changes)

    def _weighed(self, changes: Matrix) -> Matrix:
        """Return changes in units of the noise where samples count, as a fit weighs them."""
        o = self.observation
        if o.colour.white:
            return changes[:, o.use]
        return np.asarray(whitening(o.colour)(changes.T, o.use).T)

    def _write_change(self, chain: Chain, first: int, unit: float, out: Array) -> None:
        """Write how the answer of one chain differs from the ``first`` stage on."""
        if first == len(chain.stages) == len(self.chain.stages):
            out[:] = 0.0
            return
        entering = self.signals[first - 1] if first else self.source
        answer = self._through(chain, first, len(chain.stages), entering)
        if self.observation.colour.white and out.size == answer.size:
            np.subtract(answer, self.signals[-1], out=out)
            out *= 1.0 / (self.observation.noise_v * unit)
        else:
            np.divide(self._seen(answer - self.signals[-1]), unit, out=out)

    def _seen(self, signal: Array) -> Array:
        """Return a signal where samples count, in units of the noise, as a fit weighs it."""
        o = self.observation
        if not o.colour.white:
            return whitening(o.colour)(signal / o.noise_v, o.use)
        return np.asarray((signal if o.count == signal.size else signal[o.use]) / o.noise_v)

    def _shared(self, chain: Chain) -> int:
        """Return how many stages from the source on are the same with the same values."""
        shared = 0
        for mine, values, other in zip(self.chain.stages, self._values, chain.stages, strict=False):
            if mine is not other or values != chain.of(other, self.grid.run):
                break
            shared += 1
        return shared

    def _through(self, chain: Chain, first: int, stop: int, signal: Array) -> Array:
        """Return a signal behind the stages [first, stop) of a chain that begins as this one does."""
        shape, runs = self._shapes[first], []
        for stage in chain.stages[first:stop]:
            run, shape = stage.begin(chain.of(stage, self.grid.run), self.grid, shape)
            runs.append(run)
        parts = []
        for at in range(0, signal.size, CHUNK):
            block = Block(signal[at : at + CHUNK], self.source[at : at + CHUNK], at, self.grid)
            for run in runs:
                block = advance(run, block)
            parts.append(block.signal)
        return parts[0] if len(parts) == 1 else np.concatenate(parts)


@dataclass(frozen=True, eq=False)
class Taps:
    """A chain and all runs."""

    chain: Chain
    observations: tuple[Observation, ...]

    @cached_property
    def runs(self) -> tuple[Tapped, ...]:
        """Return the runs one by one."""
        return tuple(Tapped(self.chain, observation) for observation in self.observations)

    def changes(self, chains: Sequence[Chain], unit: float = 1.0) -> Matrix:
        """Return how the answers of ``chains`` differ where samples count, all runs in a row, shape (m, n).

        In units of the noise and per ``unit``; not finite where a chain overflows.
        """
        rows = np.empty((len(chains), sum(o.count for o in self.observations)))
        for run, part in zip(self.runs, self.parts, strict=True):
            run.write_changes(chains, unit, rows[:, part])
        return rows

    @cached_property
    def parts(self) -> tuple[slice, ...]:
        """Return where the samples of every run that count stand in a row of all."""
        ends = np.cumsum([0, *(o.count for o in self.observations)]).tolist()
        return tuple(map(slice, ends[:-1], ends[1:]))
