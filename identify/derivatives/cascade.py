"""How does the answer of a linear block change with its coefficients, as the outputs of one system twice as large?

For y = N/D u every derivative is y filtered once more by 1/D or u filtered once: dy/dn_k = s^k/D u and
dy/dd_k = -s^k/D y. In controllable form the states of a filter 1/D are s^0/D, s^1/D ... of its input, so that the
states of the block, and of a second 1/D driven by its answer, hold all of them. They take exact steps like the block.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from identify.discretise import InputShape, Matrix, Row, companion, exact_step, read_early
from identify.model import Rational
from identify.stage import Values
from identify.trace import Array

SHARE = 1e-3  # step of the differences of coefficients, as a share of a value: they are products of values, no more


@dataclass(frozen=True)
class Outputs:
    """Rows of taps on the states of a cascade, and what its input and the input's slope (in 1/s) add to each."""

    taps: Matrix
    feed: Array
    rise: Array

    def mixed(self, weights: Matrix) -> "Outputs":
        """Return weighted sums of the outputs, one for every row of weights."""
        return Outputs(weights @ self.taps, weights @ self.feed, weights @ self.rise)

    def and_then(self, other: "Outputs") -> "Outputs":
        """Return these outputs and then others."""
        pairs = (self.taps, other.taps), (self.feed, other.feed), (self.rise, other.rise)
        return Outputs(*(np.concatenate(pair) for pair in pairs))


@dataclass(frozen=True)
class Cascade:
    """x[j] = phi x[j-1] + g0 s[j-1] + g1 s[j], the first ``order`` states those of the block alone.

    ``answer`` and ``rate`` (the answer's slope in 1/s) are one row each; ``coefficients`` the derivatives by the
    coefficients of numerator and denominator, as many of each, descending powers of s. Outputs are read at an instant
    or before it (``discretise.read_early``): ``state`` and ``input`` there, as rows over (x[j-1], s[j-1], s[j]), and
    ``slope`` of the input in 1/s.
    """

    order: int
    phi: Matrix
    g0: Array
    g1: Array
    answer: Outputs
    rate: Outputs
    coefficients: Outputs
    state: Matrix
    input: Array
    slope: Array

    def rows(self, outputs: Outputs) -> Matrix:
        """Return outputs as rows over (x[j-1], s[j-1], s[j]), shape (m, states + 2)."""
        return np.asarray(
            outputs.taps @ self.state + np.outer(outputs.feed, self.input) + np.outer(outputs.rise, self.slope)
        )

    def alone(self) -> "Cascade":
        """Return the block by itself, without the states that its derivatives need."""
        n = self.order
        own = np.r_[0:n, self.phi.shape[0] : self.phi.shape[0] + 2]
        answer = replace(self.answer, taps=self.answer.taps[:, :n])
        return replace(
            self, phi=self.phi[:n, :n], g0=self.g0[:n], g1=self.g1[:n], answer=answer,
            state=self.state[:n, own], input=self.input[own], slope=self.slope[own],
        )  # fmt: skip


@lru_cache(maxsize=64)
def cascade(
    num: Row, den: Row, step_s: float, shape: InputShape, fraction: float = 0.0, late: float = 0.0
) -> Cascade:
    """Return the cascade of num/den on a grid, read ``late`` of a step before each instant; ``fraction`` as of stepper.

    Raises ValueError where no circuit can be.
    """
    if len(den) == 1:
        return _of_gain(num[-1], den[-1], step_s, shape, late)
    a, b, taps, d, w0 = companion(num, den)
    n = a.shape[0]
    both_a = np.block([[a, np.zeros((n, n))], [b * taps, a]])
    both_b = np.concatenate((b, d * b))
    phi, g0, g1 = exact_step(both_a, both_b, step_s * w0, shape, fraction)
    here = np.column_stack((phi, g0, g1)), (0.0, 1.0)
    state, shares = read_early(both_a, both_b, step_s * w0, shape, late) if late > 0.0 else here
    rest = np.zeros(n)
    powers = w0 ** np.arange(0.0, -n - 1.0, -1.0)[:, None] / den[0]
    by_num = _outputs(np.block([[a[-1:], np.zeros((1, n))], [np.eye(n)[::-1], np.zeros((n, n))]]), np.eye(n + 1)[0])
    by_den = _outputs(
        -np.block([[taps[None, :], a[-1:]], [np.zeros((n, n)), np.eye(n)[::-1]]]), -d * np.eye(n + 1)[0]
    )
    found = by_num.and_then(by_den).mixed(np.diag(np.tile(powers[:, 0], 2)))
    answer = _outputs(np.concatenate((taps, rest))[None, :], np.array([d]))
    rate = Outputs(w0 * np.concatenate((taps @ a, rest))[None, :], w0 * taps @ b, np.array([d]))
    given, slope = _of_input(2 * n, shares, shape, step_s)
    return Cascade(n, phi, g0, g1, answer, rate, found, state, given, slope)


def _outputs(taps: Matrix, feed: Array) -> Outputs:
    """Return outputs that take no notice of the input's slope."""
    return Outputs(taps, feed, np.zeros(feed.size))


def _of_input(states: int, shares: tuple[float, float], shape: InputShape, step_s: float) -> tuple[Array, Array]:
    """Return the input where outputs are read, and its slope in 1/s, as rows over (x[j-1], s[j-1], s[j])."""
    none = (0.0,) * states
    rise = 1.0 / step_s if shape == "ramp" else 0.0
    return np.array((*none, *shares)), np.array((*none, -rise, rise))


def _of_gain(num: float, den: float, step_s: float, shape: InputShape, late: float) -> Cascade:
    """Return the cascade of a block without dynamics: it has no states."""
    none = np.zeros(0)

    def rows(*feed: float) -> Outputs:
        return _outputs(np.zeros((len(feed), 0)), np.array(feed))

    shares = (late, 1.0 - late) if shape == "ramp" else (0.0, 1.0)
    given, slope = _of_input(0, shares, shape, step_s)
    rate = Outputs(np.zeros((1, 0)), np.zeros(1), np.array([num / den]))
    return Cascade(
        0, np.zeros((0, 0)), none, none, rows(num / den), rate, rows(1.0 / den, -num / den**2), np.zeros((0, 2)),
        given, slope,
    )  # fmt: skip


def coefficient_slopes(rational: Callable[[Values], Rational], values: Values, scales: Values) -> list[Array]:
    """Return how the coefficients (in the order of Cascade) change with each value of a block.

    ``scales`` are the natural sizes of the values, for those that are 0.
    """
    rows = []
    for i, (value, scale) in enumerate(zip(values, scales, strict=True)):
        step = SHARE * (abs(value) or scale)
        varied = ((*values[:i], x, *values[i + 1 :]) for x in (value + step, value - step))
        above, below = (_coefficients(rational(each)) for each in varied)
        rows.append((above - below) / (2.0 * step))
    return rows


def _coefficients(block: Rational) -> Array:
    """Return the coefficients of numerator and denominator, as many of each."""
    missing = len(block.den) - len(block.num)
    return np.array((*(0.0,) * missing, *block.num, *block.den))
