"""What did the paper measure, and how much of it: its staircase and its sines, on its simulated and on its real rig?

The same amount of data as there (M = 200 readings of each level, 100 periods of 628 readings) at its signal-to-noise
ratios, answered by the integrator. What a trace holds beside them, to start from rest, is marked as not valid.
"""

from dataclasses import dataclass, replace

import numpy as np

from identify.model import Backlash, Model, Rational
from identify.trace import Mask, Step, Trace
from tests.proof import paper_simulation as simulated
from tests.proof.bench import answer
from tests.proof.integrator import Array, Grid
from tests.proof.paper_simulation import G1_GAIN, G2_GAIN, TRUTH, Played
from tests.proof.rigs import OP_AMP, Rig
from tests.proof.stimuli import FIG13_LEVELS_V

LEVELS = np.array(FIG13_LEVELS_V)
M, PERIODS, PER_PERIOD = 200, 100, 628
W1 = 0.01  # rad/s
MAINS_HZ = 50.0  # w1 = 100 pi of the real rig
TABLE_3 = Backlash(1.7535, 0.3564, 1.7535, -1.7821)  # behind Table 3 (physics.md 1.5), V_p = G2(0) = 1


@dataclass(frozen=True, eq=False)
class Experiment:
    """What a bench without noise reads, and which of it the paper had: ``used`` (N,)."""

    name: str
    kind: str
    played: Played
    clean: Array
    used: Mask

    @property
    def power(self) -> float:
        """Return the signal power P_x of eq. (41), V^2."""
        return float(np.mean(np.square(self.clean[self.used])))

    def noise_v(self, decibels: float) -> float:
        """Return the noise of one reading at a signal-to-noise ratio."""
        return float(np.sqrt(self.power / 10.0 ** (decibels / 10.0)))

    def trace(self, noise_v: float, seed: int) -> Trace:
        """Return one realisation."""
        noise = np.random.default_rng([seed, sum(map(ord, self.name))]).normal(0.0, noise_v, self.clean.size)
        whole = (Step(self.name, self.kind, 0, self.clean.size),)
        read = self.clean + noise
        return Trace(self.name, self.played.rate_hz, self.played.u, read, steps=whole, valid=self.used)

    def readings(self, trace: Trace) -> Array:
        """Return the settled readings of every level of a staircase, shape (26, 200)."""
        return np.asarray(trace.y[self.used].reshape(LEVELS.size, M))


def values_with(borders: Backlash) -> Array:
    """Return the simulated rig with other borders, given in the paper's scale."""
    values = TRUTH.copy()
    values[2:6] = borders.s_l / G1_GAIN, borders.d_l_v * G1_GAIN, borders.s_u / G1_GAIN, borders.d_u_v * G1_GAIN
    return values


def walk(values: Array = TRUTH) -> Experiment:
    """Return the staircase of Fig. 13 on the simulated rig: 26 levels of 100 s, 10 readings a second."""
    played = Played(np.repeat(LEVELS, 1000), 10.0, 16)
    used = np.tile(np.arange(1000) >= 1000 - M, LEVELS.size)
    return Experiment("staircase", "staircase", played, simulated.answer(values, played), used)


def tone(times: int, amplitude_v: float, periods: int = PERIODS, lead: int = 2) -> Experiment:
    """Return a sine at ``times`` w1 on the simulated rig."""
    played = Played(_cosine(amplitude_v, lead + periods), PER_PERIOD * times * W1 / (2.0 * np.pi), 16)
    used = np.arange(played.u.size) >= lead * PER_PERIOD
    name = f"{times} w1, {amplitude_v:g} V"
    return Experiment(name, "sine", played, simulated.answer(TRUTH, played), used)


def real_walk(share: float = 0.6) -> Experiment:
    """Return the staircase on the rig of eqs. (46)-(47), its levels scaled so that no rail is met."""
    dwell = 2500
    played = Played(np.repeat(share * LEVELS, dwell), 1e4, 16)
    used = np.tile(np.arange(dwell) >= dwell - M, LEVELS.size)
    return Experiment("staircase", "staircase", played, read(OP_AMP, played), used)


def real_tone(times: int, amplitude_v: float, periods: int = PERIODS) -> Experiment:
    """Return a sine at ``times`` 50 Hz on the rig of eqs. (46)-(47)."""
    lead = 1 + int(np.ceil(0.25 * times * MAINS_HZ))
    played = Played(_cosine(amplitude_v, lead + periods), PER_PERIOD * times * MAINS_HZ, 8)
    used = np.arange(played.u.size) >= lead * PER_PERIOD
    return Experiment(f"{times} w1, {amplitude_v:g} V", "sine", played, read(OP_AMP, played), used)


def read(rig: Rig, played: Played) -> Array:
    """Return what a rig of the trial bench answers."""
    return answer(rig, played.u, Grid(played.rate_hz, played.u.size, played.substeps))


REAL_NAMES = ("g1_den", "s_l", "d_l_v", "s_u", "d_u_v", "g2_den")
REAL_TRUTH = np.array([OP_AMP.g1_den[1], 8.0, 1.25, 8.0, -1.25, OP_AMP.g2_den[1]])


def real_rig(values: Array) -> Rig:
    """Return the rig of eqs. (46)-(47) with other borders and other slow time constants; its fast ones do not show."""
    g1, s_l, d_l, s_u, d_u, g2 = (float(value) for value in values)
    one, two = OP_AMP.g1_den, OP_AMP.g2_den
    return replace(
        OP_AMP, g1_den=(one[0], g1, one[2]), s_l=s_l, d_l_v=d_l, s_u=s_u, d_u_v=d_u, g2_den=(two[0], g2, two[2])
    )


def real_information(made: Experiment) -> Array:
    """Return the Fisher information of one experiment on ``REAL_TRUTH`` under white noise of 1 V, shape (6, 6)."""
    moves = 1e-3 * np.diag(np.abs(REAL_TRUTH))
    rows = np.array([
        (read(real_rig(REAL_TRUTH + move), made.played) - read(real_rig(REAL_TRUTH - move), made.played))[made.used]
        / (2.0 * np.sum(move))
        for move in moves
    ])  # fmt: skip
    return np.asarray(rows @ rows.T)


def information(made: Experiment) -> Array:
    """Return the Fisher information of one experiment on ``TRUTH`` under white noise of 1 V, shape (10, 10)."""
    rows = simulated.slopes(made.played)[:, made.used]
    return np.asarray(rows @ rows.T)


def _cosine(amplitude_v: float, periods: int) -> Array:
    return np.tile(amplitude_v * np.cos(2.0 * np.pi * np.arange(PER_PERIOD) / PER_PERIOD), periods)


def settled_levels(borders: Backlash) -> Array:
    """Return w at the 26 levels of Fig. 13, from rest, shape (26,)."""
    w, found = 0.0, []
    for u in LEVELS:
        w = min(max(w, borders.s_l * (u - borders.d_l_v)), borders.s_u * (u - borders.d_u_v))
        found.append(w)
    return np.array(found)


def level_slopes(borders: Backlash, step: float = 1e-6) -> Array:
    """Return d levels / d (S_L, D_L, S_U, D_U), shape (26, 4)."""
    at = np.array([borders.s_l, borders.d_l_v, borders.s_u, borders.d_u_v])
    return np.array([
        (settled_levels(Backlash(*(at + row))) - settled_levels(Backlash(*(at - row)))) / (2.0 * step)
        for row in step * np.eye(4)
    ]).T  # fmt: skip


def rig_file(off: float = 0.1) -> Model:
    """Return the model of the simulated rig with every value off by a tenth, up and down in turn.

    G1 has the two poles of eq. (38a) and not the error beside them, which no noise in the paper lets one see.
    """
    a2, a1, s_l, d_l, s_u, d_u, c3, c2, c1, delay_s = TRUTH * (1.0 + off * np.where(np.arange(10) % 2, -1.0, 1.0))
    return Model(
        "the paper's simulation", Rational((G1_GAIN,), (a2, a1, 1.0)), Backlash(s_l, d_l, s_u, d_u),
        Rational((G2_GAIN,), (c3, c2, c1, 1.0), delay_s),
    )  # fmt: skip
