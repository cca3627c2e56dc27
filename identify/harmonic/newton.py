"""Which unknowns of a small problem leave the least in the sum of squares?"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array

Matrix = NDArray[np.float64]
ROUNDS = 60
LARGEST = 0.5  # change of an unknown in one step
ENOUGH = 1e-6  # gain in the sum of squares below which the search ends
UNTOLD = 1e3  # standard deviation of an unknown that nothing tells of, in its own unit
STIFFEST = 1e12  # damping beyond which no step helps


def least_squares(missed: Callable[[Array], Array], rows: Callable[[Array], Matrix], x: Array) -> tuple[Array, Array]:
    """Return the unknowns near ``x`` with the least sum of squares of ``missed``, and what is missed there.

    Levenberg-Marquardt: steps are damped until none is long and the sum falls, so that what nothing tells of stays and
    holds up nothing else. ``rows`` is d missed / d x; where ``missed`` raises ValueError no step leads.
    """
    here, damping = missed(x), UNTOLD**-2.0
    for _ in range(ROUNDS):
        before = float(here @ here)
        x, here, damping = _step(missed, rows(x), x, here, damping)
        if before - float(here @ here) < ENOUGH:
            break
    return x, here


def _step(
    missed: Callable[[Array], Array], table: Matrix, x: Array, here: Array, damping: float
) -> tuple[Array, Array, float]:
    """Return the unknowns after one step that helps, what is missed there, and the damping to begin with next."""
    matrix, right = table.T @ table, -table.T @ here
    while damping < STIFFEST:
        step = np.linalg.solve(matrix + np.eye(x.size) * damping, right)
        there = _there(missed, x + step) if np.max(np.abs(step)) < LARGEST else None
        if there is not None and float(there @ there) <= float(here @ here):
            return x + step, there, max(0.1 * damping, UNTOLD**-2.0)
        damping *= 10.0
    return x, here, damping


def _there(missed: Callable[[Array], Array], x: Array) -> Array | None:
    """Return what is missed at ``x``; None where nothing can be."""
    try:
        return missed(x)
    except ValueError:
        return None


def variances(curvature: Matrix) -> Array:
    """Return the variance of every unknown from the curvature of its sum of squares; at most that of ``UNTOLD``."""
    held = curvature + np.eye(curvature.shape[0]) * UNTOLD**-2.0
    scale = 1.0 / np.sqrt(np.diag(held))
    inverted = np.linalg.inv(held * np.outer(scale, scale))
    return np.asarray(np.maximum(np.diag(inverted), 0.0) * scale**2)
