"""Where does a quadratic model of the cost have its minimum, inside a box or free, and how wide is it there?"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import lsq_linear

from identify.trace import Array

ROUNDING = 1e-14  # relative curvature that is nothing but rounding


def boxed_step(matrix: NDArray[np.float64], right: Array, low: Array, high: Array) -> Array:
    """Return the minimiser of the quadratic model inside a box.

    The plain solution is taken where it lies inside; else bounded-variable least squares on a square root of the matrix
    (Stark and Parker, Computational Statistics 10 (1995) 129).
    """
    scale, curvatures, axes = resolved(matrix)
    roots = np.sqrt(curvatures)
    factor, target = roots[:, None] * axes.T, axes.T @ (right * scale) / roots
    wanted = axes @ (target / roots)
    if np.all((wanted >= low / scale) & (wanted <= high / scale)):
        return np.asarray(wanted * scale)
    found = lsq_linear(factor, target, (low / scale, high / scale), method="bvls")
    return np.asarray(np.clip(found.x * scale, low, high))


def inverse(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the covariance that belongs to a normal matrix; what the data do not tell stays uncertain."""
    scale, curvatures, axes = resolved(matrix)
    return np.asarray((axes / curvatures) @ axes.T * np.outer(scale, scale))


def resolved(matrix: NDArray[np.float64]) -> tuple[Array, Array, NDArray[np.float64]]:
    """Return (scale, curvatures, axes) of a normal matrix in units in which its diagonal is one.

    In these units a curvature given by the prior alone is not lost beside large ones. Directions in which several
    parameters do the same keep a curvature of rounding size, never zero or less.
    """
    scale = 1.0 / np.sqrt(np.diag(matrix))
    curvatures, axes = eigh(matrix * np.outer(scale, scale))
    return scale, np.maximum(curvatures, ROUNDING * np.max(curvatures, initial=0.0)), axes
