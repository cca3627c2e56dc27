"""How are eight derivatives laid out for the compiled loops that run them abreast?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.derivatives import lane_kernels
from identify.derivatives.cascade import Cascade, Outputs
from identify.derivatives.lanes import WIDTH
from identify.discretise import Matrix
from identify.trace import Array

MOST_STATES = WIDTH // 2  # of a block: its cascade, twice as large, fills the lanes


@dataclass(frozen=True)
class Pair:
    """Two instants at a time: columns for the state x, the input a before, and the inputs b and c of both.

    ``state`` after both; the outputs after one and after two; the state after one, for the last of an odd number. Both
    outputs come from one state, so that a loop waits half as often for the sum before.
    """

    state: Matrix
    after_one: Matrix
    after_two: Matrix
    single: Matrix


def pair(at: Cascade, rows: Matrix) -> Pair:
    """Return the pair of steps x[j] = phi x[j-1] + g0 s[j-1] + g1 s[j], outputs as ``rows`` of Cascade.rows."""
    n = at.phi.shape[0]
    one = np.column_stack((at.phi, at.g0, at.g1))
    return Pair(_again(one, one[:, :n], one[:, n:]), rows, _again(one, rows[:, :n], rows[:, n:]), one)


def _again(one: Matrix, states: Matrix, inputs: Matrix) -> Matrix:
    """Return rows over the state after one instant and two inputs as rows over the state before it and three inputs."""
    found = np.column_stack((states @ one, np.zeros(states.shape[0])))
    found[:, -2:] += inputs
    return found


def pair_rows(at: Cascade, outputs: Sequence[Outputs], lanes: Sequence[int]) -> Matrix:
    """Return a table of lanes: an output in every named lane; rows 0-7 the states' part of the state after both, 8-10
    the inputs' part; 11-18 and 19, 20 the outputs after one; 21-28 and 29-31 after both; 32-39 and 40, 41 one step.
    """
    rows = np.zeros((WIDTH, at.phi.shape[0] + 2))
    for output, lane in zip(outputs, lanes, strict=True):
        rows[lane] = at.rows(output)[0]
    both = pair(at, rows)
    parts = (both.state, 11), (both.after_one, 10), (both.after_two, 11), (both.single, 10)
    return np.concatenate([_rows(columns, at.phi.shape[0], count) for columns, count in parts])


def _rows(columns: Matrix, states: int, count: int) -> Matrix:
    """Return the columns of states, then those of inputs, as rows of lanes; missing states are 0."""
    rows = np.zeros((count, WIDTH))
    rows[:states, : columns.shape[0]] = columns[:, :states].T
    rows[WIDTH:, : columns.shape[0]] = columns[:, states:].T
    return rows


class ToW:
    """G1 and F at work, at rest: w, and eight of its derivatives."""

    def __init__(self, table: Matrix, lines: tuple[float, float, float, float]) -> None:
        """Take a table of ``tangents_to_w``, and slope and w at v = 0 of F's loading and unloading line."""
        self._table, self._lines = table, np.array(lines)
        self._state, self._levels = np.zeros((2, WIDTH)), np.zeros(2)

    def run(self, u: Array, w: Array, dw: Matrix) -> None:
        """Turn u into w, shape (n,), and dw, shape (n, 8)."""
        lane_kernels.tangents_to_w(self._table, self._lines, self._state, self._levels, u, w, dw)


class Through:
    """A block at work, at rest, on eight signals."""

    def __init__(self, at: Cascade) -> None:
        """Take the block's own states out of its cascade."""
        n, most, block = at.order, MOST_STATES, at.alone()
        both = pair(block, block.rows(block.answer))
        table = np.zeros((2 * most + 2, most + 3))
        parts = (0, both.state), (most, both.after_one), (most + 1, both.after_two), (most + 2, both.single)
        for first, columns in parts:
            rows = table[first : first + columns.shape[0]]
            rows[:, :n], rows[:, most : most + columns.shape[1] - n] = columns[:, :n], columns[:, n:]
        self._table = table.ravel()
        self._state = np.zeros((most + 1, WIDTH))

    def run(self, signals: Matrix, every: int, column: int, out: Matrix) -> None:
        """Put every ``every``-th answer to signals, shape (n, 8), to the ``column``-th eight of the rows of out."""
        lane_kernels.through_block(self._table, self._state, signals, every, column, out)


class Answers:
    """A cascade at work, at rest, with up to eight outputs."""

    def __init__(self, at: Cascade, outputs: Sequence[Outputs]) -> None:
        """Take the cascade and its outputs, one row each."""
        self._table = pair_rows(at, outputs, range(len(outputs)))
        self._state, self._levels = np.zeros((1, WIDTH)), np.zeros(1)

    def run(self, w: Array, every: int, column: int, out: Matrix) -> None:
        """Put every ``every``-th of the outputs to the ``column``-th eight of the rows of out."""
        lane_kernels.answers(self._table, self._state, self._levels, w, every, column, out)
