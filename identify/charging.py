"""How does a low-pass answer whose capacitor changes with the voltage on it?"""

import numpy as np
from numba import njit

from identify.trace import Array

LEAST = 0.1  # of C that is always left: a law that is fitted must not let it vanish
CLOSE = 1e-13  # of the larger of the level and a volt: a step of Newton's by which a level is found
TURNS = 30


@njit(error_model="numpy", cache=True)
def _lost(k: float, widest: float, level: float) -> tuple[float, float]:
    """Return the charge over C, V, by which C (1 - k s^2) holds less than C at a level, and its slope."""
    inside = min(max(level, -widest), widest)
    slope = k * inside * inside
    return slope * (inside / 3.0 + level - inside), slope


@njit(error_model="numpy", cache=True)
def charged(k: float, tau: float, state: tuple[float, float], signal: Array, out: Array) -> tuple[float, float]:
    """Answer as a low-pass of ``tau`` steps does whose capacitor is C (1 - k s^2), given what it would with C alone.

    With c(s) the charge that is missing, in V: s = signal + c(s) - g and tau dg/dt = c(s) - g, exactly; c is straight
    within a step. ``state`` is (g, c) before the first instant, returned as it ends.
    """
    lag, before = state
    widest = np.sqrt((1.0 - LEAST) / k) if k > 0.0 else np.inf
    kept = np.exp(-1.0 / tau)
    mean = -tau * np.expm1(-1.0 / tau)  # of the lag's answer over a step
    early, late = mean - kept, 1.0 - mean
    level = 0.0
    for j in range(signal.size):
        from_before = kept * lag + early * before
        right = signal[j] - from_before
        level = right if j == 0 else level + signal[j] - signal[j - 1]
        for _ in range(TURNS):
            missing, slope = _lost(k, widest, level)
            step = (level - (1.0 - late) * missing - right) / (1.0 - (1.0 - late) * slope)
            level -= step
            if abs(step) <= CLOSE * max(abs(level), 1.0):
                break
        before = _lost(k, widest, level)[0]
        lag = from_before + late * before
        out[j] = level
    return lag, before
