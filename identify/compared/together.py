"""By how much do two recordings fit worse when they have to share values: is that more than chance?

A likelihood ratio, so that it holds however the values of either fit hang together, whatever they are called, and where
their errors are no ellipsoid. Each side's chi-squared is taken per its own noise, and per square of the factor by which
its intervals are wider; under "nothing changed" the rise has a chi-squared distribution of as many degrees of freedom
as there are directions that both sides tell (Wilks, Annals of Mathematical Statistics 9 (1938) 60). Where the noise is
only known as well as so many readings tell it, it is Fisher's F.
"""

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2, f

from identify.chain import Chain
from identify.coordinate import Coordinate
from identify.derivatives.sensitivities import sensitivities
from identify.fit import Fit, total_chi_squared
from identify.identification import Identification
from identify.interval import number
from identify.observe import Observation
from identify.quadratic import boxed_step
from identify.trace import Array
from identify.uncertainty.inflation import inflation

ITERATIONS = 25
RADIUS = 0.5  # first half width of the trust box, in search coordinates
NEGLIGIBLE = 1e-3  # an expected fall of chi-squared that no test could see ends the search
STALLED = 1e-9  # half width of the box at which no step helps
HELD = 1e-6  # curvature that keeps what neither side tells where it is


@dataclass(frozen=True)
class Side:
    """One side of a comparison: its best fit, the data, the factor on its intervals, how well its noise is known."""

    fit: Fit
    observations: tuple[Observation, ...]
    wider: float = 1.0
    freedom: float = float("inf")

    @classmethod
    def of(cls, found: Identification) -> "Side":
        """Return the side an identification was made of; ValueError where its fit failed."""
        if not np.isfinite(found.fit.cost):
            names = ", ".join(o.trace.name for o in found.observations)
            raise ValueError(f"{names}: {found.fit.sentence}, so there is nothing to compare")
        wider = inflation(found.fit.chain, found.observations, found.noise.freedom)
        return cls(found.fit, found.observations, wider, found.noise.freedom)

    def chi2(self, chain: Chain) -> float:
        """Return chi-squared of a chain, per square of the factor on intervals; infinity where it cannot be."""
        return total_chi_squared(chain, self.observations) / self.wider**2

    def normal(self, chain: Chain, scales: dict[str, float]) -> tuple[NDArray[np.float64], Array]:
        """Return the normal matrix and the right side of the named values, each in steps of its scale."""
        matrix, right = np.zeros((len(scales), len(scales))), np.zeros(len(scales))
        for observation in self.observations:
            curvature, gradient = sensitivities(chain, scales, observation).normal()
            matrix, right = matrix + curvature / self.wider**2, right + gradient / self.wider**2
        return matrix, right


@dataclass(frozen=True)
class Rise:
    """What sharing costs: the rise of chi-squared, its degrees of freedom, and how often chance does as much."""

    chi2: float
    freedom: float
    p_value: float

    def to_dict(self) -> dict[str, object]:
        """Return the form of ``rig compare --json``."""
        return {"chi2": number(self.chi2), "freedom": number(self.freedom, 3), "p_value": number(self.p_value, 3)}


def rise(sides: tuple[Side, Side], shared: Collection[str] | None = None) -> Rise:
    """Return what it costs that values be the same on both sides: those ``shared``, None for all that both have.

    The search begins at either side's values, and the lower end counts.
    """
    both = {c.name for c in sides[0].fit.coordinates} & {c.name for c in sides[1].fit.coordinates}
    problem = _Problem(sides, tuple(sorted(both if shared is None else both & set(shared))))
    if not problem.shared:
        return Rise(0.0, 0.0, 1.0)
    apart = sum(side.chi2(side.fit.chain) for side in sides)
    lowest = min(problem.lowest(problem.start(first)) for first in (0, 1))
    freedom = problem.freedom
    higher = max(lowest - apart, 0.0)
    return Rise(higher, freedom, chance(higher, freedom, min(side.freedom for side in sides)))


def chance(higher: float, freedom: float, of_noise: float) -> float:
    """Return how often chance makes chi-squared rise that much, the noise known as well as ``of_noise`` readings do."""
    if freedom <= 0.0:
        return 1.0
    if np.isfinite(of_noise):
        return float(f.sf(higher / freedom, freedom, of_noise))
    return float(chi2.sf(higher, freedom))


@dataclass(frozen=True)
class _Problem:
    """Both sides with the values of ``shared`` the same: a vector of search coordinates, the second side's own last."""

    sides: tuple[Side, Side]
    shared: tuple[str, ...]

    @cached_property
    def coordinates(self) -> tuple[Coordinate, ...]:
        """Return what is searched: all of the first side, then what is the second's alone."""
        first, second = (side.fit.coordinates for side in self.sides)
        return (*first, *(c for c in second if c.name not in self.shared))

    @cached_property
    def places(self) -> tuple[list[int], list[int]]:
        """Return where in the vector each side's coordinates stand."""
        first, second = (side.fit.coordinates for side in self.sides)
        at = {c.name: i for i, c in enumerate(first)}
        own = [c.name for c in second if c.name not in self.shared]
        late = {name: len(first) + i for i, name in enumerate(own)}
        return list(range(len(first))), [late.get(c.name, at.get(c.name, -1)) for c in second]

    def start(self, side: int) -> Array:
        """Return the vector at which every side has its own values, and the shared ones are those of one side."""
        values = [side.fit.chain.values for side in self.sides]
        first = len(self.sides[0].fit.coordinates)
        told = [values[side if c.name in self.shared else 0 if i < first else 1][c.name]
                for i, c in enumerate(self.coordinates)]  # fmt: skip
        return np.array([c.bounded(c.theta(value)) for c, value in zip(self.coordinates, told, strict=True)])

    @cached_property
    def _bounds(self) -> tuple[Array, Array]:
        low, high = zip(*(c.bounds for c in self.coordinates), strict=True)
        return np.array(low), np.array(high)

    def _chain(self, which: int, theta: Array) -> Chain:
        """Return one side's chain."""
        at = [(self.coordinates[i], theta[i]) for i in self.places[which]]
        return self.sides[which].fit.chain.with_values({c.name: c.value(float(t)) for c, t in at})

    def cost(self, theta: Array) -> float:
        """Return chi-squared of both sides."""
        return sum(side.chi2(self._chain(i, theta)) for i, side in enumerate(self.sides))

    def normal(self, theta: Array) -> tuple[NDArray[np.float64], Array]:
        """Return the normal matrix and the right side of all that is searched."""
        matrix, right = HELD * np.eye(theta.size), np.zeros(theta.size)
        for which, side in enumerate(self.sides):
            at = self.places[which]
            scales = {self.coordinates[i].name: self.coordinates[i].slope(float(theta[i])) for i in at}
            curvature, gradient = side.normal(self._chain(which, theta), scales)
            matrix[np.ix_(at, at)] += curvature
            right[at] += gradient
        return matrix, right

    def lowest(self, theta: Array) -> float:
        """Return the lowest chi-squared that Gauss-Newton steps in a trust box lead to."""
        cost, radius = self.cost(theta), RADIUS
        if not np.isfinite(cost):
            return cost
        matrix, right = self.normal(theta)
        for _ in range(ITERATIONS):
            low, high = np.maximum(self._bounds[0] - theta, -radius), np.minimum(self._bounds[1] - theta, radius)
            step = boxed_step(matrix, right, low, high)
            expected = float(step @ (2.0 * right - matrix @ step))
            if expected < NEGLIGIBLE or radius < STALLED:
                break
            gained = cost - self.cost(theta + step)
            radius *= 3.0 if gained > 0.75 * expected else 1.0 if gained > 0.25 * expected else 0.25
            if gained > 0.0:
                theta, cost = theta + step, cost - gained
                matrix, right = self.normal(theta)
        return cost

    @cached_property
    def freedom(self) -> float:
        """Return how many directions of the shared values both sides tell, each counted as far as it is told.

        What a side leaves to its prior cannot differ by chance: the trace of what chance moves over what is allowed.
        """
        allowed, moved = np.zeros((len(self.shared),) * 2), np.zeros((len(self.shared),) * 2)
        for side in self.sides:
            names = [c.name for c in side.fit.coordinates]
            at = [names.index(name) for name in self.shared]
            precise = side.fit.covariance @ np.diag([c.prior_sd**-2.0 for c in side.fit.coordinates])
            told = side.fit.covariance - precise @ side.fit.covariance
            allowed += side.wider**2 * side.fit.covariance[np.ix_(at, at)]
            moved += side.wider**2 * told[np.ix_(at, at)]
        return float(np.trace(np.linalg.pinv(allowed, hermitian=True) @ moved))
