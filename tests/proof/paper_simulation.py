"""What does the rig of the paper's simulation (section 6, eqs. 40a-c) answer, and how does that move with its values?

The rig is held as ten numbers, constant terms of the blocks being one: the space in which a Cramer-Rao bound is
computed. The "higher-order dynamics error" of eq. (40a), a zero at -5.01 beside a pole at -5, belongs to the rig and is
not among them: it moves the readings by less than any noise in the paper lets one see. The answers carry no noise.
"""

from dataclasses import dataclass

import numpy as np

from tests.proof.integrator import Array, Grid, between, held, linear_block, play, read_at

NAMES = (
    "G1.den.s2", "G1.den.s1", "F.S_L", "F.D_L", "F.S_U", "F.D_U",
    "G2.den.s3", "G2.den.s2", "G2.den.s1", "G2.dead_time",
)  # fmt: skip
# G1 = 0.499 (s + 5.01) / ((s + 1) (s + 0.5) (s + 5)); G2 = 0.08 exp(-5 s) / ((s + 0.2) (s + 0.4) (s + 1)).
TRUTH = np.array([2.0, 3.0, 1.76, 0.36, 1.76, -1.78, 12.5, 20.0, 8.5, 5.0])
G1_GAIN, G2_GAIN = 0.499 * 5.01 / 2.5, 1.0
ZERO, POLE = 1.0 / 5.01, 1.0 / 5.0  # s, of the error in G1
STEP = 1e-3  # of the central differences, relative


@dataclass(frozen=True)
class Played:
    """One stimulus: ``u`` held from t[k], V, shape (N,), at ``rate_hz``; and how finely the integrator steps it."""

    u: Array
    rate_hz: float
    substeps: int


def answer(values: Array, played: Played) -> Array:
    """Return the readings from rest, V, shape (N,); ``values`` in the order of NAMES."""
    a2, a1, s_l, d_l, s_u, d_u, c3, c2, c1, delay_s = (float(value) for value in values)
    grid = Grid(played.rate_hz, played.u.size, played.substeps)
    den = tuple(np.polymul((a2, a1, 1.0), (POLE, 1.0)).tolist())
    v = linear_block(held(played.u, grid), (G1_GAIN * ZERO, G1_GAIN), den, grid.step_s)
    w = play(s_l * (v - d_l), s_u * (v - d_u), 0.0, 1.0, 0.0)
    x = linear_block(between(w), (G2_GAIN,), (c3, c2, c1, 1.0), grid.step_s, rest=float(w[0]))
    return read_at(x, grid, delay_s)


def slopes(played: Played, at: Array = TRUTH) -> Array:
    """Return d answer / d values by central differences, shape (10, N)."""
    return np.array([
        (answer(at + step, played) - answer(at - step, played)) / (2.0 * np.sum(step))
        for step in STEP * np.diag(np.abs(at))
    ])  # fmt: skip


def information(played: tuple[Played, ...], at: Array = TRUTH) -> Array:
    """Return the Fisher information on the values under white noise of 1 V, shape (10, 10)."""
    return np.asarray(sum(rows @ rows.T for rows in (slopes(each, at) for each in played)))


def response(values: Array, block: str, frequency_hz: Array) -> Array:
    """Return G1(jw) / G1(0) or G2(jw) / G2(0), dead time included, complex, shape of ``frequency_hz``."""
    s = 2j * np.pi * np.asarray(frequency_hz)
    a2, a1 = values[:2]
    c3, c2, c1, delay_s = values[6:]
    if block == "G1":
        return np.asarray((ZERO * s + 1.0) / (POLE * s + 1.0) / ((a2 * s + a1) * s + 1.0))
    return np.asarray(np.exp(-s * delay_s) / (((c3 * s + c2) * s + c1) * s + 1.0))
