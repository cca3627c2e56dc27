"""How do the rigs and recordings of the independent integrator become the models and traces of the product?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.model import Backlash, LinearF, Model, Physics, Rational
from identify.observe import Observation
from identify.trace import Array, Stored, Trace
from tests.proof.bench import answer
from tests.proof.cases import Concealed
from tests.proof.integrator import Grid
from tests.proof.rigs import Rig
from tests.proof.stimuli import Stimulus

FINE = 32  # sub-steps of a sample in the integrator


def model_of(rig: Rig, physics: Sequence[Physics] = ()) -> Model:
    """Return the product's model of a rig of the trial bench."""
    borders = Backlash(rig.s_l, rig.d_l_v, rig.s_u, rig.d_u_v, tied=rig.tied)
    f = LinearF(rig.s_l, -rig.s_l * rig.d_l_v) if rig.linear else borders
    return Model(
        rig.name, Rational(rig.g1_num, rig.g1_den), f, Rational(rig.g2_num, rig.g2_den, rig.dead_time_s), rig.noise_v,
        physics=tuple(physics),
    )  # fmt: skip


def recorded(
    rig: Rig, stimulus: Stimulus, physics: Sequence[Concealed] = (), noise_v: float = 0.0, seed: int = 0,
    start_s: float = 0.0, fine: int = FINE,
) -> Trace:  # fmt: skip
    """Return what the integrator says a bench would record."""
    grid = Grid(stimulus.rate_hz, stimulus.u.size, fine, start_s)
    noise = np.random.default_rng([seed, 99]).normal(0.0, 1.0, stimulus.u.size) * noise_v
    y = answer(rig, stimulus.u, grid, tuple(physics), seed, noise)
    return Trace(stimulus.name, stimulus.rate_hz, stimulus.u, y, start_s=start_s)


def noisy(trace: Trace, noise_v: float, seed: int) -> Trace:
    """Return a trace with white Gaussian noise added."""
    noise = np.random.default_rng(seed).normal(0.0, noise_v, trace.size)
    return Trace(trace.name, trace.rate_hz, trace.u, trace.y + noise, trace.intersample, trace.start_s, trace.steps)


@dataclass(frozen=True)
class Shelf(Stored):
    """A signal of which slices are handed out, as if from a file."""

    values: Array

    def read(self, start: int, stop: int) -> Array:
        """Return a copy of the samples [start, stop)."""
        assert 0 <= start < stop <= self.size
        return self.values[start:stop].copy()


def shelved(trace: Trace) -> Trace:
    """Return a trace whose signals are read by slices."""
    return replace(trace, u=Shelf(trace.size, trace.u), y=Shelf(trace.size, trace.y))


def observed(trace: Trace, noise_v: float, substeps: int = 2) -> Observation:
    """Return the observation of a trace of which every sample counts."""
    return Observation(trace, np.ones(trace.size, dtype=bool), noise_v, substeps)
