"""What does a bench record when this rig, with this concealed physics, plays these stimuli?"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from tests.proof.cases import Concealed
from tests.proof.composed import COMPOSED
from tests.proof.integrator import Array, Grid, between, held, linear_block, read_at, read_when
from tests.proof.outside import OUTSIDE
from tests.proof.physics import WHERE, Place, Scene, ideal_play
from tests.proof.rigs import Rig
from tests.proof.stimuli import Segment, Stimulus

SUBSTEPS = 32  # of a sample; tests/unit/proof/test_accuracy.py measures what is left of the error
LAWS = {**WHERE, **OUTSIDE, **COMPOSED}
SPARE = 64  # samples simulated beyond the end: a clock may run fast, a reading may be lost


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
            where, change = LAWS[concealed.name]
            if where == place:
                signal = change(signal, self._scene(concealed.values))
        return signal

    def play(self, v: Array) -> Array:
        """Return w of the operator, or of the one concealed physics that replaces it; ValueError when two would."""
        count = self._count("play")
        if count > 1:
            raise ValueError(f"{count} physics at place play: each replaces the operator, so one is allowed")
        return self.through("play", v) if count else ideal_play(v, self._scene({}))

    def read(self, x: Array) -> Array:
        """Return x at the readings, shape (samples,)."""
        if not self._count("late"):
            return read_at(x, self.grid, self.rig.dead_time_s)
        return read_when(x, self.through("late", self.grid.sample_s - self.rig.dead_time_s), self.grid.step_s)

    def _count(self, place: Place) -> int:
        return sum(LAWS[concealed.name][0] == place for concealed in self.physics)

    def _scene(self, values: dict[str, float]) -> Scene:
        return Scene(self.grid, self.rig, self.u, values, self.seed)


def answer(
    rig: Rig, u: Array, grid: Grid, physics: tuple[Concealed, ...] = (), seed: int = 0, noise_v: Array | None = None
) -> Array:
    """Return the readings, V, shape (samples,), of a rig at rest (v = w = 0, hold capacitor emptied).

    ``noise_v`` is what the amplifiers add to the readings before they are converted, V, shape (samples,).
    """
    u = np.concatenate([u, np.full(SPARE, u[-1])])
    path = _Path(replace(grid, samples=u.size), rig, u, physics, seed)
    step_s = grid.step_s
    drive = path.through("drive", held(path.through("dac", u), grid))
    w = path.play(path.through("v", linear_block(drive, rig.g1_num, rig.g1_den, step_s)))
    w = path.through("w", w)
    x = path.through("x", linear_block(between(w), rig.g2_num, rig.g2_den, step_s, rest=float(w[0])))
    y = path.through("y", path.read(x))
    if noise_v is not None:
        y[: noise_v.size] += noise_v
    return path.through("adc", y)[: grid.samples]


class Playable(Protocol):
    """What is played to which rig, and what is concealed in it."""

    @property
    def rig(self) -> Rig: ...
    @property
    def physics(self) -> tuple[Concealed, ...]: ...
    @property
    def training(self) -> tuple[Stimulus, ...]: ...
    @property
    def held_out(self) -> tuple[Stimulus, ...]: ...
    @property
    def seed(self) -> int: ...


def schedule(case: Playable) -> Iterator[tuple[Stimulus, float, bool]]:
    """Yield every stimulus of the case, its start on the clock in s, and whether it is held out."""
    end_s = 0.0
    for stimuli, held_out in ((case.training, False), (case.held_out, True)):
        for stimulus in stimuli:
            start_s = end_s + stimulus.pause_s if end_s else 0.0
            yield stimulus, start_s, held_out
            end_s = start_s + stimulus.u.size / stimulus.rate_hz


def noise_of(case: Playable, number: int, samples: int) -> Array:
    """Return the white Gaussian noise of a run of the case, V, shape (samples,)."""
    return np.random.default_rng([case.seed, number]).normal(0.0, case.rig.noise_v, samples)


def record(case: Playable, substeps: int = SUBSTEPS) -> tuple[Run, ...]:
    """Return all recordings of a case, training first, with the white Gaussian noise of its rig."""
    runs = []
    for number, (stimulus, start_s, held_out) in enumerate(schedule(case)):
        grid = Grid(stimulus.rate_hz, stimulus.u.size, substeps, start_s)
        noise_v = noise_of(case, number, stimulus.u.size)
        y = answer(case.rig, stimulus.u, grid, case.physics, case.seed, noise_v)
        runs.append(Run(stimulus.name, stimulus.u, y, stimulus.rate_hz, start_s, stimulus.segments, held_out))
    return tuple(runs)
