"""What is left of a low-pass's answer where a current is drawn from it that hangs on its level?"""

from typing import Any

from numba import njit

from identify.charging import shares
from identify.trace import Array

CLOSE = 1e-13  # of the larger of the level and a volt: what a step towards the level may leave
TURNS = 30
LEAST = 0.1  # of the slope by which the level is found: a law that gives back more than all is stepped to slowly


@njit(error_model="numpy", cache=True)
def current(first: float, step: float, rows: Array, level: float) -> tuple[float, float]:
    """Return the current times the resistance, V, and its slope: cubic pieces, beyond their ends as it is there.

    ``rows`` are ascending powers between knots ``first + i step``, those of the last knot behind them.
    """
    last = rows.shape[0] - 1
    at = (level - first) / step
    if not 0.0 <= at < last:  # nor is it where a search has led to no number
        return rows[last if at >= last else 0, 0], 0.0
    piece = int(at)
    t, row = level - (first + piece * step), rows[piece]
    return row[0] + t * (row[1] + t * (row[2] + t * row[3])), row[1] + t * (2.0 * row[2] + 3.0 * t * row[3])


@njit(error_model="numpy", cache=True)
def loaded(
    first: float, step: float, rows: Array, tau: float, state: tuple[float, float], signal: Array, out: Array
) -> Any:
    """Answer as a low-pass of ``tau`` steps that a current is drawn from, given what it would answer without.

    The level s is signal - e with tau de/dt = c(s) - e, exactly; c is straight within a step. ``state`` is (e, c)
    before the first instant, returned as it ends. The level is found by Newton's method.
    """
    lag, before = state
    kept, early, late, _ = shares(tau)
    for j in range(signal.size):
        right = signal[j] - kept * lag - early * before
        level = right - late * before
        for _ in range(TURNS):
            drawn, slope = current(first, step, rows, level)
            far = (level + late * drawn - right) / max(1.0 + late * slope, LEAST)
            level -= far
            if abs(far) <= CLOSE * max(abs(level), 1.0):
                break
        before = current(first, step, rows, level)[0]
        lag = signal[j] - level
        out[j] = level
    return lag, before
