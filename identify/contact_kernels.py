"""The compiled loops of a play whose contact is of another kind: it sticks, gives way, kicks as it opens, or rings."""

import numpy as np
from numba import njit

from identify.trace import Array

OPENS_V = 1e-9  # by which a border has left w once contact is lost: where v rests, rounding moves it by less


@njit(error_model="numpy", cache=True)
def sticking_play(
    s_l: float, d_l: float, s_u: float, d_u: float, stuck: float, w: float, slides: bool, v: Array, out: Array
) -> tuple[float, bool]:
    """Run a play operator that has to be pushed ``stuck`` past a border once it rested, and jumps there.

    From the level w, sliding or not; return both at the end.
    """
    for j in range(v.size):
        lower, upper = s_l * (v[j] - d_l), s_u * (v[j] - d_u)
        give = 0.0 if slides else stuck
        if w < lower - give or w > upper + give:
            w, slides = min(max(w, lower), upper), True
        elif lower < w < upper:
            slides = False
        out[j] = w
    return w, slides


@njit(error_model="numpy", cache=True)
def kicking_play(
    lower: Array, upper: Array, at: Array, kicks: Array, state: tuple[float, int], out: Array
) -> tuple[float, int]:
    """Run a play operator whose level w is kicked away from a border where contact opens, by what hangs on w there.

    ``kicks`` are those of both borders, shape (2, knots), straight between the levels ``at``. ``state``: w, and the
    border it stands at, 0 or 1, or -1; returned as it is at the end. ``out`` may be one of the borders.
    """
    w, side = state
    for j in range(lower.size):
        low, high = lower[j], upper[j]
        if w <= low:
            w, side = low, 0
        elif w >= high:
            w, side = high, 1
        elif side >= 0 and w > low + OPENS_V and w < high - OPENS_V:
            kick = np.interp(w, at, kicks[side])
            w = min(max(w + kick if side == 0 else w - kick, low), high)
            side = -1
        out[j] = w
    return w, side


@njit(error_model="numpy", cache=True)
def timed_play(
    lower: Array, upper: Array, state: tuple[float, int, float], since: Array, out: Array
) -> tuple[float, int, float]:
    """Run a play operator and tell how many instants ago contact was made, from 1 on: below zero that with ``upper``.

    Zero before any. ``state``: w, the border it stands at, 0 or 1, or -1, and the last of ``since``; returned as they
    are at the end. ``out`` may be one of the borders.
    """
    w, side, ago = state
    for j in range(lower.size):
        low, high = lower[j], upper[j]
        now = side
        if w <= low:
            w, now = low, 0
        elif w >= high:
            w, now = high, 1
        elif w > low + OPENS_V and w < high - OPENS_V:
            now = -1
        if now >= 0 and now != side:
            ago = 1.0 if now == 0 else -1.0
        else:
            ago += np.sign(ago)
        side, since[j], out[j] = now, ago, w
    return w, side, ago


@njit(error_model="numpy", cache=True)
def giving_play(
    lower: Array, upper: Array, steps: float, state: tuple[float, float, float], out: Array
) -> tuple[float, float, float]:
    """Run a play operator that in contact follows its border as a lag of 1 / ``steps`` instants does.

    A border is straight between instants; contact is made and lost within a step. ``state``: the borders an instant
    before, w; returned as they are at the end. ``out`` may be one of the borders.
    """
    stays, (below, above, w) = np.exp(-steps), state
    for j in range(lower.size):
        low, high = lower[j], upper[j]
        if low > w or below > w:
            w = _lifted(below, low, w, steps, stays)
        if high < w or above < w:
            w = -_lifted(-above, -high, -w, steps, stays)
        below, above, out[j] = low, high, w
    return below, above, w


@njit(error_model="numpy", cache=True)
def _lifted(before: float, now: float, w: float, steps: float, stays: float) -> float:
    """Return w after a step in which its lower border went from ``before`` to ``now``, above w at one of them."""
    moved, ahead = now - before, before - w
    trail = moved / steps  # by which w trails a border that goes on like this
    if ahead <= 0.0:
        return float(now - trail * (1.0 - np.exp(-(now - w) / moved * steps)))
    left = trail + (ahead - trail) * stays
    if left >= 0.0:
        return float(now - left)
    return float(before + trail * np.log1p(-ahead / trail))


@njit(error_model="numpy", cache=True)
def struck(
    since: Array, v: Array, slopes: tuple[float, float], step_s: float, knots: Array, after: Array,
    state: tuple[float, float], out: Array,
) -> tuple[float, float]:  # fmt: skip
    """Add to ``out`` what goes on after contact, s, in proportion to how fast that was made, away from the border.

    ``since`` is as ``timed_play`` tells it, ``after`` straight between two or more times, ``knots``, s, and the same
    beyond them. ``slopes`` are those of both borders; ``state``: v before the first instant and the speed of w at the
    last contact, V/s, returned as they are at the end.
    """
    before, speed = state
    k, last = 0, knots.size - 2
    for j in range(v.size):
        sign = np.sign(since[j])
        if abs(since[j]) == 1.0:
            speed, k = (slopes[0] if sign > 0.0 else slopes[1]) * (abs(v[j] - before) / step_s), 0
        before = v[j]
        if sign == 0.0:
            continue
        ago_s = (abs(since[j]) - 1.0) * step_s
        while k < last and ago_s >= knots[k + 1]:
            k += 1
        slope = (after[k + 1] - after[k]) / (knots[k + 1] - knots[k])
        out[j] += sign * speed * (slope * (min(max(ago_s, knots[0]), knots[-1]) - knots[k]) + after[k])
    return before, speed
