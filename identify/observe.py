"""What a fit looks at: a trace, which of its samples count, how noisy they are, and how finely to simulate it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from identify.chain import Chain, simulate, source_voltage
from identify.trace import Array, Mask, Trace

FINEST = 16


@dataclass(frozen=True, eq=False)
class Observation:
    """One trace with ``use`` (N,) True where a residual counts, and the noise of one sample in V."""

    trace: Trace
    use: Mask
    noise_v: float
    substeps: int = 1

    @cached_property
    def source(self) -> Array:
        """Return the source voltage just before each instant."""
        return source_voltage(self.trace.u, self.trace.intersample, self.substeps)

    @cached_property
    def count(self) -> int:
        """Return how many samples count."""
        return int(np.count_nonzero(self.use))

    def residual(self, chain: Chain) -> Array:
        """Return y minus the chain's answer, V, shape (N,)."""
        return np.asarray(self.trace.y - simulate(chain, self.trace, self.substeps))

    def used_residual(self, chain: Chain) -> Array:
        """Return the residual of the samples that count, shape (count,)."""
        return self.residual(chain)[self.use]


def rms(values: Array) -> float:
    """Return the root mean square; 0 for no values."""
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else 0.0


def pooled_rms(parts: Sequence[Array]) -> float:
    """Return the root mean square over all parts together."""
    return rms(np.concatenate(list(parts))) if parts else 0.0


def refined(observation: Observation, chain: Chain) -> Observation:
    """Return the observation on a grid so fine that the error of stepping cannot be seen in its noise.

    The difference between one grid and the next finer one, summed over the run as a matched test would, stays below
    one standard deviation; the error falls at least twofold a halving, so the finer grid's own is smaller still.
    """
    current = simulate(chain, observation.trace, observation.substeps)
    substeps = observation.substeps
    while substeps < FINEST:
        finer = simulate(chain, observation.trace, 2 * substeps)
        energy = float(np.sum(np.square((finer - current)[observation.use]))) / observation.noise_v**2
        if energy < 1.0:
            break
        current, substeps = finer, 2 * substeps
    return observation if substeps == observation.substeps else replace(observation, substeps=substeps)
