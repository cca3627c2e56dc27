"""How are eight derivatives laid out for the compiled loops that run them abreast?"""

from collections.abc import Sequence

import numpy as np

from identify import kernels
from identify.cascade import Cascade, Outputs
from identify.discretise import Matrix
from identify.lanes import WIDTH
from identify.trace import Array

MOST_STATES = WIDTH // 2  # of a block: its cascade, twice as large, fills the lanes


def cascade_rows(at: Cascade, outputs: Sequence[Outputs], lanes: Sequence[int]) -> Matrix:
    """Return rows 0-18 of a table of ``kernels.tangents_to_w``: the cascade, and an output in every named lane."""
    table, n = np.zeros((19, WIDTH)), at.phi.shape[0]
    table[:n, :n] = at.phi.T
    table[8, :n], table[9, :n] = at.g0, at.g1
    for output, lane in zip(outputs, lanes, strict=True):
        table[10 : 10 + n, lane] = output.taps[0]
        table[18, lane] = output.feed[0]
    return table


class ToW:
    """G1 and F at work, at rest: w, and eight of its derivatives."""

    def __init__(self, table: Matrix, lines: tuple[float, float, float, float]) -> None:
        """Take a table of ``kernels.tangents_to_w``, and slope and w at v = 0 of F's loading and unloading line."""
        self._table, self._lines = table, np.array(lines)
        self._state, self._levels = np.zeros((3, WIDTH)), np.zeros(2)

    def run(self, u: Array, w: Array, dw: Matrix) -> None:
        """Turn u into w, shape (n,), and dw, shape (n, 8)."""
        kernels.tangents_to_w(self._table, self._lines, self._state, self._levels, u, w, dw)


class Through:
    """A block at work, at rest, on eight signals."""

    def __init__(self, at: Cascade) -> None:
        """Take the block's own states out of its cascade."""
        n, most = at.order, MOST_STATES
        step = np.zeros((most + 3, most))
        step[:n, :n], step[most, :n], step[most + 1, :n] = at.phi[:n, :n], at.g0[:n], at.g1[:n]
        step[most + 2, :n] = at.answer.taps[0, :n]
        self._step = np.append(step, at.answer.feed)
        self._state = np.zeros((most + 1, WIDTH))

    def run(self, signals: Matrix, every: int, column: int, out: Matrix) -> None:
        """Put every ``every``-th answer to signals, shape (n, 8), to the ``column``-th eight of the rows of out."""
        kernels.through_block(self._step, self._state, signals, every, column, out)


class Answers:
    """A cascade at work, at rest, with up to eight outputs."""

    def __init__(self, at: Cascade, outputs: Sequence[Outputs]) -> None:
        """Take the cascade and its outputs, one row each."""
        self._table = cascade_rows(at, outputs, range(len(outputs)))
        self._state, self._levels = np.zeros((1, WIDTH)), np.zeros(1)

    def run(self, w: Array, every: int, column: int, out: Matrix) -> None:
        """Put every ``every``-th of the outputs to the ``column``-th eight of the rows of out."""
        kernels.answers(self._table, self._state, self._levels, w, every, column, out)
