"""How sure is a number that is computed from the fitted values, when each of them is only known so well?"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain
from identify.fit import Fit
from identify.interval import Interval
from identify.trace import Array

STEP = 1e-4  # of the central differences, in search coordinates
Z95 = 1.959963984540054

Law = Callable[[Chain], Array]


@dataclass(frozen=True)
class Propagated:
    """Numbers computed from a fit, and their covariance to first order (delta method)."""

    value: Array
    covariance: NDArray[np.float64]

    @property
    def sd(self) -> Array:
        """Return the standard deviation of every number; infinite where the fit gave none."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def intervals(self, inflation: float = 1.0, coordinate: Literal["linear", "log"] = "linear") -> list[Interval]:
        """Return every number with its 95 % interval; ``log`` says that the numbers are logarithms of what is told."""
        tell = np.exp if coordinate == "log" else np.asarray
        half = Z95 * inflation * self.sd
        with np.errstate(over="ignore"):
            rows = zip(tell(self.value), tell(self.value - half), tell(self.value + half), strict=True)
            return [Interval(float(value), float(low), float(high)) for value, low, high in rows]


def propagated(fit: Fit, law: Law) -> Propagated:
    """Return ``law`` of the fitted chain with its covariance: its derivative in every searched coordinate.

    The derivative is a central difference at the fit. A number on which no searched coordinate acts is certain.
    """
    value = np.asarray(law(fit.chain), dtype=np.float64)
    rows = np.array([_slope(fit, law, i) for i in range(len(fit.coordinates))]).reshape(-1, value.size)
    if not np.all(np.isfinite(fit.covariance)):
        unknown = np.where(np.any(rows != 0.0, axis=0), np.inf, 0.0)
        return Propagated(value, np.diag(unknown))
    return Propagated(value, rows.T @ fit.covariance @ rows)


def _slope(fit: Fit, law: Law, i: int) -> Array:
    """Return the derivative of ``law`` in one coordinate."""
    c, theta = fit.coordinates[i], float(fit.theta[i])
    above, below = (law(fit.chain.with_values({c.name: c.value(theta + step)})) for step in (STEP, -STEP))
    return (np.asarray(above) - np.asarray(below)) / (2.0 * STEP)
