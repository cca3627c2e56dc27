"""What does a chain answer that differs from a known one from some stage on?

The signals of the known chain are kept behind every stage, so that only what comes after the first difference is run.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.between import source_of
from identify.chain import CHUNK, Chain, advance, grid_of
from identify.colour import whitening
from identify.observe import Observation
from identify.stage import Block, Grid, Ramp, Shape
from identify.trace import Array


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
    def _shapes(self) -> tuple[Shape, ...]:
        """Return the shape of what enters every stage, and of the answer."""
        shapes: list[Shape] = [Ramp()]
        for stage in self.chain.stages:
            shapes.append(stage.begin(self.chain.of(stage, self.grid.run), self.grid, shapes[-1])[1])
        return tuple(shapes)

    @cached_property
    def answer(self) -> Array:
        """Return the chain's answer where samples count, in units of the noise."""
        return self._seen(self.signals[-1])

    def change(self, chain: Chain) -> Array:
        """Return how the answer of ``chain`` differs where samples count, in units of the noise."""
        first = self._shared(chain)
        if first == len(chain.stages) == len(self.chain.stages):
            return np.zeros(self.observation.count)
        entering = self.signals[first - 1] if first else self.source
        return self._seen(self._through(chain, first, len(chain.stages), entering) - self.signals[-1])

    def _seen(self, signal: Array) -> Array:
        """Return a signal where samples count, in units of the noise, as a fit weighs it."""
        o = self.observation
        if not o.colour.white:
            return whitening(o.colour)(signal / o.noise_v, o.use)
        return np.asarray((signal if o.count == signal.size else signal[o.use]) / o.noise_v)

    def _shared(self, chain: Chain) -> int:
        """Return how many stages from the source on are the same with the same values."""
        pairs = zip(self.chain.stages, chain.stages, strict=False)
        shared = 0
        for mine, other in pairs:
            if mine is not other or self.chain.of(mine, self.grid.run) != chain.of(other, self.grid.run):
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
