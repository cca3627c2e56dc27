"""Which unknowns of a small problem leave the least in the sum of squares?"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array

Matrix = NDArray[np.float64]
ROUNDS, HALVINGS = 40, 12
LARGEST = 0.5  # change of an unknown in one step
NEGLIGIBLE = 1e-8  # gain in the sum of squares that ends the search
UNTOLD = 1e3  # standard deviation of an unknown that nothing tells of, in its own unit


def least_squares(missed: Callable[[Array], Array], rows: Callable[[Array], Matrix], x: Array) -> tuple[Array, Array]:
    """Return the unknowns near ``x`` with the least sum of squares of ``missed``, and what is missed there.

    Gauss-Newton, a step halved until it helps; a direction nothing tells of is held by a ridge and stays where it is.
    ``rows`` is d missed / d x. A trial for which ``missed`` raises ValueError counts as one that does not help.
    """
    here = missed(x)
    for _ in range(ROUNDS):
        table = rows(x)
        right = -table.T @ here
        step = np.linalg.solve(table.T @ table + np.eye(x.size) * UNTOLD**-2.0, right)
        if float(step @ right) < NEGLIGIBLE:
            break
        step *= min(1.0, LARGEST / float(np.max(np.abs(step))))
        before, (x, here) = here, _towards(missed, x, here, step)
        if here is before:
            break
    return x, here


def _towards(missed: Callable[[Array], Array], x: Array, here: Array, step: Array) -> tuple[Array, Array]:
    """Return the unknowns, and what is missed there, after as much of the step as helps; after none when none does."""
    for _ in range(HALVINGS):
        try:
            there = missed(x + step)
        except ValueError:
            there = np.full(1, np.inf)
        if float(there @ there) < float(here @ here):
            return x + step, there
        step = 0.5 * step
    return x, here


def variances(curvature: Matrix) -> Array:
    """Return the variance of every unknown from the curvature of its sum of squares; at most that of ``UNTOLD``."""
    held = curvature + np.eye(curvature.shape[0]) * UNTOLD**-2.0
    scale = 1.0 / np.sqrt(np.diag(held))
    inverted = np.linalg.inv(held * np.outer(scale, scale))
    return np.asarray(np.maximum(np.diag(inverted), 0.0) * scale**2)
