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
REALISATIONS = 6  # over which the effect of chance is averaged
SPECTRA = 16  # realisations of a noise over which its power is averaged
SMOOTH = 9  # lines of a spectrum that are averaged
NEAR = 0.07  # of a wanted z, on a log scale
TRIES = 12
TINY = 1e-9

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
    """A plain rig with its training runs: what it answers, and what its own values can change in that.

    ``beside`` is noise that is concealed in it, too, of the reading or in front of the gap. ``steps`` are the
    sub-steps of a sample.
    """

    case: Playable
    beside: tuple[Concealed, ...] = ()
    steps: int = COARSE

    @cached_property
    def runs(self) -> tuple[tuple[Array, Grid, Array], ...]:
        """Return u, the grid and the noise of every training run."""
        numbered = [(i, s, at) for i, (s, at, held_out) in enumerate(schedule(self.case)) if not held_out]
        return tuple(
            (s.u, Grid(s.rate_hz, s.u.size, self.steps, at), noise_of(self.case, i, s.u.size)) for i, s, at in numbered
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
        if self.steps != COARSE:
            return replace(self, steps=COARSE).slopes
        clean = self.answers(self.case.rig)
        columns = [(self.answers(moved) - clean) / DIFFERENCE for moved in neighbours(self.case.rig)]
        return np.linalg.qr(np.stack([self._weighed(column) for column in columns], axis=1))[0]

    @cached_property
    def louder(self) -> tuple[Array, ...]:
        """Return by how much what scatters beside makes each line of a run's spectrum louder than white, in amplitude.

        The mean of a run is as uncertain as its lowest line: the bench's noise has none, a real one does.
        """
        power = [np.zeros(u.size // 2 + 1) for u, _, _ in self.runs]
        courses = [self.answers(self.case.rig, self.beside, seed) for seed in range(SPECTRA if self.beside else 0)]
        mean = np.mean(courses, axis=0) if courses else 0.0  # of noise in front of the gap, it is no noise
        for course in courses:
            added = self._runs(course - mean)
            power = [p + _power(a) / (SPECTRA - 1) for p, a in zip(power, added, strict=True)]
        lines = (np.concatenate((p[1:2], p[1:])) / self.case.rig.noise_v**2 for p in power)
        return tuple(np.sqrt(1.0 + line) for line in lines)

    def z(self, concealed: Concealed) -> float:
        """Return the z of one piece of physics."""
        return float(np.linalg.norm(self._left(self._change(concealed, self.case.seed)))) / self.case.rig.noise_v

    def z_with(self, others: tuple[Concealed, ...], concealed: Concealed) -> float:
        """Return the z of one piece of physics where others are at work, after what their own values can copy of it.

        A range that they keep readings from hides it, and so does a lag beside one of its kind.
        """
        both, alone = (
            self.answers(self.case.rig, physics, self.case.seed, noisy=True)
            for physics in ((*others, concealed), others)
        )
        left, copies = self._left(both - alone), self._copies(others)
        left = left - copies.T @ np.linalg.lstsq(copies.T, left, rcond=None)[0] if copies.size else left
        return float(np.linalg.norm(left)) / self.case.rig.noise_v

    def _copies(self, others: tuple[Concealed, ...]) -> Array:
        """Return what each value of physics changes that the plain model's cannot, of norm 1, shape (values, N)."""
        here = self.answers(self.case.rig, others, self.case.seed)
        rows = []
        for i, one in enumerate(others):
            for key, value in ((k, v) for k, v in one.values.items() if v):
                moved = replace(one, values={**one.values, key: value * (1.0 + DIFFERENCE)})
                there = (*others[:i], moved, *others[i + 1 :])
                rows.append(self._left(self.answers(self.case.rig, there, self.case.seed) - here))
        sizes = [float(np.linalg.norm(row)) for row in rows]
        return np.array([row / size for row, size in zip(rows, sizes, strict=True) if size > 0.0])

    def z_of_signal(self, concealed: Concealed) -> float:
        """Return the z of physics that moves readings in time: what that does to their noise tells nothing."""
        change = self.answers(self.case.rig, (concealed,), self.case.seed) - self.answers(self.case.rig)
        return float(np.linalg.norm(self._left(change))) / self.case.rig.noise_v

    def z_of_mean(self, concealed: Concealed) -> float:
        """Return the z of the mean effect of physics in which chance rules, in the noise that its chance adds to.

        The products of different realisations have the squared mean for their mean.
        """
        seeds = range(self.case.seed, self.case.seed + REALISATIONS)
        left = [self._left(self._change(concealed, seed)) for seed in seeds]
        each, whole = np.mean([np.sum(c**2) for c in left]), np.sum(np.sum(left, axis=0) ** 2)
        mean2 = max(float(whole - REALISATIONS * each) / (REALISATIONS * (REALISATIONS - 1)), 0.0)
        noise2 = self.case.rig.noise_v**2 + max(float(each) - mean2, 0.0) / left[0].size
        return float(np.sqrt(mean2 / noise2))

    def z_of_spectrum(self, concealed: Concealed) -> float:
        """Return the z of added noise: the root of twice the information by which its spectrum departs from white.

        With rho the ratio of added to white power, a line of the spectrum tells rho - ln(1 + rho).
        """
        z2 = 0.0
        for added, louder in zip(self._runs(self._change(concealed, self.case.seed)), self.louder, strict=True):
            power = _power(added)[1:] / np.square(louder[1:] * self.case.rig.noise_v)
            ratio = np.convolve(power, np.full(SMOOTH, 1.0 / SMOOTH), mode="same")
            z2 += 2.0 * float(np.sum(ratio - np.log1p(ratio)))
        return float(np.sqrt(z2))

    def _change(self, concealed: Concealed, seed: int) -> Array:
        return self.answers(self.case.rig, (concealed,), seed, noisy=True) - self.plain

    def _left(self, change: Array) -> Array:
        """Return what of a change the plain model's values cannot do, in a noise that is white."""
        weighed = self._weighed(change)
        return weighed - self.slopes @ (self.slopes.T @ weighed)

    def _weighed(self, change: Array) -> Array:
        """Return a change as it stands out where all noise together is white."""
        if not self.beside:
            return change
        runs = zip(self._runs(change), self.louder, strict=True)
        return np.concatenate([np.fft.irfft(np.fft.rfft(run) / louder, run.size) for run, louder in runs])

    def _runs(self, readings: Array) -> list[Array]:
        """Return the readings of every run."""
        return np.split(readings, np.cumsum([u.size for u, _, _ in self.runs])[:-1])

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


def _power(noise: Array) -> Array:
    """Return the power of every line of a spectrum, V^2; white noise has its variance in each."""
    return np.asarray(np.abs(np.fft.rfft(noise)) ** 2 / noise.size)


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

    A strength of zero is no physics; z grows with it. Steps along the power law through the last two, kept inside what
    is known; the nearest is returned.
    """
    low, high = (0.0, 0.0), (most, z_of(most))
    if high[1] <= wanted:
        return high
    at, power, seen = high, 1.0, [high]
    for _ in range(TRIES):
        guess = at[0] * (wanted / max(at[1], TINY)) ** (1.0 / power)
        if not low[0] < guess < high[0]:
            guess = 0.5 * (low[0] + high[0]) if low[0] else 0.1 * high[0]
        before, at = at, (guess, z_of(guess))
        seen.append(at)
        if abs(np.log(max(at[1], TINY) / wanted)) < NEAR:
            break
        slope = np.log(max(at[1], TINY) / max(before[1], TINY)) / np.log(at[0] / before[0])
        power = float(np.clip(slope, 0.3, 30.0))
        low, high = (at, high) if at[1] < wanted else (low, at)
    return min(seen, key=lambda pair: abs(np.log(max(pair[1], TINY) / wanted)))
