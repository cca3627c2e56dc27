"""The compiled loops that run eight derivatives abreast (lanes), two instants at a time (abreast)."""

from typing import Any

from numba import njit

from identify.derivatives.lanes import each, last, load, spread, store
from identify.trace import Array

FAST = {"contract", "nsz"}  # products and sums are fused; the order of sums is the one that is written
TILE = 256  # rows that are multiplied while they are in the near cache


@njit(fastmath=FAST, error_model="numpy", cache=True)
def _columns(table: Array, row: int) -> Any:
    """Return eight rows of a table of lanes."""
    return (
        load(table, row), load(table, row + 1), load(table, row + 2), load(table, row + 3),
        load(table, row + 4), load(table, row + 5), load(table, row + 6), load(table, row + 7),
    )  # fmt: skip


@njit(fastmath=FAST, error_model="numpy", cache=True)
def _combined(columns: Any, x: Any, rest: Any) -> Any:
    """Return rest + sum over k of columns[k] x[k], added in pairs so that no sum waits for seven others."""
    one = (rest + x[0] * columns[0] + x[1] * columns[1]) + (x[2] * columns[2] + x[3] * columns[3])
    other = (x[4] * columns[4] + x[5] * columns[5]) + (x[6] * columns[6] + x[7] * columns[7])
    return one + other


@njit(fastmath=FAST, error_model="numpy", cache=True)
def _pair(table: Array) -> Any:
    """Return a pair of instants out of a table: states, then inputs, for the state, the first and the second output."""
    return (
        _columns(table, 0), (load(table, 8), load(table, 9), load(table, 10)),
        _columns(table, 11), (load(table, 19), load(table, 20)),
        _columns(table, 21), (load(table, 29), load(table, 30), load(table, 31)),
    )  # fmt: skip


@njit(fastmath=FAST, error_model="numpy", cache=True)
def _two(pair: Any, x: Any, a: float, b: float, c: float) -> Any:
    """Return the state after two instants, and the outputs after one and after two."""
    step, g, one, h, two, i = pair
    xs = each(x)
    return (
        _combined(step, xs, a * g[0] + b * g[1] + c * g[2]),
        _combined(one, xs, a * h[0] + b * h[1]),
        _combined(two, xs, a * i[0] + b * i[1] + c * i[2]),
    )


@njit(fastmath=FAST, error_model="numpy", cache=True)
def _single(table: Array, pair: Any, x: Any, a: float, b: float) -> Any:
    """Return the state and the output after one instant: the last of an odd number."""
    xs = each(x)
    state = _combined(_columns(table, 32), xs, a * load(table, 40) + b * load(table, 41))
    return state, _combined(pair[2], xs, a * pair[3][0] + b * pair[3][1])


@njit(fastmath=FAST, error_model="numpy", cache=True)
def tangents_to_w(table: Array, lines: Array, state: Array, levels: Array, u: Array, w: Array, out: Array) -> None:
    """Run a block of up to eight states over u, F over its last lane v, and eight derivatives of w beside them.

    ``table``: a pair of instants (abreast) in rows 0-41, then what a lane and 1 add to dw on the loading (42, 43) and
    the unloading border (44, 45).
    ``lines``: S_L, w at v = 0 on the loading border, S_U, w at v = 0 on the unloading one. On a plateau dw stays.
    ``state``: rows x, dw; ``levels``: input before, w. Both are left as they are after the last instant.
    """
    pair, x, dw = _pair(table), load(state, 0), load(state, 1)
    rules = (load(table, 42), load(table, 43), load(table, 44), load(table, 45))
    a, level = levels[0], levels[1]
    for j in range(0, u.size - 1, 2):
        x, lanes, later = _two(pair, x, a, u[j], u[j + 1])
        level, dw = _led(lines, rules, lanes, level, dw)
        w[j] = level
        store(out, j, dw)
        level, dw = _led(lines, rules, later, level, dw)
        w[j + 1] = level
        store(out, j + 1, dw)
        a = u[j + 1]
    if u.size % 2:
        x, lanes = _single(table, pair, x, a, u[-1])
        level, dw = _led(lines, rules, lanes, level, dw)
        w[-1] = level
        store(out, u.size - 1, dw)
        a = u[-1]
    levels[0], levels[1] = a, level
    store(state, 0, x)
    store(state, 1, dw)


@njit(fastmath=FAST, error_model="numpy", cache=True)
def _led(lines: Array, rules: Any, lanes: Any, level: float, dw: Any) -> Any:
    """Return w and its derivatives an instant later; v is the last of the lanes."""
    v = last(lanes)
    low, high = lines[0] * v + lines[1], lines[2] * v + lines[3]
    if high <= max(level, low):
        return high, rules[3] + lanes * rules[2]
    if low >= level:
        return low, rules[1] + lanes * rules[0]
    return level, dw


@njit(fastmath=FAST, error_model="numpy", cache=True)
def through_block(table: Array, state: Array, signal: Array, every: int, column: int, out: Array) -> None:
    """Run eight signals, rows of ``signal``, through one block of up to four states.

    ``table``: a pair of instants as in ``tangents_to_w``, of four states and one output, row by row: 7 numbers each
    (four states, input before, now, next) for the states after two, then the output after one and after two, then the
    states after one. ``state``: four rows of states and the input before. Every ``every``-th answer goes to ``out`` at
    its ``column``-th eight.
    """
    x, a = (load(state, 0), load(state, 1), load(state, 2), load(state, 3)), load(state, 4)
    t, wide, due, size = table.copy(), out.shape[1] // 8, 0, signal.shape[0]
    for j in range(0, size - 1, 2):
        b, c, was = load(signal, j), load(signal, j + 1), x
        x = (
            _after(t, 0, was, a, b) + t[6] * c, _after(t, 7, was, a, b) + t[13] * c,
            _after(t, 14, was, a, b) + t[20] * c, _after(t, 21, was, a, b) + t[27] * c,
        )  # fmt: skip
        if j == due * every:
            store(out, due * wide + column, _after(t, 28, was, a, b))
            due += 1
        if j + 1 == due * every:
            store(out, due * wide + column, _after(t, 35, was, a, b) + t[41] * c)
            due += 1
        a = c
    if size % 2:
        b = load(signal, size - 1)
        if size - 1 == due * every:
            store(out, due * wide + column, _after(t, 28, x, a, b))
        x, a = (_after(t, 42, x, a, b), _after(t, 49, x, a, b), _after(t, 56, x, a, b), _after(t, 63, x, a, b)), b
    for i, row in enumerate(x):
        store(state, i, row)
    store(state, 4, a)


@njit(fastmath=FAST, error_model="numpy", cache=True)
def _after(t: Array, row: int, x: Any, a: Any, b: Any) -> Any:
    """Return one row of numbers times four states and two inputs."""
    inputs = t[row + 4] * a + t[row + 5] * b
    return (inputs + t[row] * x[0] + t[row + 1] * x[1]) + (t[row + 2] * x[2] + t[row + 3] * x[3])


@njit(fastmath=FAST, error_model="numpy", cache=True)
def answers(table: Array, state: Array, levels: Array, w: Array, every: int, column: int, out: Array) -> None:
    """Run a block of up to eight states over w with eight outputs; ``table`` as rows 0-41 of ``tangents_to_w``'s.

    Every ``every``-th goes to ``out`` at its ``column``-th eight. ``state``: x; ``levels``: the input before.
    """
    pair, x, a = _pair(table), load(state, 0), levels[0]
    wide, due = out.shape[1] // 8, 0
    for j in range(0, w.size - 1, 2):
        x, first, second = _two(pair, x, a, w[j], w[j + 1])
        if j == due * every:
            store(out, due * wide + column, first)
            due += 1
        if j + 1 == due * every:
            store(out, due * wide + column, second)
            due += 1
        a = w[j + 1]
    if w.size % 2:
        x, first = _single(table, pair, x, a, w[-1])
        if w.size - 1 == due * every:
            store(out, due * wide + column, first)
        a = w[-1]
    levels[0] = a
    store(state, 0, x)


@njit(fastmath=FAST, error_model="numpy", cache=True)
def add_products(rows: Array, products: Array) -> None:
    """Add rows' rows to the upper triangle of ``products`` (eight by eight numbers at a time); rows (n, 8 m)."""
    wide = rows.shape[1] // 8
    for start in range(0, rows.shape[0], TILE):
        for left in range(wide):
            for right in range(left, wide):
                _add_square(rows[start : start + TILE], left, right, wide, products)


@njit(fastmath=FAST, error_model="numpy", cache=True)
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


@njit(fastmath=FAST, error_model="numpy", cache=True)
def take_answer(rows: Array, column: int, own: float, share: float, beside: int, answer: Array) -> None:
    """Move a column of ``rows`` to ``answer`` and put own * answer + share * (column ``beside``) in its place."""
    for j in range(answer.size):
        answer[j] = rows[j, column]
        rows[j, column] = own * answer[j] + share * rows[j, beside]
