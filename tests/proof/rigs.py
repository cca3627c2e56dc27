"""Which rigs stand on the trial bench, as plain numbers."""

from dataclasses import dataclass, replace

import numpy as np

Coefficients = tuple[float, ...]


@dataclass(frozen=True)
class Rig:
    """G1 -> play -> G2: coefficients in descending powers of s; borders w = s (v - d), slopes in V/V, d in V.

    The rising border (s_l, d_l_v) bounds w from below, the falling one (s_u, d_u_v) from above.
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


# Paper eqs. (46)-(47).
OP_AMP = Rig("op-amp", (1000.0,), (1e-4, 20.0, 1000.0), 8.0, 1.25, 8.0, -1.25, (1000.0,), (1e-6, 2.0, 1000.0))
# Unequal slopes and an off-centre gap: even harmonics, and a mean that depends on the amplitude.
SKEWED = replace(OP_AMP, name="skewed", s_l=7.0, d_l_v=1.0, s_u=8.5, d_u_v=-1.3)
# One RC section each: a missing pole has no spare pole of the plain model to hide in.
RC = replace(OP_AMP, name="RC", g1_den=(20.0, 1000.0), g2_den=(2.0, 1000.0))


def toleranced(rig: Rig, seed: int, fraction: float = 0.02) -> Rig:
    """Return the rig with every value off by a few per cent, as parts are: the rig file is then only a start."""
    rng = np.random.default_rng([seed, 77])

    def off(value: float) -> float:
        return value * (1.0 + fraction * float(rng.uniform(-1.0, 1.0)))

    def block(den: Coefficients) -> Coefficients:
        return (*(off(a) for a in den[:-1]), den[-1])

    return replace(
        rig, name=f"{rig.name}, parts within {100 * fraction:g} %", g1_den=block(rig.g1_den), g2_den=block(rig.g2_den),
        s_l=off(rig.s_l), d_l_v=off(rig.d_l_v), s_u=off(rig.s_u), d_u_v=off(rig.d_u_v),
    )
