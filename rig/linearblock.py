"""Is num(s)/den(s) a block that can be played, and how long does a chain of such blocks take to settle?"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.errors import MisfitError

UNSTABLE_AT = -1e-9
"""Largest real part of a pole, relative to its distance from 0, that still counts as stable."""


def check_block(num: Sequence[float], den: Sequence[float]) -> None:
    """Raise MisfitError unless num/den is proper, asymptotically stable, and has a gain at 0 Hz (assumption A1)."""
    if den[0] == 0:
        raise MisfitError("the leading coefficient of den is 0", do="leave it out: powers of s descend")
    if not any(num):
        raise MisfitError("num is 0: nothing would pass this block")
    if len(np.trim_zeros(np.asarray(num, dtype=float), "f")) > len(den):
        raise MisfitError("more zeros than poles", value=f"order {len(num) - 1} over {len(den) - 1}",
                          allowed="the order of num at most that of den", do="add the pole that limits it")
    if num[-1] == 0:
        raise MisfitError("no gain at 0 Hz", do="model a.c. coupling as physics: input_ac_coupling or ac_coupling")
    _check_stable(poles(den))


def poles(den: Sequence[float]) -> NDArray[np.complex128]:
    """Return the roots of den(s), in rad/s."""
    return np.asarray(np.roots(np.asarray(den, dtype=float)), dtype=np.complex128)


def settling_time_s(dens: Sequence[Sequence[float]], dead_time_s: float, fraction: float) -> float:
    """Return the time in s after which the step response of a chain stays within ``fraction`` of its step.

    For real poles the remainder is the tail of a sum of exponential waiting times, so Chernoff's bound holds:
    min over 0 < q < 1/tau_max of (ln(1/fraction) - sum ln(1 - q tau_i)) / q. Complex poles enter by their decay.
    """
    taus = np.concatenate([-1.0 / poles(den).real for den in dens if len(den) > 1] or [np.empty(0)])
    if taus.size == 0 or not 0 < fraction < 1:
        return dead_time_s
    q = np.linspace(0.0, 1.0, 2000)[1:-1] / taus.max()
    bound = (math.log(1.0 / fraction) - np.log1p(-np.outer(q, taus)).sum(axis=1)) / q
    return dead_time_s + float(bound.min())


def _check_stable(roots: NDArray[np.complex128]) -> None:
    if roots.size == 0:
        return
    worst = roots[np.argmax(roots.real)]
    if worst.real > UNSTABLE_AT * max(abs(worst), np.finfo(float).tiny) or worst == 0:
        raise MisfitError("the block is not stable", value=f"a pole at {worst.real:.6g} rad/s",
                          allowed="every pole left of 0", do="check the signs in den")
