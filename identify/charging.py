"""How does a low-pass answer whose capacitor changes with the voltage on it: C (1 - k1 s - k2 s^2)?"""

from typing import Any

import numpy as np
from numba import njit

from identify.derivatives.lane_kernels import FAST, instants_of, put
from identify.derivatives.lanes import WIDTH, any_larger, larger, load, smaller, spread, store, where_same
from identify.trace import Array

LEAST = 0.1  # of C that is always left: a law that is fitted must not let it vanish
CLOSE = 1e-13  # of the larger of the level and a volt: what a step towards the level may leave
TURNS = 30


@njit(error_model="numpy", cache=True)
def _ends(k1: float, k2: float) -> tuple[float, float]:
    """Return the levels, V, on either side of zero up to which the law holds: there it has taken all of C but LEAST."""
    low, high = -np.inf, np.inf
    if k2 == 0.0:
        end = (1.0 - LEAST) / k1 if k1 != 0.0 else np.inf
        return (end, high) if end < 0.0 else (low, end)
    square = k1 * k1 + 4.0 * k2 * (1.0 - LEAST)
    if square >= 0.0:
        for sign in (-1.0, 1.0):
            end = (-k1 + sign * np.sqrt(square)) / (2.0 * k2)
            low, high = (max(low, end), high) if end < 0.0 else (low, min(high, end))
    return low, high


@njit(error_model="numpy", cache=True)
def _lost(law: tuple[float, float, float, float], level: float) -> tuple[float, float, float]:
    """Return the charge over C, V, by which the capacitor holds less than C would at a level, its slope and bend."""
    k1, k2, low, high = law
    inside = min(max(level, low), high)
    slope = inside * (k1 + inside * k2)
    bend = k1 + 2.0 * inside * k2 if inside == level else 0.0
    return inside * inside * (0.5 * k1 + inside * k2 / 3.0) + slope * (level - inside), slope, bend


@njit(error_model="numpy", cache=True)
def shares(tau: float) -> tuple[float, float, float, float]:
    """Return what a lag of ``tau`` steps keeps in a step of what goes straight, and its shares of the early and late
    end of that and of a whole.
    """
    mean = -tau * np.expm1(-1.0 / tau)
    return np.exp(-1.0 / tau), mean - np.exp(-1.0 / tau), 1.0 - mean, mean


@njit(error_model="numpy", cache=True)
def constants(k1: float, k2: float, tau: float) -> tuple[float, float, float, float, float, float, float, float]:
    """Return k1, k2, the ends of the law, what a lag keeps in a step, and shares of the early, late and last charge."""
    low, high = _ends(k1, k2)
    return k1, k2, low, high, *shares(tau)


@njit(error_model="numpy", cache=True)
def charged(
    k1: float, k2: float, tau: float, state: tuple[float, float], signal: Array, out: Array
) -> tuple[float, float]:
    """Answer as a low-pass of ``tau`` steps does with this capacitor, given what it would answer with C alone.

    With c(s) the charge that is missing, in V: s = signal + c(s) - g and tau dg/dt = c(s) - g, exactly; c is straight
    within a step. ``state`` is (g, c) before the first instant, returned as it ends.

    The level is foretold along the slope of the law and found by Chebyshev's method, of third order: mostly at once.
    """
    lag, before = state
    _, _, low, high, kept, early, late, weight = constants(k1, k2, tau)
    law = (k1, k2, low, high)
    curl, per_weight = abs(k2) * weight / 3.0, 1.0 / weight
    level, asked, steep = 0.0, 0.0, 0.0
    for j in range(signal.size):
        from_before = kept * lag + early * before
        right = signal[j] - from_before
        level = right if j == 0 else level + (right - asked) * steep
        asked = right
        for _ in range(TURNS):
            missing, slope, bend = _lost(law, level)
            steep = 1.0 / (1.0 - weight * slope)
            far = (level - weight * missing - right) * steep
            bent = -0.5 * weight * bend * steep * far
            level -= far * (1.0 + bent)
            left = abs(far) * (2.0 * bent * bent + curl * steep * far * far)
            if left <= CLOSE * max(abs(level), 1.0):
                break
        before = (level - right) * per_weight
        lag = from_before + late * before
        out[j] = level
    return lag, before


@njit(fastmath=FAST, error_model="numpy", cache=True)
def _nearer(law: Any, weight: Any, right: Any, level: Any) -> Any:
    """Return a level nearer to what solves level - weight lost(level) = right, the slope there, and what is left."""
    k1, k2, low, high = law
    one = spread(1.0)
    inside = smaller(larger(level, low), high)
    slope = inside * (k1 + inside * k2)
    missing = inside * inside * (0.5 * k1 + (1.0 / 3.0) * (inside * k2)) + slope * (level - inside)
    steep = one / (one - weight * slope)
    far = (level - weight * missing - right) * steep
    bent = -0.5 * (weight * where_same(inside, level, k1 + 2.0 * (inside * k2)) * steep * far)
    away, cubed = larger(far, -1.0 * far), (1.0 / 3.0) * (weight * larger(k2, -1.0 * k2) * steep * far * far)
    return level - far * (one + bent), steep, away * (2.0 * (bent * bent) + larger(cubed, -1.0 * cubed))


@njit(fastmath=FAST, error_model="numpy", cache=True)
def charged_abreast(capacitors: Array, state: Array, signals: Array) -> None:
    """Do what ``charged`` does to eight signals, shape (8, 8 n), each with its capacitor; it takes their place.

    ``capacitors``, shape (8, 8): a column of ``constants`` for each; ``state``, shape (2, 8): lag and charge, changed
    to those it ends with. All go on until none has further to go.
    """
    law = (load(capacitors, 0), load(capacitors, 1), load(capacitors, 2), load(capacitors, 3))
    kept, early, late, weight = load(capacitors, 4), load(capacitors, 5), load(capacitors, 6), load(capacitors, 7)
    per_weight, one, close = spread(1.0) / weight, spread(1.0), spread(CLOSE)
    lag, before, wide = load(state, 0), load(state, 1), signals.shape[1] // WIDTH
    near = np.empty((WIDTH, WIDTH))
    level, asked, steep = spread(0.0), spread(0.0), one
    for at in range(wide):
        for i, entering in enumerate(instants_of(signals, at, wide)):
            store(near, i, entering)
        for i in range(WIDTH):
            from_before = kept * lag + early * before
            right = load(near, i) - from_before
            level = level + (right - asked) * steep
            asked = right
            for _ in range(TURNS):
                level, steep, left = _nearer(law, weight, right, level)
                if not any_larger(left, close * larger(one, larger(level, -1.0 * level))):
                    break
            before = (level - right) * per_weight
            lag = from_before + late * before
            store(near, i, level)
        put(signals, at, wide, (
            load(near, 0), load(near, 1), load(near, 2), load(near, 3),
            load(near, 4), load(near, 5), load(near, 6), load(near, 7),
        ))  # fmt: skip
    store(state, 0, lag)
    store(state, 1, before)
