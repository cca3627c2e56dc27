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

    Within a step the signal is taken as one value of it, and sinh of the argument then falls as exp(-t / lag), exactly:
    that value is followed to where a straight signal is, where all of it is near.
    """
    reach, fall = most * lag, np.exp(-1.0 / lag)
    share = -1.0 / np.expm1(-1.0 / lag) - lag  # half a step where the lag is long, all but the lag where it is short
    for j in range(signal.size):
        there = before + share * (signal[j] - before)
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
