"""Compiled loops of the filter that makes white what wanders behind a linear block (identify.innovations)."""

import numpy as np
from numba import njit

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
    size = 1.0
    for i in range(read.size):
        seen[i] = p[i] @ read
        size += read[i] * seen[i]
    for i in range(read.size):
        pull[i] = seen[i] / size
        for j in range(read.size):
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
        f[:n, n] = g0 + g1 * keeps[k]
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
