"""How does a level follow a signal that it cannot keep up with?"""

import numpy as np
from numba import njit

from identify.trace import Array


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
    reach, fall = most * lag, 1.0 / lag
    for j in range(signal.size):
        there = 0.5 * (before + signal[j])
        before = signal[j]
        far = abs(there - level) / reach
        if far > 0.0:
            log_sinh = far + np.log(0.5 * -np.expm1(-2.0 * far)) - fall
            left = log_sinh + np.log(2.0) if log_sinh > 20.0 else np.arcsinh(np.exp(log_sinh))
            level = there - np.copysign(left * reach, there - level)
        out[j] = level
    return level
