"""Which rigs stand on the trial bench, as plain numbers."""

from dataclasses import dataclass, replace

import numpy as np

Coefficients = tuple[float, ...]
Rng = np.random.Generator


@dataclass(frozen=True)
class Rig:
    """G1 -> play -> G2: coefficients in descending powers of s; borders w = s (v - d), slopes in V/V, d in V.

    The rising border (s_l, d_l_v) bounds w from below, the falling one (s_u, d_u_v) from above. ``linear`` and ``tied``
    are what the rig file says of F: no gap at all (then d_l_v = d_u_v), or one slope for both borders.
    """

    name: str
    g1_num: Coefficients
    g1_den: Coefficients
    s_l: float
    d_l_v: float
    s_u: float
    d_u_v: float
    g2_num: Coefficients
    g2_den: Coefficients
    noise_v: float = 0.010
    dead_time_s: float = 0.0
    linear: bool = False
    tied: bool = False

    @property
    def half_gap_v(self) -> float:
        """Return half the width of the gap: the amplitude of v below which F is stuck."""
        return 0.5 * (self.d_l_v - self.d_u_v)


# Paper eqs. (46)-(47).
OP_AMP = Rig("op-amp", (1000.0,), (1e-4, 20.0, 1000.0), 8.0, 1.25, 8.0, -1.25, (1000.0,), (1e-6, 2.0, 1000.0))
# Unequal slopes and an off-centre gap: even harmonics, and a mean that depends on the amplitude.
SKEWED = replace(OP_AMP, name="skewed", s_l=7.0, d_l_v=1.0, s_u=8.5, d_u_v=-1.3)
# One RC section each: a missing pole has no spare pole of the plain model to hide in.
RC = replace(OP_AMP, name="RC", g1_den=(20.0, 1000.0), g2_den=(2.0, 1000.0))

# One stage makes both slopes, and the rig file says so; and a rig whose file knows no gap at all.
ONE_SLOPE = replace(OP_AMP, name="one slope", tied=True)
LINEAR = replace(OP_AMP, name="linear", d_l_v=0.0, d_u_v=0.0, linear=True)

THIRD = 1.0 / 3.0


def drawn_rig(rng: Rng) -> Rig:
    """Draw a rig like the paper's with other parts: orders, corners, gap, slopes, a dead time in some, 1-30 mV noise.

    The second pole of a block, where it has one, is as near as an RC section's or as far as an amplifier's.
    """
    slope, half = between(rng, 3.0, 14.0), between(rng, 0.4, 2.2)
    middle = half * float(rng.uniform(-0.25, 0.25))
    ratio = float(np.exp(rng.uniform(0.04, 0.25) * rng.choice((-1.0, 1.0)))) if rng.uniform() < THIRD else 1.0
    return Rig(
        "drawn", (1.0,), _poles(rng, between(rng, 25.0, 150.0)), slope, middle + half, slope * ratio, middle - half,
        (1.0,), _poles(rng, between(rng, 200.0, 1500.0)), between(rng, 1e-3, 30e-3),
        between(rng, 50e-6, 2e-3) if rng.uniform() < THIRD / 2.0 else 0.0,
    )  # fmt: skip


def _poles(rng: Rng, slow: float) -> Coefficients:
    """Return 1 + s / slow, with a second real pole in every other draw."""
    if rng.uniform() < 0.5:
        return (1.0 / slow, 1.0)
    fast = slow * (between(rng, 3.0, 12.0) if rng.uniform() < 0.5 else between(rng, 100.0, 3000.0))
    return (1.0 / (slow * fast), 1.0 / slow + 1.0 / fast, 1.0)


def between(rng: Rng, low: float, high: float) -> float:
    """Return a number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def first_order(rig: Rig) -> Rig:
    """Return the rig with one pole a block, the slower one: a missing pole then has no spare pole to hide in."""
    return replace(rig, g1_den=rig.g1_den[-2:], g2_den=rig.g2_den[-2:])


def toleranced(rig: Rig, seed: int, fraction: float = 0.02) -> Rig:
    """Return the rig with every value off by a few per cent, as parts are: the rig file is then only a start."""
    rng = np.random.default_rng([seed, 77])

    def off(value: float) -> float:
        return value * (1.0 + fraction * float(rng.uniform(-1.0, 1.0)))

    def block(den: Coefficients) -> Coefficients:
        return (*(off(a) for a in den[:-1]), den[-1])

    built = replace(
        rig, name=f"{rig.name}, parts within {100 * fraction:g} %", g1_den=block(rig.g1_den), g2_den=block(rig.g2_den),
        s_l=off(rig.s_l), d_l_v=off(rig.d_l_v), s_u=off(rig.s_u), d_u_v=off(rig.d_u_v),
        dead_time_s=off(rig.dead_time_s) if rig.dead_time_s else 0.0,
    )  # fmt: skip
    if rig.linear or rig.tied:  # one slope; without a gap the two borders are one
        built = replace(built, s_u=built.s_l)
    return replace(built, d_u_v=built.d_l_v) if rig.linear else built
