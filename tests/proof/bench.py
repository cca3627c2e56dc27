"""What does a bench record when this rig, with this concealed physics, plays these stimuli?"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tests.proof.cases import Case, Concealed
from tests.proof.integrator import Array, Grid, between, held, linear_block, read_at
from tests.proof.physics import WHERE, Place, Scene, ideal_play
from tests.proof.rigs import Rig
from tests.proof.stimuli import Segment, Stimulus

SUBSTEPS = 32  # of a sample; tests/unit/proof/test_accuracy.py measures what is left of the error
PAUSE_S = 2.3  # between two runs, while the operator changes the protocol


@dataclass(frozen=True)
class Run:
    """One recording: ``u`` held from t[k], ``y`` read at t[k] just before u[k] acts, both V, shape (N,).

    t[k] = start_s + k / rate_hz on a clock that all runs of a case share.
    """

    name: str
    u: Array
    y: Array
    rate_hz: float
    start_s: float
    steps: tuple[Segment, ...]
    held_out: bool


@dataclass(frozen=True)
class _Path:
    """The signal path of one run, with the concealed physics at their places."""

    grid: Grid
    rig: Rig
    u: Array
    physics: tuple[Concealed, ...]
    seed: int

    def through(self, place: Place, signal: Array) -> Array:
        """Return the signal after everything concealed at ``place``, in the order of the case."""
        for concealed in self.physics:
            where, change = WHERE[concealed.name]
            if where == place:
                signal = change(signal, Scene(self.grid, self.rig, self.u, concealed.values, self.seed))
        return signal

    def play(self, v: Array) -> Array:
        """Return w of the operator, or of the one concealed physics that replaces it."""
        if self._count("play") == 0:
            return ideal_play(v, Scene(self.grid, self.rig, self.u, {}, self.seed))
        return self.through("play", v)

    def read(self, x: Array) -> Array:
        """Return x at the readings, shape (samples,)."""
        return self.through("late", x) if self._count("late") else read_at(x, self.grid)

    def _count(self, place: Place) -> int:
        count = sum(WHERE[concealed.name][0] == place for concealed in self.physics)
        if count > 1:
            raise ValueError(f"{count} physics at place {place}: each replaces what stands there, so one is allowed")
        return count


def answer(rig: Rig, u: Array, grid: Grid, physics: tuple[Concealed, ...] = (), seed: int = 0) -> Array:
    """Return the readings without noise, V, shape (samples,), of a rig at rest (v = w = 0, hold capacitor emptied)."""
    path = _Path(grid, rig, u, physics, seed)
    v = path.through("v", linear_block(held(u, grid), rig.g1_num, rig.g1_den, grid.step_s))
    w = path.through("w", path.play(v))
    x = path.through("x", linear_block(between(w), rig.g2_num, rig.g2_den, grid.step_s, rest=float(w[0])))
    return path.through("y", path.read(x))


def schedule(case: Case) -> Iterator[tuple[Stimulus, float, bool]]:
    """Yield every stimulus of the case, its start on the clock in s, and whether it is held out."""
    start_s = 0.0
    for stimuli, held_out in ((case.training, False), (case.held_out, True)):
        for stimulus in stimuli:
            yield stimulus, start_s, held_out
            start_s += stimulus.u.size / stimulus.rate_hz + PAUSE_S


def record(case: Case, substeps: int = SUBSTEPS) -> tuple[Run, ...]:
    """Return all recordings of a case, training first, with the white Gaussian noise of its rig."""
    runs = []
    for number, (stimulus, start_s, held_out) in enumerate(schedule(case)):
        grid = Grid(stimulus.rate_hz, stimulus.u.size, substeps, start_s)
        clean = answer(case.rig, stimulus.u, grid, case.physics, case.seed)
        noise = np.random.default_rng([case.seed, number]).normal(0.0, case.rig.noise_v, clean.size)
        runs.append(
            Run(stimulus.name, stimulus.u, clean + noise, stimulus.rate_hz, start_s, stimulus.segments, held_out)
        )
    return tuple(runs)
