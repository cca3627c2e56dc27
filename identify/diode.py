"""Which level does a diode across a resistor leave? Shockley's law, solved sample by sample.

All voltages are in units of n V_T; at the ``knee`` the diode conducts as well as the resistor does.
"""

from typing import Any

import numpy as np
from numba import njit

from identify.trace import Array

BLOCKED = 40.0  # below the knee, where the current is no more than rounding
FAINT = -20.0  # of z, below which w = exp(z) (1 - exp(z)) to the last digit
NEAR = 5e-4  # of what is left of w + ln w = z, from which one step of the fourth order leaves less than rounding
CLOSE = 1e-16  # of 1 + x, that a step may leave
GRID = 24.0  # of v to a unit
SPARED = 3.0  # samples to a step of it, from which it is worth while


@njit(error_model="numpy", cache=True)
def omega(z: float) -> float:
    """Return Wright's omega, the w of w + ln w = z, to rounding: from a close start, one or two steps of fourth order.

    Source: F. N. Fritsch, R. E. Shafer and W. P. Crowley, Comm. ACM 16 (1973) 123; series at 1: R. M. Corless and
    D. J. Jeffrey, "The Wright omega function" (2002).
    """
    if z < -2.0:
        e = np.exp(z)
        w = e * (1.0 - e * (1.0 - 1.5 * e * (1.0 - 16.0 / 9.0 * e)))
        if z < FAINT:
            return float(w)
    elif z < 4.0:
        t = z - 1.0
        w = 1.0 + t * (0.5 + t * (1.0 / 16.0 - t * (1.0 / 192.0 + t * (1.0 / 3072.0 - t * (13.0 / 61440.0)))))
    else:
        e = np.log(z)
        w = z - e + e / z
    for _ in range(2):
        left, more = z - w - np.log(w), 1.0 + w
        fast = 2.0 * more * (more + 2.0 / 3.0 * left)
        w *= 1.0 + left / more * (fast - left) / (fast - 2.0 * left)
        if abs(left) < NEAR:
            break
    return float(w)


@njit(error_model="numpy", cache=True)
def _solved(knee: float, forward: bool, backward: bool, v: float) -> tuple[float, float, float]:
    """Return x, and how well the diode and its counterpart conduct there, to the resistor."""
    rest, size, up = np.exp(-knee), abs(v), v > 0.0
    with_it, against = (forward, backward) if up else (backward, forward)
    offset = ((1.0 if against else 0.0) - (1.0 if with_it else 0.0)) * rest
    x, on, off, z = size, 0.0, 0.0, size - offset - knee
    if with_it and z > -BLOCKED:
        on = omega(z)
        x = knee + z - on
    if against and knee < BLOCKED:
        off = rest * rest / on if on > 0.0 else np.exp(-x - knee)
        for _ in range(60):  # by Chebyshev's method, of third order
            ease = 1.0 / (1.0 + on + off)
            far = (x + on - off + offset - size) * ease
            bent = 0.5 * (on - off) * ease * far
            left = abs(far) * (2.0 * bent * bent + far * far * (on + off) * ease)
            x -= far * (1.0 + bent)
            on = np.exp(x - knee) if with_it else 0.0
            off = np.exp(-x - knee)
            if left < CLOSE * (1.0 + x):
                break
    return (x, on, off) if up else (-x, off, on)


@njit(error_model="numpy", cache=True)
def _quintic(now: Any, then: Any) -> tuple[float, float, float, float, float, float]:
    """Return the powers of the polynomial from 0 to 1 with this value, slope and bend at either end."""
    (x, slope, bend), (end, end_slope, end_bend) = now, then
    rise, steeper, more = end - x - slope - 0.5 * bend, end_slope - slope - bend, end_bend - bend
    third = 10.0 * rise - 4.0 * steeper + 0.5 * more
    fourth = 7.0 * steeper - 15.0 * rise - more
    return x, slope, 0.5 * bend, third, fourth, rise - third - fourth


@njit(error_model="numpy", cache=True)
def clamped(knee: float, forward: bool, backward: bool, v: Array, out: Array) -> None:
    """Solve x + exp(x - knee) - exp(-knee) = v for x: a diode across a resistor.

    ``forward`` says whether that diode is there, ``backward`` whether one of the other polarity is, which at v > 0
    conducts too little to move x far. Of many samples it is solved on a grid of v, with slope and bend, and read
    between to 1e-13.
    """
    low, high = np.inf, -np.inf
    for j in range(v.size):
        low, high = min(low, v[j]), max(high, v[j])
    first, steps = np.floor(low * GRID), np.floor(high * GRID) - np.floor(low * GRID) + 1.0
    if not SPARED * steps < v.size:
        for j in range(v.size):
            out[j] = _solved(knee, forward, backward, v[j])[0]
        return
    powers = np.empty((int(steps), 6))
    now = (0.0, 0.0, 0.0)
    for k in range(int(steps) + 1):
        x, on, off = _solved(knee, forward, backward, (first + k) / GRID)
        slope = 1.0 / (1.0 + on + off)
        then = (x, slope / GRID, (off - on) * slope**3 / GRID**2)
        if k:
            powers[k - 1] = _quintic(now, then)
        now = then
    for j in range(v.size):
        at = v[j] * GRID - first
        p, t = powers[int(at)], at - int(at)
        out[j] = p[0] + t * (p[1] + t * (p[2] + t * (p[3] + t * (p[4] + t * p[5]))))


@njit(error_model="numpy", cache=True)
def softened(level: float, slope: float, w: Array, out: Array) -> None:
    """Bend a line to ``slope`` around a level: w less (1 - slope) of ln(1 + exp(w - level)); zero stays zero."""
    rest = np.log1p(np.exp(-level))
    for j in range(w.size):
        z = w[j] - level
        drop = max(z, 0.0) + np.log1p(np.exp(-abs(z)))
        out[j] = w[j] - (1.0 - slope) * (drop - rest)
