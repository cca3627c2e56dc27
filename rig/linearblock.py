"""Is num(s)/den(s) a block that can be played, and how long does a chain of such blocks take to settle?"""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rig.errors import MisfitError

Coefficients = tuple[Sequence[float], Sequence[float]]
"""num and den in descending powers of s."""
INSTANTS = 4096
SMALLEST, LARGEST = 1e-100, 1e100
UNSTABLE_AT = -1e-9
"""Largest real part of a pole, relative to its distance from 0, that still counts as stable."""


def check_block(num: Sequence[float], den: Sequence[float]) -> None:
    """Raise MisfitError unless num/den is proper and has a gain at 0 Hz (assumption A1)."""
    odd = next((value for value in (*num, *den) if value and not SMALLEST <= abs(value) <= LARGEST), None)
    if odd is not None:
        raise MisfitError("a coefficient that no rig has", value=f"{odd:g}",
                          allowed=f"0, or {SMALLEST:g} to {LARGEST:g} in size", do="check its power of 10")
    if den[0] == 0:
        raise MisfitError("the leading coefficient of den is 0", do="leave it out: powers of s descend")
    if not any(num):
        raise MisfitError("num is 0: nothing would pass this block")
    if len(np.trim_zeros(np.asarray(num, dtype=float), "f")) > len(den):
        raise MisfitError("more zeros than poles", value=f"order {len(num) - 1} over {len(den) - 1}",
                          allowed="the order of num at most that of den", do="add the pole that limits it")
    if num[-1] == 0:
        raise MisfitError("no gain at 0 Hz", do="model a.c. coupling as physics: input_ac_coupling or ac_coupling")


def check_stable(den: Sequence[float]) -> None:
    """Raise MisfitError unless every root of den(s) lies left of 0."""
    roots = poles(den)
    if roots.size == 0:
        return
    worst = roots[np.argmax(roots.real)]
    if worst.real > UNSTABLE_AT * max(abs(worst), np.finfo(float).tiny) or worst == 0:
        raise MisfitError("the block is not stable", value=f"a pole at {worst.real:.6g} rad/s",
                          allowed="every pole left of 0", do="check the signs in den")


def may_start_unstable(den: Sequence[float]) -> bool:
    """Return whether values some 30 % off can make a stable denominator this one: its order is 3 or more, and all its
    coefficients have one sign."""
    return len(den) > 3 and (min(den) > 0.0 or max(den) < 0.0)


def poles(den: Sequence[float]) -> NDArray[np.complex128]:
    """Return the roots of den(s), in rad/s."""
    return np.asarray(np.roots(np.asarray(den, dtype=float)), dtype=np.complex128)


def settling_time_s(blocks: Sequence[Coefficients], dead_time_s: float, fraction: float) -> float:
    """Return the time in s after which the step response of a chain of (num, den) stays within ``fraction`` of its end.

    Read off the exact response at INSTANTS instants, rounded up to the next of them. Raises MisfitError when a block is
    not stable.
    """
    for _, den in blocks:
        check_stable(den)
    num, den = _product([num for num, _ in blocks]), _product([den for _, den in blocks])
    if len(den) == 1:
        return dead_time_s
    tau_s = float((-1.0 / poles(den).real).max())
    step_s = tau_s * (math.log(1.0 / fraction) + 5.0 * len(den)) / INSTANTS
    outside = np.flatnonzero(np.abs(_remainder(num, den, step_s)) > fraction)
    return dead_time_s + (step_s * (outside[-1] + 1) if outside.size else 0.0)


def _product(polynomials: Sequence[Sequence[float]]) -> tuple[float, ...]:
    product = np.ones(1)
    for polynomial in polynomials:
        product = np.convolve(product, polynomial)
    return tuple(product.tolist())


def _remainder(num: tuple[float, ...], den: tuple[float, ...], step_s: float) -> NDArray[np.float64]:
    """Return what is left of the step response to its end, relative to it, at instants ``step_s`` apart from 0 s on."""
    from scipy.linalg import expm

    from identify.discretise import companion

    a, b, taps, _, w0 = companion(num, den)
    state = np.linalg.solve(a, b)[:, 0]
    forward, states = expm(a * (w0 * step_s)), np.empty((INSTANTS, state.size))
    for instant in range(INSTANTS):
        states[instant] = state
        state = forward @ state
    return np.asarray(states @ taps * den[-1] / num[-1], dtype=np.float64)
