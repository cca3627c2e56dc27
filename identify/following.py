"""How does a level follow a signal that it cannot keep up with?"""

import numpy as np
from numba import njit

from identify.trace import Array

NEAR = 1e-3  # over rate times lag: there sinh is its series


@njit(error_model="numpy", cache=True)
def slewed(most: float, level: float, signal: Array, out: Array) -> float:
    """Follow ``signal`` from ``level`` by at most ``most`` a step; return the last level."""
    for j in range(signal.size):
        level += min(max(signal[j] - level, -most), most)
        out[j] = level
    return level


@njit(error_model="numpy", cache=True)
def slewed_softly(most: float, lag: float, level: float, before: float, signal: Array, out: Array) -> float:
    """Follow ``signal`` from ``level`` by dw/dt = most tanh((signal - w) / (most lag)), time in steps; return the last.

    Within a step the signal is taken as its middle, and sinh of the argument then falls as exp(-t / lag), exactly.
    """
    reach, fall = most * lag, np.exp(-1.0 / lag)
    for j in range(signal.size):
        there = 0.5 * (before + signal[j])
        before = signal[j]
        far = abs(there - level) / reach
        if far > NEAR:
            gone = np.exp(-far)
            half = 0.5 * fall * (1.0 - gone * gone)
            far += np.log(half + np.sqrt(half * half + gone * gone))
        else:  # where that would lose digits
            far *= fall * (1.0 + far * far / 6.0)
            far *= 1.0 - far * far / 6.0
        level = there - np.copysign(far * reach, there - level)
        out[j] = level
    return level
