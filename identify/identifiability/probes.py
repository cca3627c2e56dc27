"""What does the plain model hold by assumption that a rig could have: where is that put into a chain, and how large?

A probe is a stage that does nothing at value zero. It is never fitted: its sensitivity is compared with those of what
was fitted. Delays are one instant of the grid, which makes them exact. The offset at u has been there for ever, so it
stands behind G1 as what G1 has made of it.
"""

from dataclasses import dataclass

import numpy as np

from identify.blocks import LinearBlock
from identify.chain import Chain
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Stage, Values, memoryless
from identify.trace import Array

GAINS = ("gain of G1", "gain of F", "gain of G2")
DELAYS = ("delay before F", "delay behind F")
OFFSETS = ("offset of u", "offset of y")


def _untouched(signal: Array) -> Array:
    """Return the signal itself: what a probe at zero does, at no cost."""
    return signal


@dataclass(frozen=True)
class Factor(Stage):
    """A gain of 1 + value."""

    name: str
    place: Place

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the relative change."""
        return (Parameter(self.name, "V/V"),)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the gain at work."""
        factor = 1.0 + values[0]
        return memoryless((lambda signal: factor * signal) if values[0] else _untouched, shape)


@dataclass(frozen=True)
class Offset(Stage):
    """A constant voltage, ``gain`` times value."""

    name: str
    place: Place
    gain: float = 1.0

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the voltage."""
        return (Parameter(self.name, "V"),)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the offset at work."""
        added_v = self.gain * values[0]
        return memoryless((lambda signal: signal + added_v) if values[0] else _untouched, shape)


@dataclass(frozen=True)
class Late(Stage):
    """A delay of one instant for any value but zero; what came before the run is as its first value."""

    name: str
    place: Place

    def parameters(self) -> tuple[Parameter, ...]:
        """Return whether it is late."""
        return (Parameter(self.name, "s"),)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the delay at work."""
        if values[0] == 0.0:
            return memoryless(_untouched, shape)
        past: Array | None = None

        def run(block: Block) -> Array:
            nonlocal past
            before = block.signal[:1] if past is None else past
            past = block.signal[-1:]
            return np.concatenate((before, block.signal[:-1]))

        return run, shape


def probes(chain: Chain) -> tuple[Stage, ...]:
    """Return every probe for a chain of G1, F and G2."""
    g1 = next(s for s in chain.stages if isinstance(s, LinearBlock) and s.place is Place.G1)
    places = (Place.G1, Place.F, Place.G2)
    return (
        *(Factor(name, place) for name, place in zip(GAINS, places, strict=True)),
        *(Late(name, place) for name, place in zip(DELAYS, (Place.G1, Place.F), strict=True)),
        Offset(OFFSETS[0], Place.G1, g1.start.dc_gain), Offset(OFFSETS[1], Place.SENSE),
    )  # fmt: skip


def with_probes(chain: Chain) -> Chain:
    """Return the chain with every probe in it, at zero."""
    for probe in probes(chain):
        chain = chain.with_stage(probe, {probe.name: 0.0})
    return chain

