"""Compiled loops of the filter that makes white what wanders behind a linear block (identify.innovations)."""

import numpy as np
from numba import njit

from identify.derivatives.lane_kernels import FAST
from identify.derivatives.lanes import WIDTH, load, spread, store
from identify.trace import Array, Mask


@njit(error_model="numpy", cache=True)
def _foretold(f: Array, p: Array, enters: Array, gain: float, moved: Array) -> None:
    """Turn the covariance of the states into that of the next ones, f p f' + gain enters enters'."""
    m = enters.size
    for i in range(m):
        for j in range(m):
            total = 0.0
            for a in range(m):
                total += f[i, a] * p[a, j]
            moved[i, j] = total
    for i in range(m):
        for j in range(i, m):
            total = gain * enters[i] * enters[j]
            for a in range(m):
                total += moved[i, a] * f[j, a]
            p[i, j] = total
            p[j, i] = total


@njit(error_model="numpy", cache=True)
def _corrected(p: Array, read: Array, seen: Array, pull: Array) -> float:
    """Take what a reading of ``read`` and noise of variance 1 tells from the covariance; return its sd as foretold.

    ``pull`` becomes how much an innovation corrects every state.
    """
    m, size = read.size, 1.0
    for i in range(m):
        total = 0.0
        for a in range(m):
            total += p[i, a] * read[a]
        seen[i] = total
        size += read[i] * total
    for i in range(m):
        pull[i] = seen[i] / size
        for j in range(m):
            p[i, j] -= pull[i] * seen[j]
    return float(np.sqrt(size))


@njit(error_model="numpy", cache=True)
def filtered(
    keeps: Array, gains: Array, rows: Array, g0: Array, g1: Array, c: Array, d: float, use: Mask,
    pulls: Array, sizes: Array,
) -> None:  # fmt: skip
    """Write how much an innovation corrects every state, shape (N, n + 1), and its sd, (N,), 0 where none is read.

    States are those of the block, then the deviation that enters it; the reading is c x + d times the deviation, and
    noise of variance 1.
    """
    n = g0.size
    p, moved, f, seen = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1)), np.zeros(n + 1)
    f[:n, :n] = rows
    read, enters = np.append(c, d), np.append(g1, 1.0)
    for k in range(keeps.size):
        for i in range(n):
            f[i, n] = g0[i] + g1[i] * keeps[k]
        f[n, n] = keeps[k]
        _foretold(f, p, enters, gains[k], moved)
        if use[k]:
            sizes[k] = _corrected(p, read, seen, pulls[k])


@njit(error_model="numpy", cache=True)
def followed(
    keeps: Array, rows: Array, g0: Array, g1: Array, c: Array, d: float, pulls: Array, sizes: Array,
    values: Array, state: Array, out: Array,
) -> None:  # fmt: skip
    """Write the innovations of every column of ``values``, shape (n, k), over their sd; ``state`` is left as it ends.

    Where the sd is 0 nothing is read.
    """
    n = g0.size
    before = np.zeros(n)
    for col in range(values.shape[1]):
        for k in range(keeps.size):
            enters, last = keeps[k] * state[n, col], state[n, col]
            for i in range(n):
                before[i] = state[i, col]
            foretold = d * enters
            for i in range(n):
                total = g0[i] * last + g1[i] * enters
                for a in range(n):
                    total += rows[i, a] * before[a]
                state[i, col] = total
                foretold += c[i] * total
            state[n, col] = enters
            if sizes[k] == 0.0:
                out[k, col] = 0.0
                continue
            new = values[k, col] - foretold
            for i in range(n + 1):
                state[i, col] += pulls[k, i] * new
            out[k, col] = new / sizes[k]


@njit(fastmath=FAST, error_model="numpy", cache=True)
def followed_abreast(
    keeps: Array, rows: Array, g0: Array, g1: Array, c: Array, d: float, pulls: Array, sizes: Array,
    values: Array, states: Array, out: Array,
) -> None:  # fmt: skip
    """Write what ``followed`` does of 8 k columns, shape (N, 8 k), eight at once; ``states`` are (k, n + 1, 8)."""
    n, wide, x, none = g0.size, states.shape[0], np.zeros((g0.size, WIDTH)), spread(0.0)
    for block in range(wide):
        state = states[block]
        for k in range(keeps.size):
            last = load(state, n)
            enters = keeps[k] * last
            new = load(values, k * wide + block) + (-d) * enters
            for i in range(n):
                after = g0[i] * last + g1[i] * enters
                for a in range(n):
                    after = after + rows[i, a] * load(state, a)
                store(x, i, after)
                new = new + (-c[i]) * after
            per_sd = 1.0 / sizes[k] if sizes[k] > 0.0 else 0.0
            new = new if sizes[k] > 0.0 else none
            for i in range(n):
                store(state, i, load(x, i) + pulls[k, i] * new)
            store(state, n, enters + pulls[k, n] * new)
            store(out, k * wide + block, per_sd * new)
