"""How sure is every number of a fitted model, and how do their errors hang together?"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain, model_of
from identify.effects import physics_in
from identify.fit import Fit
from identify.interval import Interval, number
from identify.model import Model
from identify.trace import Array
from identify.uncertainty.coefficients import coefficients
from identify.uncertainty.profile import TRUSTED, Fitted, profile
from identify.uncertainty.propagation import Z95, propagated

UNTOLD = 0.7  # sd of the log of a coefficient, about its prior's
MOST = 4  # profiles taken of one answer, the surest first: each costs as much as several fits
DIGITS = 9  # of a covariance in JSON: rounding must not cost it its positive directions


@dataclass(frozen=True)
class Certainty:
    """The numbers of a fitted model in their own units, and the covariance of those the data moved."""

    values: dict[str, float]
    names: tuple[str, ...]
    covariance: NDArray[np.float64]
    profiled: Mapping[str, Interval] = field(default_factory=dict)

    def interval(self, name: str) -> Interval:
        """Return a number with its 95 % interval: by profile where it was taken, else by curvature.

        Positive numbers of the denominators and delays stay positive.
        """
        if name in self.profiled:
            return self.profiled[name]
        value = self.values[name]
        if name not in self.names:
            return Interval(value, value, value)
        half = Z95 * float(np.sqrt(self.covariance[self.names.index(name), self.names.index(name)]))
        if _is_positive(name, value):
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


def with_profiles(certain: Certainty, model: Model, fitted: Fitted) -> Certainty:
    """Return ``certain`` with profiles of the positive numbers whose interval by curvature means little.

    Those the data do not tell at all are left: to say so is the business of identify.identifiability.findings.
    """
    sds = dict(zip(certain.names, np.sqrt(np.diag(certain.covariance)) / fitted.wider, strict=True))
    doubtful = [
        name for name, sd in sds.items()
        if _is_positive(name, certain.values[name]) and TRUSTED < sd / certain.values[name] < _untold(name)
    ]  # fmt: skip
    found = {
        name: profile(fitted, partial(_number, model, name), sds[name] / certain.values[name])
        for name in sorted(doubtful, key=lambda name: sds[name] / certain.values[name])[:MOST]
    }  # fmt: skip
    return replace(certain, profiled=found)


def _untold(name: str) -> float:
    """Return the sd of a log from which the data tell no number; a dead time may be none, and is bounded above."""
    return float("inf") if name.endswith("dead_time") else UNTOLD


def _is_positive(name: str, value: float) -> bool:
    return value > 0.0 and (".den." in name or name.endswith("dead_time"))


def fitted_model(chain: Chain, model: Model) -> Model:
    """Return ``model`` with the values of a chain, its physics among them."""
    return replace(model_of(chain, model), physics=physics_in(chain))


def _values(chain: Chain, model: Model) -> dict[str, float]:
    """Return the numbers of a chain, every dead time as G2's: only their sum is told."""
    found = fitted_model(chain, model)
    late_s = found.g1.dead_time_s + found.g2.dead_time_s
    return {**coefficients(found), "G1.dead_time": 0.0, "G2.dead_time": late_s}


def _number(model: Model, name: str, chain: Chain) -> float:
    return _values(chain, model)[name]


def _numbers(chain: Chain, model: Model, names: Sequence[str]) -> Array:
    values = _values(chain, model)
    return np.array([values[name] for name in names])
