"""How a linear block in s becomes exact steps in time.

The input between two instants is one of two shapes. Ramp: straight from s[j-1] to s[j] (inside the chain, where
signals are continuous). Held: constant at s[j], with the first ``fraction`` of the step still at s[j-1] (a DAC whose
update arrives late by a part of a step). Both give x[j] = Phi x[j-1] + g0 s[j-1] + g1 s[j] without approximation.

What a block puts out between two instants follows in the same way from the state at the first of them, so that a
delay behind it by any part of a step is exact as well (``read_early``).
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm

Matrix = NDArray[np.float64]
InputShape = Literal["ramp", "held"]
Row = tuple[float, ...]
FOUR = 4  # steps that are made at once


@dataclass(frozen=True)
class Stepper:
    """One linear block at one step size, as the tuples the compiled loops take."""

    rows: tuple[Row, ...]
    g0: Row
    g1: Row
    c: Row
    d: float

    @property
    def order(self) -> int:
        """Return the number of states (0 states are run as one state that stays zero)."""
        return len(self.rows)

    @property
    def one(self) -> tuple[tuple[Row, ...], Row, Row, Row, float]:
        """Return what a step is made of."""
        return self.rows, self.g0, self.g1, self.c, self.d

    @cached_property
    def four(self) -> tuple[tuple[Row, ...], ...]:
        """Return (rows, pushes, reads, feeds) of four steps at once.

        From the state x before them and s, the input before them and in them: the state after them is rows x +
        pushes s, what is put out meanwhile reads x + feeds s.
        """
        n = self.order
        matrix, taps = np.array(self.rows), np.array(self.c)
        x, out = np.eye(n, n + 1 + FOUR), np.empty((FOUR, n + 1 + FOUR))  # over x before and s, of all that comes
        for k in range(FOUR):
            x = matrix @ x
            x[:, n + k] += self.g0
            x[:, n + k + 1] += self.g1
            out[k] = taps @ x
            out[k, n + k + 1] += self.d
        rows, pushes, reads = (tuple(map(tuple, part.tolist())) for part in (x[:, :n], x[:, n:], out[:, :n]))
        feeds = tuple(tuple(row[n : n + k + 2]) for k, row in enumerate(out.tolist()))  # none of what comes later
        return rows, pushes, reads, feeds

    def at_rest(self) -> Row:
        """Return the state of a block whose input has been zero for ever."""
        return (0.0,) * len(self.rows)


def companion(num: Row, den: Row) -> tuple[Matrix, Matrix, Matrix, float, float]:
    """Return (A, B, C, D, w0): a controllable form in scaled time s / w0, so that entries stay near one.

    ``num`` and ``den`` in descending powers, len(num) <= len(den). ValueError when the block is improper
    or its denominator begins or ends in 0.
    """
    order = len(den) - 1
    num = without_leading_zeros(num)
    _check(num, den)
    w0 = float(abs(den[-1] / den[0]) ** (1.0 / order))
    powers = w0 ** np.arange(order, -1, -1.0)
    a = np.asarray(den) * powers
    b = np.zeros(order + 1)
    b[order + 1 - len(num) :] = num
    b = b * powers / a[0]
    a = a / a[0]
    big_a = np.diag(np.ones(order - 1), 1)
    big_a[-1] = -a[:0:-1]
    big_b = np.zeros((order, 1))
    big_b[-1, 0] = 1.0
    taps = (b[1:] - b[0] * a[1:])[::-1]
    return big_a, big_b, taps, float(b[0]), w0


def without_leading_zeros(num: Row) -> Row:
    """Return the coefficients from the first that is not 0 on, the last one at least."""
    first = next((i for i, b in enumerate(num) if b != 0.0), len(num) - 1)
    return num[first:]


def _check(num: Row, den: Row) -> None:
    """Raise ValueError for a block that no circuit with a gain at 0 Hz can be."""
    if len(num) > len(den):
        raise ValueError(
            f"numerator of order {len(num) - 1} over denominator of order {len(den) - 1} is not realisable"
        )
    if den[0] == 0.0 or den[-1] == 0.0:
        raise ValueError(f"the first and the last coefficient of the denominator {den} must not be 0")


def transition(a: Matrix, b: Matrix, step: float) -> tuple[Matrix, Matrix, Matrix]:
    """Return (Phi, held, ramp): the state's own step, and its answers to a unit level and to a unit ramp end."""
    n = a.shape[0]
    augmented = np.zeros((n + 2, n + 2))
    augmented[:n, :n] = a * step
    augmented[:n, n : n + 1] = b * step
    augmented[n, n + 1] = 1.0
    power = expm(augmented)
    return power[:n, :n], power[:n, n], power[:n, n + 1]


def exact_step(
    a: Matrix, b: Matrix, step: float, shape: InputShape, fraction: float = 0.0
) -> tuple[Matrix, Matrix, Matrix]:
    """Return (Phi, g0, g1) of x[j] = Phi x[j-1] + g0 s[j-1] + g1 s[j] for x' = a x + b s and an input of a shape."""
    phi, held, ramp = transition(a, b, step)
    if shape == "ramp":
        return phi, held - ramp, ramp
    if fraction == 0.0:
        return phi, np.zeros_like(held), held
    rest_phi, g1, _ = transition(a, b, step * (1.0 - fraction))
    return phi, rest_phi @ transition(a, b, step * fraction)[1], g1


def read_early(
    a: Matrix, b: Matrix, step: float, shape: InputShape, late: float
) -> tuple[Matrix, tuple[float, float]]:
    """Return the state ``late`` of a step before an instant, and the input there.

    The state as rows over (x[j-1], s[j-1], s[j]), shape (n, n + 2); the input as its shares of s[j-1] and s[j].
    """
    part = 1.0 - late
    phi, held, ramp = transition(a, b, step * part)
    if shape == "held":
        return np.column_stack((phi, np.zeros_like(held), held)), (0.0, 1.0)
    return np.column_stack((phi, held - part * ramp, part * ramp)), (late, part)


@lru_cache(maxsize=4096)
def stepper(
    num: Row, den: Row, step_s: float, shape: InputShape, fraction: float = 0.0, late: float = 0.0
) -> Stepper:
    """Return the exact stepper of num/den for an input of the given shape; ``fraction`` is for held inputs.

    With ``late`` of a step what it puts out comes that much later, the same whole step being left to a delay line.
    Raises ValueError when the block is improper or its denominator begins or ends in 0.
    Source: Van Loan, Computing integrals involving the matrix exponential, IEEE TAC 23 (1978) 395.
    """
    if len(den) == 1:
        _check(without_leading_zeros(num), den)
        gain = num[-1] / den[-1]
        if late == 0.0 or shape == "held":
            return Stepper(((0.0,),), (0.0,), (0.0,), (0.0,), gain)
        return Stepper(((0.0,),), (gain * late,), (gain * (1.0 - late),), (1.0,), 0.0)
    a, b, taps, d, w0 = companion(num, den)
    phi, g0, g1 = exact_step(a, b, step_s * w0, shape, fraction)
    if late > 0.0:
        phi, g0, g1, taps, d = _with_its_answer(phi, g0, g1, taps, d, read_early(a, b, step_s * w0, shape, late))
    return Stepper(tuple(map(tuple, phi.tolist())), tuple(g0.tolist()), tuple(g1.tolist()), tuple(taps.tolist()), d)


def _with_its_answer(
    phi: Matrix, g0: Matrix, g1: Matrix, taps: Matrix, d: float, early: tuple[Matrix, tuple[float, float]]
) -> tuple[Matrix, Matrix, Matrix, Matrix, float]:
    """Return a stepper of one state more, the answer between two instants, which is all that it puts out."""
    n = phi.shape[0]
    rows, (before, now) = early
    answer = taps @ rows + d * np.array((*(0.0,) * n, before, now))
    wider = np.zeros((n + 1, n + 1))
    wider[:n, :n], wider[n, :n] = phi, answer[:n]
    return wider, np.append(g0, answer[n]), np.append(g1, answer[n + 1]), np.eye(n + 1)[n], 0.0
