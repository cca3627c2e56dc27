"""Compiled loops of play operators that hold w on a capacitor, make contact softly, or whose borders shake."""

from typing import Any

import numpy as np
from numba import njit

from identify.kernels import play_between
from identify.trace import Array

STILL = (1.0, 0.0, 0.0, 0.0, 0.0)  # the ``hold`` of a level that stays
NOTHING = 36.0  # times a diode's voltage short of the border: nothing flows that a double could show


@njit(error_model="numpy", cache=True)
def _held(hold: Any, middle: float, w: float, q: float) -> tuple[float, float]:
    """Return what a step of holding makes of w and of the charge q that the capacitor's dielectric has absorbed.

    ``hold`` is (keep, climb, across, to_w, to_q): w becomes keep w + climb + across times the ``middle`` of the gap,
    then q takes and gives.
    """
    w = hold[0] * w + hold[1] + hold[2] * middle
    apart = q - w
    return w + hold[3] * apart, q - hold[4] * apart


@njit(error_model="numpy", cache=True)
def _middle(lower: Array, upper: Array, j: int) -> float:
    """Return the middle between two borders, halfway through the step that ends at instant j."""
    i = max(j - 1, 0)
    return 0.25 * float(lower[i] + upper[i] + lower[j] + upper[j])


@njit(error_model="numpy", cache=True)
def held_play(lower: Array, upper: Array, hold: Any, state: Any, out: Array) -> Any:
    """Run a play between given borders whose level moves by itself at every step before the borders act.

    ``hold`` as in ``_held``; ``state`` is (w, q), returned as it ends. Where a border takes w along, the absorbed
    charge follows the middle of the step.
    """
    w, q = state
    if hold == STILL:
        return play_between(lower, upper, w, out), q
    for j in range(lower.size):
        free, q = _held(hold, _middle(lower, upper, j), w, q)
        w = min(max(free, lower[j]), upper[j])
        q += 0.5 * hold[4] * (w - free)
        out[j] = w
    return w, q


@njit(error_model="numpy", cache=True)
def creeping_play(
    lower: Array, upper: Array, first: float, step: float, moves: Array, w: float, out: Array
) -> float:  # fmt: skip
    """Run a play between given borders whose level creeps at every instant before they act, return where it ends.

    By ``moves``, V an instant, at levels ``first + i step``: straight between them, beyond as at the last.
    """
    last = moves.size - 1
    for j in range(lower.size):
        at = (w - first) / step
        if not 0.0 <= at < last:  # nor is it where a search has led to no number
            at = float(last) if at >= last else 0.0
        i = min(int(at), last - 1)
        w += moves[i] + (at - i) * (moves[i + 1] - moves[i])
        w = min(max(w, lower[j]), upper[j])
        out[j] = w
    return float(w)


@njit(error_model="numpy", cache=True)
def conducting_play(
    lower: Array, upper: Array, volts: Any, steps: float, hold: Any, state: Any, out: Array
) -> tuple[float, float, float, float]:
    """Run a play that its borders push through diodes: a border that is ahead by e of ``volts`` (lower, upper) moves w
    by ``steps`` exp(e / volts) times these in an instant.

    ``hold`` as in ``_held``; ``state`` is (w, q, the borders an instant before), NaN there at the start, returned as it
    ends. ``steps`` are positive.
    """
    w, q, below, above = state
    start = np.log(steps)
    for j in range(lower.size):
        low, high = lower[j], upper[j]
        if np.isnan(below):
            below, above = low, high
        free, q = _held(hold, _middle(lower, upper, j), w, q) if hold != STILL else (w, q)
        w = _conducted(below, low, free, volts[0], start)
        w = -_conducted(-above, -high, -w, volts[1], start)
        q += 0.5 * hold[4] * (w - free)
        below, above, out[j] = low, high, w
    return w, q, below, above


@njit(error_model="numpy", cache=True)
def _conducted(before: float, now: float, w: float, volts: float, start: float) -> float:
    """Return w after a step in which its lower border went straight from ``before`` to ``now``.

    With x = exp(-(border - w) / volts) the law is linear, dx/dt = -x (dborder/dt) / volts + exp(start): it is solved.
    """
    still, moved = (w - now) / volts, (now - before) / volts
    ahead = start + max(-moved, 0.0)
    if still > ahead + NOTHING:
        return w
    size = abs(moved)
    driven = ahead + (np.log(-np.expm1(-size) / size) if size > 1e-9 else 0.0)
    most = max(still, driven)
    return float(now + volts * (most + np.log1p(np.exp(-abs(still - driven)))))


@njit(error_model="numpy", cache=True)
def widened(late: float, known: Array, out: Array) -> None:
    """Write by how many V the speed of a signal pushes a border away, after ``late`` steps at that speed.

    ``known`` is the signal from three instants before the first of ``out``. The speed is the slope of the last step,
    carried on to its end by the lesser of the last two changes of slope; where the signal has turned round in between,
    the border stood where that turned.
    """
    for j in range(out.size):
        first, before, now = known[j + 1] - known[j], known[j + 2] - known[j + 1], known[j + 3] - known[j + 2]
        last, change = before - first, now - before
        on = min(abs(change), abs(last)) if change * last > 0.0 else 0.0
        fast = late * abs(now + 0.5 * np.copysign(on, change))
        out[j] = -abs(now) if before * now < 0.0 else fast


@njit(error_model="numpy", cache=True, fastmath={"reassoc", "nsz"})  # levels are summed several at once
def plays_abreast(
    lower: Array, upper: Array, later_l: Array, later_u: Array, hold: Any, w: Array, q: Array, out: Array
) -> None:
    """Run the mean of plays whose borders lie ``later_l`` below and ``later_u`` above the given ones.

    Each holds its level as in ``held_play``; the levels ``w`` and charges ``q`` are left as they end.
    """
    still = hold == STILL
    share = 1.0 / w.size
    for j in range(lower.size):
        total, low, high, middle = 0.0, lower[j], upper[j], _middle(lower, upper, j)
        if still:
            for i in range(w.size):
                w[i] = min(max(w[i], low - later_l[i]), high + later_u[i])
                total += w[i]
        else:
            for i in range(w.size):
                free, charge = _held(hold, middle, w[i], q[i])
                level = min(max(free, low - later_l[i]), high + later_u[i])
                w[i], q[i] = level, charge + 0.5 * hold[4] * (level - free)
                total += level
        out[j] = total * share


@njit(error_model="numpy", cache=True)
def _pushed(w: float, border: float, per_unit: float, unit: float, gains: Array) -> float:
    """Return the mean of w after half a step beside a border that shakes below it.

    ``gains`` are how much is gained from heights 0, 1, 2 and so on, in a ``unit`` of height; beyond, nothing is. For a
    border above it, w, border, and what is returned are negative.
    """
    at = (w - border) * per_unit
    if not at < gains.size - 1:
        return w
    at = max(at, 0.0)
    i = int(at)
    return float(border + unit * (at + gains[i] + (at - i) * (gains[i + 1] - gains[i])))


@njit(error_model="numpy", cache=True)
def _rest(speed: float, unit: float, rests: Array) -> float:
    """Return how high w rests above a border that runs on towards it at a ``speed``, in sd a unit of the noise's time.

    ``rests`` are over x / (1 + x), x the fourth root of the speed; infinity where the border does not come nearer.
    """
    if not speed > 0.0:
        return np.inf
    root = np.sqrt(np.sqrt(speed))
    at = root / (1.0 + root) * rests.size if root < np.inf else float(rests.size)
    i = min(int(at), rests.size - 2)
    return float(unit * (rests[i] + (at - i) * (rests[i + 1] - rests[i])))


@njit(error_model="numpy", cache=True)
def _followed(
    w: float, border: float, speed: float, per_unit: float, unit: float, gains: Array, rests: Array
) -> float:
    """Return as ``_pushed`` does, but no further above the border than where w would rest if that runs on at a speed.

    However long a step is, a fast border is thus followed; one out of reach pushes not.
    """
    there = _pushed(w, border, per_unit, unit, gains)
    if there == w:
        return w
    highest = border + _rest(speed, unit, rests)
    return there if there < highest else max(highest, min(there, w))


@njit(error_model="numpy", cache=True)
def noisy_plays(
    lower: Array, upper: Array, later_l: Array, later_u: Array, sd: Any, shaken: Any, hold: Any,
    last: Any, w: Array, q: Array, out: Array,
) -> Any:  # fmt: skip
    """Run the mean of plays whose borders shake by ``sd``, lower and upper, in units of w.

    Half of a step's time is spent at its end, half of the next one's at its beginning: errors of the two cancel.
    ``shaken`` are the gains of ``_pushed``, the rests of ``_followed``, both in 1 / per_sd of a sd, per_sd, and a step
    in the noise's unit of time; ``hold`` as in ``held_play``, the rest as in ``plays_abreast``. ``last`` are the last
    borders, not a number before the first step; they are returned, levels and charges are left as they end.
    """
    gains, rests, per_sd, renewed = shaken
    per_l, per_u, unit_l, unit_u = per_sd / sd[0], per_sd / sd[1], sd[0] / per_sd, sd[1] / per_sd
    slow_l, slow_u = 1.0 / (sd[0] * renewed), 1.0 / (sd[1] * renewed)
    still, share = hold == STILL, 1.0 / w.size
    last_l, last_u = last
    for j in range(lower.size):
        speed_l, speed_u = (lower[j] - last_l) * slow_l, (last_u - upper[j]) * slow_u
        middle, total = _middle(lower, upper, j), 0.0
        for i in range(w.size):
            low, high = lower[j] - later_l[i], upper[j] + later_u[i]
            free, charge = (w[i], q[i]) if still else _held(hold, middle, w[i], q[i])
            level = _followed(free, low, speed_l, per_l, unit_l, gains, rests)
            level = -_followed(-level, -high, speed_u, per_u, unit_u, gains, rests)
            total += level  # of the time around an instant, half is before it, and half behind
            level = _pushed(level, low, per_l, unit_l, gains)
            w[i] = -_pushed(-level, -high, per_u, unit_u, gains)
            q[i] = charge + 0.5 * hold[4] * (w[i] - free)
        out[j] = total * share
        last_l, last_u = lower[j], upper[j]
    return last_l, last_u
