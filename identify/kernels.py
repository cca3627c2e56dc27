"""The compiled loops over samples, all in one place.

What is many numbers they write into arrays they are given. An array that compiled code returns is wrapped by a call
back into Python, where Ctrl-C pressed meanwhile is raised and numba goes on with nothing: the process crashes
(``nrt_adapt_ndarray_to_python`` of numba 0.68, ``numba/core/pythonapi.py``).

State-space rows, taps and states are tuples, so that numba knows the order at compile time and unrolls it.
``advance``, ``pushed`` and ``dot`` recurse over those tuples; the recursion is resolved while compiling.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numba.extending import overload

from identify.trace import Array

# Sums may be reordered and fused, NaN and infinity keep their meaning.
_FAST = {"contract", "reassoc", "nsz"}
_IN_ORDER = {"contract", "nsz"}


def dot(c: Any, x: Any) -> Any:
    """Return the inner product of two tuples of equal length (compiled code only)."""
    raise NotImplementedError("compiled code only")


def advance(rows: Any, g0: Any, g1: Any, x: Any, a: Any, b: Any) -> Any:
    """Return the next state rows @ x + g0 a + g1 b, all tuples (compiled code only)."""
    raise NotImplementedError("compiled code only")


def onto(start: Any, c: Any, x: Any) -> Any:
    """Return start + the inner product of two tuples, what ``x`` adds last: it is waited for (compiled code only)."""
    raise NotImplementedError("compiled code only")


def pushed(rows: Any, pushes: Any, x: Any, s: Any) -> Any:
    """Return rows @ x + pushes @ s, all tuples (compiled code only)."""
    raise NotImplementedError("compiled code only")


@overload(dot, strict=False, jit_options={"fastmath": _FAST})
def _dot(c: Any, x: Any) -> Callable[..., Any]:
    if len(c) == 1:
        return lambda c, x: c[0] * x[0]
    return lambda c, x: dot(c[1:], x[1:]) + c[0] * x[0]


@overload(advance, strict=False, jit_options={"fastmath": _FAST})
def _advance(rows: Any, g0: Any, g1: Any, x: Any, a: Any, b: Any) -> Callable[..., Any]:
    if len(rows) == 1:
        return lambda rows, g0, g1, x, a, b: ((g0[0] * a + g1[0] * b) + dot(rows[0], x),)
    return lambda rows, g0, g1, x, a, b: (
        ((g0[0] * a + g1[0] * b) + dot(rows[0], x),) + advance(rows[1:], g0[1:], g1[1:], x, a, b)  # noqa: RUF005
    )


@overload(onto, strict=False, jit_options={"fastmath": _IN_ORDER})
def _onto(start: Any, c: Any, x: Any) -> Callable[..., Any]:
    if len(c) == 1:
        return lambda start, c, x: start + c[0] * x[0]
    return lambda start, c, x: onto(start + c[0] * x[0], c[1:], x[1:])


@overload(pushed, strict=False, jit_options={"fastmath": _IN_ORDER})
def _pushed(rows: Any, pushes: Any, x: Any, s: Any) -> Callable[..., Any]:
    if len(rows) == 1:
        return lambda rows, pushes, x, s: (onto(dot(pushes[0], s), rows[0], x),)
    return lambda rows, pushes, x, s: (
        (onto(dot(pushes[0], s), rows[0], x),) + pushed(rows[1:], pushes[1:], x, s)  # noqa: RUF005
    )


@njit(fastmath=_FAST, error_model="numpy", cache=True)
def linear(one: Any, four: Any, state: Any, last: float, signal: Array, out: Array) -> Any:
    """Run a linear block over ``signal``: x[j] = rows x[j-1] + g0 s[j-1] + g1 s[j], out[j] = c x[j] + d s[j].

    ``one`` are (rows, g0, g1, c, d) of a step, ``four`` the same of four at once (discretise.Stepper): a state waits
    for the one before it, what the signal adds does not.
    """
    rows, g0, g1, c, d = one
    rows4, pushes, reads, feeds = four
    whole = signal.size - signal.size % 4
    for j in range(0, whole, 4):
        s = (last, signal[j], signal[j + 1], signal[j + 2], signal[j + 3])
        out[j], out[j + 1], out[j + 2], out[j + 3] = pushed(reads, feeds, state, s)
        state = pushed(rows4, pushes, state, s)
        last = signal[j + 3]
    for j in range(whole, signal.size):
        state = advance(rows, g0, g1, state, last, signal[j])
        last = signal[j]
        out[j] = dot(c, state) + d * last
    return state, last


@njit(error_model="numpy", cache=True)
def play(s_l: float, d_l: float, s_u: float, d_u: float, w: float, v: Array, out: Array) -> float:
    """Run the play operator of eq. (7) over v from the level w; return the last level."""
    for j in range(v.size):
        w = min(max(w, s_l * (v[j] - d_l)), s_u * (v[j] - d_u))
        out[j] = w
    return w


@njit(error_model="numpy", cache=True)
def _piece(knots: Array, at: int, v: float) -> int:
    """Return the piece of a border v is in, from the piece ``at`` it was in before: v moves little in a sample."""
    while at < knots.size and v > knots[at]:
        at += 1
    while at > 0 and v <= knots[at - 1]:
        at -= 1
    return at


@njit(error_model="numpy", cache=True)
def _on_border(origins: Array, rows: Array, at: int, v: float) -> float:
    """Return w on piece ``at`` of a border: a cubic in v - origin."""
    t = v - origins[at]
    return float(rows[at, 0] + t * (rows[at, 1] + t * (rows[at, 2] + t * rows[at, 3])))


@njit(error_model="numpy", cache=True)
def curved_play(
    knots_l: Array, origins_l: Array, rows_l: Array, knots_u: Array, origins_u: Array, rows_u: Array,
    w: float, v: Array, out: Array,
) -> float:  # fmt: skip
    """Run the play operator of eq. (7) between borders in pieces (bent.border) from the level w; return the last.

    Where the borders cross, the unloading one holds, as for straight ones.
    """
    at_l, at_u = 0, 0
    for j in range(v.size):
        at_l, at_u = _piece(knots_l, at_l, v[j]), _piece(knots_u, at_u, v[j])
        w = min(max(w, _on_border(origins_l, rows_l, at_l, v[j])), _on_border(origins_u, rows_u, at_u, v[j]))
        out[j] = w
    return w


@njit(fastmath=_FAST, error_model="numpy", cache=True)
def plain_chain(
    rows1: Any, a0: Any, a1: Any, c1: Any, d1: float, x1: Any,
    s_l: float, d_l: float, s_u: float, d_u: float, w: float,
    rows2: Any, b0: Any, b1: Any, c2: Any, d2: float, x2: Any,
    last_u: float, u: Array, out: Array,
) -> Any:  # fmt: skip
    """Run G1, play and G2 in one loop: three recurrences that the processor overlaps."""
    last_w = w
    for j in range(u.size):
        x1 = advance(rows1, a0, a1, x1, last_u, u[j])
        last_u = u[j]
        v = dot(c1, x1) + d1 * last_u
        w = min(max(last_w, s_l * (v - d_l)), s_u * (v - d_u))
        x2 = advance(rows2, b0, b1, x2, last_w, w)
        last_w = w
        out[j] = dot(c2, x2) + d2 * w
    return x1, w, x2, last_u



@njit(error_model="numpy", cache=True)
def waveform(first: float, step: float, orders: Any, sizes: Array, angles: Array, out: Array) -> None:
    """Add sum over n of sizes[n] sin(orders[n] turn + angles[n]) to ``out``, turn = first + step j.

    The phasor is advanced by multiplication and set anew every 4096 samples, so that rounding stays below 1e-12.
    """
    for start in range(0, out.size, 4096):
        for n in range(orders.size):
            if sizes[n] == 0.0:
                continue
            phasor = sizes[n] * np.exp(1j * (orders[n] * (first + step * start) + angles[n]))
            turn = np.exp(1j * orders[n] * step)
            for j in range(start, min(start + 4096, out.size)):
                out[j] += phasor.imag
                phasor *= turn


@njit(error_model="numpy", cache=True)
def less_behind(
    weights: Any, rates: Any, step_s: float, behind: Array, last: float, signal: Array, out: Array
) -> None:  # fmt: skip
    """Take from ``out`` what stays behind each rate, above zero rising, below it falling; ``behind`` goes on."""
    for k in range(rates.size):
        up = 1.0 if rates[k] > 0.0 else -1.0
        left, before, allowed = behind[k], last, abs(rates[k]) * step_s
        for j in range(signal.size):
            left = max(left + up * (signal[j] - before) - allowed, 0.0)
            before = signal[j]
            out[j] -= up * weights[k] * left
        behind[k] = left


@njit(error_model="numpy", cache=True)
def play_between(lower: Array, upper: Array, w: float, out: Array) -> float:
    """Run the play operator between two running borders from the level w; return the last. ``out`` may be one of them.

    Where the borders cross, the upper one holds.
    """
    for j in range(lower.size):
        w = min(max(w, lower[j]), upper[j])
        out[j] = w
    return w


@njit(error_model="numpy", cache=True)
def plus_curve(first: float, step: float, rows: Array, signal: Array, out: Array) -> None:
    """Add to every value a curve of it: cubic pieces between knots ``first + i step``, straight beyond the ends."""
    last = rows.shape[0] - 1
    for j in range(signal.size):
        s = signal[j]
        i = min(max(int(np.floor((s - first) / step)), 0), last)
        t = s - (first + i * step)
        if t < 0.0:
            out[j] = s + rows[0, 0] + t * rows[0, 1]
        else:
            out[j] = s + rows[i, 0] + t * (rows[i, 1] + t * (rows[i, 2] + t * rows[i, 3]))


@njit(error_model="numpy", cache=True)
def led(known: Array, past: int, steps: Array, out: Array) -> None:
    """Write what ``known`` was, or going on straight will be, ``steps`` later than every instant from ``past`` on.

    Steps need not be whole: between instants it is straight, and before its first it stays as it was there.
    """
    for j in range(out.size):
        here, ahead = past + j, steps[j]
        if ahead >= 0.0:
            out[j] = known[here] + ahead * (known[here] - known[here - 1])
        elif here + ahead > 0.0:
            i = min(int(here + ahead), known.size - 2)  # a step may be nothing but rounding
            out[j] = known[i] + (here + ahead - i) * (known[i + 1] - known[i])
        else:
            out[j] = known[0] if ahead < 0.0 else ahead


@njit(error_model="numpy", cache=True)
def plus_corners(corners: Array, sides: Array, jumps: Array, bends: Array, signal: Array, out: Array) -> None:
    """Add to every value a jump and a bend for each of the corners that it is beyond, on that corner's side."""
    for j in range(signal.size):
        s, added = signal[j], 0.0
        for k in range(corners.size):
            above = s - corners[k]
            if above * sides[k] > 0.0:
                added += jumps[k] + bends[k] * above
        out[j] = s + added


@njit(error_model="numpy", cache=True)
def rounded(step: float, rows: Array, signal: Array, out: Array) -> None:
    """Round every value to whole steps, on the mean: ``rows`` are the cubic pieces in which a step is rounded off."""
    last, per = rows.shape[0] - 1, 1.0 / step
    for j in range(signal.size):
        s = signal[j] * per
        whole = np.floor(s + 0.5)
        part = s - whole + 0.5
        i = min(max(int(part * last), 0), last)  # an answer may have grown beyond all numbers
        t = part - i / last
        out[j] = step * (s + rows[i, 0] + t * (rows[i, 1] + t * (rows[i, 2] + t * rows[i, 3])))


@njit(error_model="numpy", fastmath=_IN_ORDER, cache=True)
def best_cuts(y: Array, answer: Array, use: Any, gains: Array) -> None:
    """Write what the best cut gains for every number of lost readings from 1 on.

    The gain is the fall of the sum of squares when all readings from the cut on are compared with the answer ``count``
    samples later. ``gains`` holds zeros before; as long as it is is the longest loss.
    """
    totals = np.zeros(gains.size)
    for k in range(y.size - 2, -1, -1):
        if use[k]:
            now, later = (y[k] - answer[k]) ** 2, answer[k + 1 : k + 1 + gains.size]
            for i in range(later.size):  # without a branch: several counts go at once
                total = totals[i] + (now - (y[k] - later[i]) ** 2)
                totals[i] = total
                gains[i] = total if total > gains[i] else gains[i]


@njit(error_model="numpy", cache=True)
def drawn(known: Array, start: float, step: float, out: Array) -> None:
    """Read ``known`` at positions start + j step between its instants, on the cubic through the four around each.

    ``known`` has four instants at least; past its first or last four their cubic goes on. Source: Lagrange's
    interpolation, Abramowitz and Stegun 25.2.13.
    """
    last = known.size - 4
    for j in range(out.size):
        at = start + j * step
        i = min(max(int(np.floor(at)) - 1, 0), last)
        t = at - (i + 1)  # from the second of the four
        before, after = t * (t - 1.0) * (1.0 / 6.0), (t + 1.0) * (t - 2.0) * 0.5
        out[j] = (
            (t + 1.0) * before * known[i + 3] - before * (t - 2.0) * known[i]
            + after * ((t - 1.0) * known[i + 1] - t * known[i + 2])
        )  # fmt: skip
