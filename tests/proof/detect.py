"""How clearly does concealed physics stand out of the noise, once the plain model has had its best try?

z is the norm, in standard deviations of the noise, of what the physics does to the training runs after everything is
projected out of it that the plain model's own values can do: a test matched to the physics would stand z standard
deviations out. First order in the plain values, on the bench's own integrator; nothing of the product is asked.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from tests.proof.bench import Playable, answer, noise_of, schedule
from tests.proof.cases import Concealed
from tests.proof.integrator import Array, Grid, held, linear_block
from tests.proof.physics import Scene, ideal_play
from tests.proof.rigs import Rig

COARSE = 2  # sub-steps of a sample: z is wanted to a tenth
DIFFERENCE = 1e-4
REALISATIONS = 4  # over which the effect of chance is averaged
NEAR = 0.07  # of a wanted z, on a log scale
TRIES = 12

Values = dict[str, float]


@dataclass(frozen=True)
class Reach:
    """What the training runs of a plain rig reach: u, v, w and the reading, V, and the speed of v in V/s."""

    rig: Rig
    u_v: float
    v_v: float
    low_w_v: float
    high_w_v: float
    speed_v: float
    start_s: float
    moving_s: tuple[float, ...]  # clock times at which the stimulus is moving


@dataclass(frozen=True)
class Sensed:
    """A plain rig with its training runs: what it answers, and what its own values can change in that."""

    case: Playable

    @cached_property
    def runs(self) -> tuple[tuple[Array, Grid, Array], ...]:
        """Return u, the grid and the noise of every training run."""
        numbered = [(i, s, at) for i, (s, at, held_out) in enumerate(schedule(self.case)) if not held_out]
        return tuple(
            (s.u, Grid(s.rate_hz, s.u.size, COARSE, at), noise_of(self.case, i, s.u.size)) for i, s, at in numbered
        )

    def answers(self, rig: Rig, physics: tuple[Concealed, ...] = (), seed: int = 0, noisy: bool = False) -> Array:
        """Return the readings of all training runs in a row, V."""
        return np.concatenate([
            answer(rig, u, grid, physics, seed, noise if noisy else None) for u, grid, noise in self.runs
        ])  # fmt: skip

    @cached_property
    def plain(self) -> Array:
        """Return the readings of the plain rig with the noise of the case."""
        return self.answers(self.case.rig, noisy=True)

    @cached_property
    def slopes(self) -> Array:
        """Return an orthonormal basis of what the plain model's values can do, shape (N, values)."""
        clean = self.answers(self.case.rig)
        columns = [(self.answers(moved) - clean) / DIFFERENCE for moved in neighbours(self.case.rig)]
        return np.linalg.qr(np.stack(columns, axis=1))[0]

    def z(self, concealed: Concealed, chance: bool = False) -> float:
        """Return the z of one piece of physics; where chance rules, of its mean effect over several realisations."""
        seeds = range(self.case.seed, self.case.seed + (REALISATIONS if chance else 1))
        changed = [self.answers(self.case.rig, (concealed,), seed, noisy=True) - self.plain for seed in seeds]
        change = np.mean(changed, axis=0)
        left = change - self.slopes @ (self.slopes.T @ change)
        return float(np.linalg.norm(left)) / self.case.rig.noise_v

    @cached_property
    def reach(self) -> Reach:
        """Return what the plain rig's signals reach."""
        rig, tops = self.case.rig, []
        for u, grid, _ in self.runs:
            v = linear_block(held(u, grid), rig.g1_num, rig.g1_den, grid.step_s)
            w = ideal_play(v, Scene(grid, rig, u, {}, 0))
            tops.append((np.abs(u).max(), np.abs(v).max(), w.min(), w.max(), np.abs(np.diff(v)).max() / grid.step_s))
        u_v, v_v, low, high, speed = np.array(tops).T
        moving = tuple(grid.start_s + t for u, grid, _ in self.runs for t in _moves(u, grid))
        return Reach(rig, u_v.max(), v_v.max(), low.min(), high.max(), speed.max(), self.runs[0][1].start_s, moving)


def _moves(u: Array, grid: Grid) -> list[float]:
    """Return the times since the start, s, at which a stimulus changes by much, away from both ends."""
    change = np.abs(np.diff(u))
    strong = np.flatnonzero(change > 0.5 * change.max())
    inside = strong[(strong > 0.1 * u.size) & (strong < 0.7 * u.size)]
    return [float(i / grid.rate_hz) for i in inside]


def neighbours(rig: Rig) -> list[Rig]:
    """Return rigs a small step away, one for every value that the plain model is free to move."""
    step = 1.0 + DIFFERENCE
    moved = [replace(rig, g1_den=_scaled(rig.g1_den, i, step)) for i in range(len(rig.g1_den) - 1)]
    moved += [replace(rig, g2_den=_scaled(rig.g2_den, i, step)) for i in range(len(rig.g2_den) - 1)]
    if rig.dead_time_s:
        moved.append(replace(rig, dead_time_s=rig.dead_time_s * step))
    if rig.linear or rig.tied:
        moved.append(replace(rig, s_l=rig.s_l * step, s_u=rig.s_u * step))
    else:
        moved += [replace(rig, s_l=rig.s_l * step), replace(rig, s_u=rig.s_u * step)]
    if rig.linear:
        return [*moved, replace(rig, d_l_v=rig.d_l_v + DIFFERENCE, d_u_v=rig.d_u_v + DIFFERENCE)]
    return [*moved, replace(rig, d_l_v=rig.d_l_v + DIFFERENCE), replace(rig, d_u_v=rig.d_u_v + DIFFERENCE)]


def _scaled(den: tuple[float, ...], at: int, step: float) -> tuple[float, ...]:
    return (*den[:at], den[at] * step, *den[at + 1 :])


def strength(z_of: Callable[[float], float], wanted: float, most: float = 1.0) -> tuple[float, float]:
    """Return the strength, at most ``most``, at which z is about ``wanted``, and the z it has there.

    A strength of zero is no physics; z grows with it. Secant steps on a log scale, kept inside what is known.
    """
    low, high = (0.0, 0.0), (most, z_of(most))
    if high[1] <= wanted:
        return high
    at, power = high, 1.0
    for _ in range(TRIES):
        guess = at[0] * (wanted / max(at[1], 1e-9)) ** (1.0 / power)
        if not low[0] < guess < high[0]:
            guess = float(np.sqrt(low[0] * high[0])) if low[0] else 0.03 * high[0]
        before, at = at, (guess, z_of(guess))
        if abs(np.log(max(at[1], 1e-9) / wanted)) < NEAR:
            break
        slope = np.log(max(at[1], 1e-9) / max(before[1], 1e-9)) / np.log(at[0] / before[0])
        power = float(np.clip(slope, 0.3, 3.0))
        low, high = (at, high) if at[1] < wanted else (low, at)
    return at
