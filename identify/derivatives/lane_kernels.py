"""The compiled loops that run eight derivatives (two instants at a time, abreast) or eight signals at once (lanes)."""

from collections.abc import Callable
from typing import Any

from numba import njit
from numba.extending import overload

from identify.derivatives.lanes import each, larger, last, load, smaller, spread, store, turned
from identify.kernels import onto, pushed
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


def loaded(c: Any, table: Array, row: int) -> Any:
    """Return as many rows of a table of lanes as ``c`` has numbers, from ``row`` on (compiled code only)."""
    raise NotImplementedError("compiled code only")


@overload(loaded, strict=False)
def _loaded(c: Any, table: Array, row: int) -> Callable[..., Any]:
    if len(c) == 1:
        return lambda c, table, row: (load(table, row),)
    return lambda c, table, row: (load(table, row), *loaded(c[1:], table, row + 1))


@njit(fastmath=FAST, error_model="numpy", cache=True)
def instants_of(signals: Array, at: int, wide: int) -> Any:
    """Return eight instants of eight rows, each in lanes; the rows have ``wide`` times eight."""
    return turned((
        load(signals, at), load(signals, at + wide), load(signals, at + 2 * wide), load(signals, at + 3 * wide),
        load(signals, at + 4 * wide), load(signals, at + 5 * wide), load(signals, at + 6 * wide),
        load(signals, at + 7 * wide),
    ))  # fmt: skip


@njit(fastmath=FAST, error_model="numpy", cache=True)
def put(signals: Array, at: int, wide: int, instants: Any) -> None:
    """Put eight instants of eight rows where they were."""
    for i, row in enumerate(turned(instants)):
        store(signals, at + i * wide, row)


@njit(fastmath=FAST, error_model="numpy", cache=True)
def _stepped(one: Any, x: Any, before: Any, s: Any) -> Any:
    """Return the state of a linear block an instant later, and what it puts out."""
    rows, pushes, c, d = one
    x = pushed(rows, pushes, x, (before, s))
    return x, onto(d * s, c, x)


@njit(fastmath=FAST, error_model="numpy", cache=True)
def linear(one: Any, state: Array, signals: Array) -> None:
    """Run eight signals, shape (8, 8 n), through one linear block; what it puts out takes their place.

    ``one``: (rows, pushes, c, d) of a step, x[j] = rows x[j-1] + pushes (s[j-1], s[j]), out[j] = c x[j] + d s[j].
    ``state``: rows of states, then the input before.
    """
    x, before, wide = loaded(one[2], state, 0), load(state, len(one[2])), signals.shape[1] // 8
    for at in range(wide):
        s0, s1, s2, s3, s4, s5, s6, s7 = instants_of(signals, at, wide)
        x, o0 = _stepped(one, x, before, s0)
        x, o1 = _stepped(one, x, s0, s1)
        x, o2 = _stepped(one, x, s1, s2)
        x, o3 = _stepped(one, x, s2, s3)
        x, o4 = _stepped(one, x, s3, s4)
        x, o5 = _stepped(one, x, s4, s5)
        x, o6 = _stepped(one, x, s5, s6)
        x, o7 = _stepped(one, x, s6, s7)
        before = s7
        put(signals, at, wide, (o0, o1, o2, o3, o4, o5, o6, o7))
    for i, row in enumerate(x):
        store(state, i, row)
    store(state, len(one[2]), before)


@njit(fastmath=FAST, error_model="numpy", cache=True)
def play(s_l: float, d_l: float, s_u: float, d_u: float, level: Array, signals: Array) -> None:
    """Run the play operator of eq. (7) over eight signals, shape (8, 8 n), from their levels; w takes their place."""
    w, down, up, wide = load(level, 0), spread(-d_l), spread(-d_u), signals.shape[1] // 8
    for at in range(wide):
        v0, v1, v2, v3, v4, v5, v6, v7 = instants_of(signals, at, wide)
        w0 = smaller(larger(w, s_l * (v0 + down)), s_u * (v0 + up))
        w1 = smaller(larger(w0, s_l * (v1 + down)), s_u * (v1 + up))
        w2 = smaller(larger(w1, s_l * (v2 + down)), s_u * (v2 + up))
        w3 = smaller(larger(w2, s_l * (v3 + down)), s_u * (v3 + up))
        w4 = smaller(larger(w3, s_l * (v4 + down)), s_u * (v4 + up))
        w5 = smaller(larger(w4, s_l * (v5 + down)), s_u * (v5 + up))
        w6 = smaller(larger(w5, s_l * (v6 + down)), s_u * (v6 + up))
        w7 = smaller(larger(w6, s_l * (v7 + down)), s_u * (v7 + up))
        w = w7
        put(signals, at, wide, (w0, w1, w2, w3, w4, w5, w6, w7))
    store(level, 0, w)


@njit(fastmath=FAST, error_model="numpy", cache=True)
def differences(signals: Array, every: int, scale: float, out: Array) -> None:
    """Write by how much rows of signals differ from the first, at every so many-th instant, times ``scale``."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = (signals[i + 1, every * j] - signals[0, every * j]) * scale
