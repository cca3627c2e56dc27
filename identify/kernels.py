"""The compiled loops over samples, all in one place.

State-space rows, taps and states are tuples, so that numba knows the order at compile time and unrolls it.
``advance`` and ``dot`` recurse over those tuples; the recursion is resolved while compiling.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numba.extending import overload

from identify.lanes import each, last, load, spread, store
from identify.trace import Array

# Sums may be reordered and fused, NaN and infinity keep their meaning.
_FAST = {"contract", "reassoc", "nsz"}


def dot(c: Any, x: Any) -> Any:
    """Return the inner product of two tuples of equal length (compiled code only)."""
    raise NotImplementedError("compiled code only")


def advance(rows: Any, g0: Any, g1: Any, x: Any, a: Any, b: Any) -> Any:
    """Return the next state rows @ x + g0 a + g1 b, all tuples (compiled code only)."""
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


@njit(fastmath=_FAST, error_model="numpy", cache=True)
def linear(rows: Any, g0: Any, g1: Any, c: Any, d: float, state: Any, last: float, signal: Array, out: Array) -> Any:
    """Run a linear block over ``signal``: x[j] = rows x[j-1] + g0 s[j-1] + g1 s[j], out[j] = c x[j] + d s[j]."""
    for j in range(signal.size):
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
    """Run the play operator of eq. (7) between borders in pieces (identify.border) from the level w; return the last.

    Where the borders cross, the unloading one holds, as for straight ones.
    """
    at_l, at_u = 0, 0
    for j in range(v.size):
        at_l, at_u = _piece(knots_l, at_l, v[j]), _piece(knots_u, at_u, v[j])
        w = min(max(w, _on_border(origins_l, rows_l, at_l, v[j])), _on_border(origins_u, rows_u, at_u, v[j]))
        out[j] = w
    return w


@njit(error_model="numpy", cache=True)
def leaky_play(
    s_l: float, d_l: float, s_u: float, d_u: float, keep: float, lose: float, w: float, v: Array, out: Array
) -> float:
    """Run a play operator whose held level becomes keep * w - lose at every sample before the borders act."""
    for j in range(v.size):
        w = min(max(keep * w - lose, s_l * (v[j] - d_l)), s_u * (v[j] - d_u))
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
def waveform(first: float, step: float, orders: Any, sizes: Any, angles: Any, out: Array) -> None:
    """Add sum over n of sizes[n] sin(orders[n] turn + angles[n]) to ``out``, turn = first + step j.

    The phasor is advanced by multiplication and set anew every 4096 samples, so that rounding stays below 1e-12.
    """
    for start in range(0, out.size, 4096):
        for n in range(len(orders)):
            phasor = sizes[n] * np.exp(1j * (orders[n] * (first + step * start) + angles[n]))
            turn = np.exp(1j * orders[n] * step)
            for j in range(start, min(start + 4096, out.size)):
                out[j] += phasor.imag
                phasor *= turn


@njit(fastmath=_FAST, error_model="numpy", cache=True)
def _columns(table: Array, row: int) -> Any:
    """Return eight rows of a table of lanes."""
    return (
        load(table, row), load(table, row + 1), load(table, row + 2), load(table, row + 3),
        load(table, row + 4), load(table, row + 5), load(table, row + 6), load(table, row + 7),
    )  # fmt: skip


@njit(fastmath=_FAST, error_model="numpy", cache=True)
def _combined(columns: Any, x: Any, rest: Any) -> Any:
    """Return rest + sum over k of columns[k] x[k], added in pairs so that no sum waits for seven others."""
    one = (rest + x[0] * columns[0] + x[1] * columns[1]) + (x[2] * columns[2] + x[3] * columns[3])
    other = (x[4] * columns[4] + x[5] * columns[5]) + (x[6] * columns[6] + x[7] * columns[7])
    return one + other


@njit(fastmath=_FAST, error_model="numpy", cache=True)
def tangents_to_w(table: Array, borders: Array, state: Array, levels: Array, u: Array, w: Array, out: Array) -> None:
    """Run a block of up to eight states over u, F over its last lane v, and eight derivatives of w beside them.

    ``table``: rows of eight; 0-7 the columns of the transition, 8 and 9 what the input before and now adds, 10-17 the
    columns of the taps, 18 the feedthrough, 19 and 20 the weights of the lanes now and an instant before, 21-24 what a
    lane and 1 add to dw on the loading (21, 22) and the unloading border (23, 24).
    ``borders``: S_L, w at v = 0 on the loading border, S_U, w at v = 0 on the unloading one. On a plateau dw stays.
    ``state``: rows x, lanes before, dw; ``levels``: input before, w. Both are left as they are after the last instant.
    """
    step, taps = _columns(table, 0), _columns(table, 10)
    g0, g1, feed, now, before = load(table, 8), load(table, 9), load(table, 18), load(table, 19), load(table, 20)
    on_l, rest_l, on_u, rest_u = load(table, 21), load(table, 22), load(table, 23), load(table, 24)
    x, lanes_before, dw = load(state, 0), load(state, 1), load(state, 2)
    u_before, level = levels[0], levels[1]
    xs = each(x)
    for j in range(u.size):
        x = _combined(step, xs, u_before * g0 + u[j] * g1)
        xs = each(x)
        u_before = u[j]
        lanes = _combined(taps, xs, u_before * feed)
        mixed = lanes * now + lanes_before * before
        lanes_before = lanes
        v = last(mixed)
        low, high = borders[0] * v + borders[1], borders[2] * v + borders[3]
        if high <= max(level, low):
            level, dw = high, rest_u + mixed * on_u
        elif low >= level:
            level, dw = low, rest_l + mixed * on_l
        w[j] = level
        store(out, j, dw)
    levels[0], levels[1] = u_before, level
    store(state, 0, x)
    store(state, 1, lanes_before)
    store(state, 2, dw)


@njit(fastmath=_FAST, error_model="numpy", cache=True)
def through_block(step: Array, state: Array, signal: Array, every: int, column: int, out: Array) -> None:
    """Run eight signals, rows of ``signal``, through one block of up to four states.

    ``step``: 16 numbers of the transition by rows, 4 for the input before, 4 for the input now, 4 taps, feedthrough.
    ``state``: four rows of states and the input before. Every ``every``-th answer goes to ``out`` at its ``column``-th
    eight.
    """
    x0, x1, x2, x3, before = load(state, 0), load(state, 1), load(state, 2), load(state, 3), load(state, 4)
    a, wide, due = step[:29].copy(), out.shape[1] // 8, 0
    for j in range(signal.shape[0]):
        now = load(signal, j)
        y0 = a[16] * before + a[20] * now + a[0] * x0 + a[1] * x1 + a[2] * x2 + a[3] * x3
        y1 = a[17] * before + a[21] * now + a[4] * x0 + a[5] * x1 + a[6] * x2 + a[7] * x3
        y2 = a[18] * before + a[22] * now + a[8] * x0 + a[9] * x1 + a[10] * x2 + a[11] * x3
        y3 = a[19] * before + a[23] * now + a[12] * x0 + a[13] * x1 + a[14] * x2 + a[15] * x3
        x0, x1, x2, x3, before = y0, y1, y2, y3, now
        if j == due * every:
            store(out, due * wide + column, a[28] * now + a[24] * x0 + a[25] * x1 + a[26] * x2 + a[27] * x3)
            due += 1
    store(state, 0, x0)
    store(state, 1, x1)
    store(state, 2, x2)
    store(state, 3, x3)
    store(state, 4, before)


@njit(fastmath=_FAST, error_model="numpy", cache=True)
def answers(table: Array, state: Array, levels: Array, w: Array, every: int, column: int, out: Array) -> None:
    """Run a block of up to eight states over w with eight outputs, rows 0-18 of ``table`` as in ``tangents_to_w``.

    Every ``every``-th goes to ``out`` at its ``column``-th eight. ``state``: x; ``levels``: the input before.
    """
    step, taps = _columns(table, 0), _columns(table, 10)
    g0, g1, feed = load(table, 8), load(table, 9), load(table, 18)
    x, before, wide, due = load(state, 0), levels[0], out.shape[1] // 8, 0
    xs = each(x)
    for j in range(w.size):
        x = _combined(step, xs, before * g0 + w[j] * g1)
        xs = each(x)
        before = w[j]
        if j == due * every:
            store(out, due * wide + column, _combined(taps, xs, before * feed))
            due += 1
    levels[0] = before
    store(state, 0, x)


@njit(fastmath=_FAST, error_model="numpy", cache=True)
def add_products(rows: Array, products: Array) -> None:
    """Add rows' rows to the upper triangle of ``products`` (eight by eight numbers at a time); rows (n, 8 m)."""
    wide = rows.shape[1] // 8
    for left in range(wide):
        for right in range(left, wide):
            _add_square(rows, left, right, wide, products)


@njit(fastmath=_FAST, error_model="numpy", cache=True)
def _add_square(rows: Array, left: int, right: int, wide: int, products: Array) -> None:
    """Add the products of one eight of columns with another."""
    zero = spread(0.0)
    p0, p1, p2, p3, p4, p5, p6, p7 = zero, zero, zero, zero, zero, zero, zero, zero
    k = 8 * left
    for j in range(rows.shape[0]):
        row = load(rows, j * wide + right)
        p0, p1, p2 = p0 + rows[j, k] * row, p1 + rows[j, k + 1] * row, p2 + rows[j, k + 2] * row
        p3, p4, p5 = p3 + rows[j, k + 3] * row, p4 + rows[j, k + 4] * row, p5 + rows[j, k + 5] * row
        p6, p7 = p6 + rows[j, k + 6] * row, p7 + rows[j, k + 7] * row
    for i, product in enumerate((p0, p1, p2, p3, p4, p5, p6, p7)):
        at = (k + i) * wide + right
        store(products, at, product + load(products, at))


@njit(fastmath=_FAST, error_model="numpy", cache=True)
def take_answer(rows: Array, column: int, own: float, share: float, beside: int, answer: Array) -> None:
    """Move a column of ``rows`` to ``answer`` and put own * answer + share * (column ``beside``) in its place."""
    for j in range(answer.size):
        answer[j] = rows[j, column]
        rows[j, column] = own * answer[j] + share * rows[j, beside]
