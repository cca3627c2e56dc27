"""How sure is every number of a fitted model, and how do their errors hang together?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain, model_of
from identify.coefficients import coefficients
from identify.effects import physics_in
from identify.fit import Fit
from identify.interval import Interval, number
from identify.model import Model
from identify.propagation import Z95, propagated
from identify.trace import Array

DIGITS = 9  # of a covariance in JSON: rounding must not cost it its positive directions


@dataclass(frozen=True)
class Certainty:
    """The numbers of a fitted model in their own units, and the covariance of those the data moved."""

    values: dict[str, float]
    names: tuple[str, ...]
    covariance: NDArray[np.float64]

    def interval(self, name: str) -> Interval:
        """Return a number with its 95 % interval; positive ones of the denominators and delays stay positive."""
        value = self.values[name]
        if name not in self.names:
            return Interval(value, value, value)
        half = Z95 * float(np.sqrt(self.covariance[self.names.index(name), self.names.index(name)]))
        if value > 0.0 and (".den." in name or name.endswith("dead_time")):
            with np.errstate(over="ignore"):
                return Interval(value, value * float(np.exp(-half / value)), value * float(np.exp(half / value)))
        return Interval(value, value - half, value + half)

    def to_dict(self) -> dict[str, object]:
        """Return names and covariance for JSON, in products of the units that the rig file gives the values."""
        return {"names": list(self.names), "matrix": [[number(v, DIGITS) for v in row] for row in self.covariance]}


def certainty(model: Model, fit: Fit, wider: float) -> Certainty:
    """Return the numbers of ``model`` as fitted, with their covariance times ``wider`` squared."""
    values = _values(fit.chain, model)
    told = [name for name, value in values.items() if np.isfinite(value)]
    found = propagated(fit, lambda chain: _numbers(chain, model, told))
    moved = np.flatnonzero(found.sd > 0.0)
    names = tuple(told[i] for i in moved)
    return Certainty(values, names, wider**2 * found.covariance[np.ix_(moved, moved)])


def fitted_model(chain: Chain, model: Model) -> Model:
    """Return ``model`` with the values of a chain, its physics among them."""
    return replace(model_of(chain, model), physics=physics_in(chain))


def _values(chain: Chain, model: Model) -> dict[str, float]:
    """Return the numbers of a chain, every dead time as G2's: only their sum is told."""
    found = fitted_model(chain, model)
    late_s = found.g1.dead_time_s + found.g2.dead_time_s
    return {**coefficients(found), "G1.dead_time": 0.0, "G2.dead_time": late_s}


def _numbers(chain: Chain, model: Model, names: Sequence[str]) -> Array:
    values = _values(chain, model)
    return np.array([values[name] for name in names])
