"""Which values of a chain's parameters make its answers closest to the recordings, and how sure are they?

Joint maximum likelihood over all runs with white noise of known size: Gauss-Newton steps inside a trust box, on normal
equations that are summed chunk by chunk (identify.derivatives.sensitivities).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError

from identify.chain import Chain
from identify.coordinate import Coordinate, coordinates_of
from identify.derivatives.sensitivities import sensitivities
from identify.observe import Observation
from identify.quadratic import boxed_step, inverse
from identify.trace import Array

PULL_STEP = 1e-4  # of the differences of a pull's law, in search coordinates
HALVED = -0.5  # relative step by which a value searched in its log may fall at once
RADIUS = 0.5  # first half width of the trust box, in search coordinates
STALLED = 1e-9  # half width of the box at which no step helps
POOR = 0.25  # share of the expected gain below which a trial is taken one step further
VISIBLE = 0.1  # gain in cost of a third of a standard deviation: a search that stalls with less left is done
STILL = 1e-6  # expected gain, relative to the cost, below which rounding and corners stop a model that does not fit
LAST = 3  # steps that gain less than enough together end a search
NEGLIGIBLE = 1e-4  # an expected gain in cost that no test could see ends the search


@dataclass(frozen=True)
class Pull:
    """A wish that ``law`` of the chain be ``target``, as strong as a measurement of it with error ``sd``.

    All three are numbers, or arrays of shape (k,) of as many independent wishes. Where a fit under a pull comes to
    rest, no other chain with the same value of ``law`` fits the data better.
    """

    law: Callable[[Chain], float | Array]
    target: float | Array
    sd: float | Array

    def cost(self, chain: Chain) -> float:
        """Return the price of not having what is wished for."""
        return float(np.sum(np.square((self.law(chain) - self.target) / self.sd)))


@dataclass(frozen=True)
class Fit:
    """A fitted chain: its cost (chi-squared plus prior), and the covariance of its searched coordinates.

    ``beyond`` is by how much the cost would fall further, to second order, if no value had bounds.
    """

    chain: Chain
    coordinates: tuple[Coordinate, ...]
    theta: Array
    cost: float
    covariance: NDArray[np.float64]
    converged: bool
    sentence: str
    beyond: float = 0.0

    def sd(self, name: str) -> float:
        """Return the standard deviation of a value, in its unit; 0 when it was not searched."""
        for i, coordinate in enumerate(self.coordinates):
            if coordinate.name == name:
                return float(np.sqrt(self.covariance[i, i])) * abs(coordinate.slope(float(self.theta[i])))
        return 0.0

    def distance(self, other: "Fit") -> float:
        """Return how far another fit of the same coordinates lies from this one, in standard deviations of this."""
        moved = self.theta - other.theta
        return float(np.sqrt(max(float(moved @ np.linalg.solve(self.covariance, moved)), 0.0)))

    def ci95(self, name: str, inflation: float = 1.0) -> tuple[float, float]:
        """Return the 95 % interval of a value, from the curvature of the likelihood in its search coordinate.

        No end of it lies where the value cannot be.
        """
        for i, coordinate in enumerate(self.coordinates):
            if coordinate.name == name:
                half = 1.96 * inflation * float(np.sqrt(self.covariance[i, i]))
                ends = (coordinate.value(float(self.theta[i]) - half), coordinate.value(float(self.theta[i]) + half))
                return (max(min(ends), coordinate.parameter.least), min(max(ends), coordinate.parameter.most))
        return (self.chain.values[name], self.chain.values[name])


def fit(
    chain: Chain,
    observations: Sequence[Observation],
    centre: Mapping[str, float] | None = None,
    fixed: Sequence[str] = (),
    iterations: int = 30,
    pull: Pull | None = None,
    valleys: bool = True,
    enough: float = 0.0,
    rougher: int = 1,
    told: bool = True,
    near: bool = False,
) -> Fit:
    """Fit ``chain`` from its own values to all observations; the prior sits at ``centre`` (default: the start).

    A ``pull`` draws the fit aside; its price is not in the cost that is returned. Without ``valleys`` a step that does
    not help is only made shorter: narrow bent valleys are then not followed to their end, at half the work. Nor are
    they where some steps in a row gain less than ``enough`` of chi-squared together. Slopes that take a run for every
    value are taken on grids ``rougher`` by up to that factor: they lead to where they are too small to tell, and cost
    most of a fit. Unless it shall be ``told`` how sure values are, a search that ends with its iterations does not ask:
    the covariance is infinite then, and nothing is ``beyond``. A search that begins ``near`` its end stops after a
    step that promises less than ``enough``.

    Never raises for bad numbers: a fit that does not converge says so in ``converged`` and ``sentence``.
    """
    centre = {**chain.values, **(centre or {})}
    coordinates = coordinates_of(chain, centre, [o.trace.name for o in observations], fixed)
    begun = [chain.values.get(c.name, chain.values[c.parameter.name]) for c in coordinates]
    start = np.array([c.bounded(c.theta(value)) for c, value in zip(coordinates, begun, strict=True)])
    problem = _Problem(chain, tuple(observations), coordinates, pull, rougher)
    found = _search(problem, start, iterations, valleys, enough, told, near)
    return replace(found, cost=found.cost - pull.cost(found.chain)) if pull else found


@dataclass(frozen=True)
class _Problem:
    """The chain, the data and the coordinates of one fit."""

    chain: Chain
    observations: tuple[Observation, ...]
    coordinates: tuple[Coordinate, ...]
    pull: Pull | None = None
    rougher: int = 1

    @cached_property
    def slopes_on(self) -> tuple[Observation, ...]:
        """Return the data on the grids of the slopes."""
        if self.rougher == 1:
            return self.observations
        grids = (max(o.substeps // self.rougher, 1) for o in self.observations)
        return tuple(replace(o, substeps=n) for o, n in zip(self.observations, grids, strict=True))

    def at(self, theta: Array) -> Chain:
        """Return the chain at search coordinates theta."""
        return self.chain.with_values({c.name: c.value(float(t)) for c, t in zip(self.coordinates, theta, strict=True)})

    @cached_property
    def prior_sd(self) -> Array:
        """Return the prior's sd in every coordinate."""
        return np.array([c.prior_sd for c in self.coordinates])

    @cached_property
    def bounds(self) -> tuple[Array, Array]:
        """Return the least and the largest value of every coordinate."""
        low, high = np.array([c.bounds for c in self.coordinates]).reshape(-1, 2).T
        return low, high

    def moved(self, theta: Array, step: Array) -> Array:
        """Return search coordinates a step further: values themselves move straight, also those searched in their log.

        A small time constant acts in proportion to itself, and several in proportion to their sum.
        """
        straight = np.log1p(np.maximum(step, HALVED))
        return np.asarray(np.clip(theta + np.where(self.in_log, straight, step), *self.bounds))

    @cached_property
    def in_log(self) -> NDArray[np.bool_]:
        """Return which values are searched in their log."""
        return np.array([c.parameter.coordinate == "log" for c in self.coordinates], dtype=np.bool_)

    def step(
        self, matrix: NDArray[np.float64], right: Array, theta: Array, radius: float
    ) -> tuple[Array, float]:
        """Return the best step within bounds and a box of half width ``radius``, and the gain in cost it promises."""
        least, most = self.bounds
        low, high = np.maximum(least - theta, -radius), np.minimum(most - theta, radius)
        step = boxed_step(matrix, right, low, high)
        return step, float(step @ (2.0 * right - matrix @ step))

    def cost(self, theta: Array) -> float:
        """Return chi-squared plus prior; infinity where the chain cannot be simulated."""
        total = float(np.sum(np.square(theta / self.prior_sd)))
        total += self.pull.cost(self.at(theta)) if self.pull else 0.0
        total += total_chi_squared(self.at(theta), self.observations)
        return total if np.isfinite(total) else float("inf")

    def normal(self, theta: Array) -> tuple[NDArray[np.float64], Array]:
        """Return the normal matrix J'J / sigma^2 plus prior curvature, and the descent direction's right side."""
        matrix = np.diag(self.prior_sd**-2.0)
        right = -theta * self.prior_sd**-2.0
        chain = self.at(theta)
        scales = {c.name: c.slope(float(t)) for c, t in zip(self.coordinates, theta, strict=True)}
        for observation, rough in zip(self.observations, self.slopes_on, strict=True):
            curvature, gradient = sensitivities(chain, scales, observation, rough).normal()
            matrix += curvature
            right += gradient
        if self.pull:
            slopes, short = self._pulled(theta, self.pull)
            matrix, right = matrix + slopes @ slopes.T, right + slopes @ short
        return matrix, right

    def _pulled(self, theta: Array, pull: Pull) -> tuple[NDArray[np.float64], Array]:
        """Return the slopes of a pull's laws in every coordinate, (p, k), and how far off their targets they are, (k,).

        Both per sd.
        """
        ends = [[pull.law(self.at(theta + step)) for step in (row, -row)] for row in PULL_STEP * np.eye(theta.size)]
        slopes = [np.atleast_1d((above - below) / (2.0 * PULL_STEP * pull.sd)) for above, below in ends]
        return np.array(slopes), np.atleast_1d((pull.target - pull.law(self.at(theta))) / pull.sd)


def chi_squared(chain: Chain, observation: Observation) -> float:
    """Return the sum of squared residuals in units of the noise; infinity where the chain cannot be simulated."""
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            total = sum(float(residual @ residual) for residual in observation.whitened(chain))
    except (ValueError, ArithmeticError, LinAlgError):
        return float("inf")
    return total


def total_chi_squared(chain: Chain, observations: Sequence[Observation]) -> float:
    """Return ``chi_squared`` of all observations together."""
    return sum(chi_squared(chain, observation) for observation in observations)


def _search(problem: _Problem, theta: Array, steps: int, valleys: bool, enough: float, told: bool, near: bool) -> Fit:
    """Search by Gauss-Newton steps in a box that grows where the quadratic model holds and shrinks where it fails."""
    cost, radius, costs = problem.cost(theta), RADIUS, [np.inf] * LAST
    if not np.isfinite(cost):
        return _failed(problem, theta, "the model cannot be simulated at its starting values")
    converged, sentence, gained = False, f"no minimum within {steps} iterations", 0.0
    matrix, right = problem.normal(theta)
    for to_go in reversed(range(steps)):
        step, expected = problem.step(matrix, right, theta, radius)
        slow, last = costs[-LAST] - cost < enough, near and expected < enough
        if slow or expected < NEGLIGIBLE or radius < STALLED:
            converged, sentence = _ending(0.0 if slow else problem.step(matrix, right, theta, np.inf)[1], cost)
            break
        most = cost - POOR * expected if valleys else np.inf  # else it is taken on
        there, trial = _tried(problem, problem.moved(theta, step), radius, most)
        gain = (cost - trial) / expected
        radius = radius * 3.0 if gain > 0.75 else radius if gain > 0.25 else 0.25 * float(np.max(np.abs(step)))
        if gain > 0.0:
            costs.append(cost)
            gained, theta, cost = cost - trial, there, trial
        if last:
            converged, sentence = True, "converged"
            break
        if gain > 0.0:
            if not to_go and not told:
                return _untold(problem, theta, cost, sentence)
            matrix, right, gained = *problem.normal(theta), 0.0
    covariance = inverse(matrix)
    left = max(float(right @ covariance @ right) - gained, 0.0)
    return Fit(problem.at(theta), problem.coordinates, theta, cost, covariance, converged, sentence, left)


def _tried(problem: _Problem, theta: Array, radius: float, most: float) -> tuple[Array, float]:
    """Return where a step leads and the cost there; one that costs more than ``most`` is taken on."""
    trial = problem.cost(theta)
    if trial <= most:
        return theta, trial
    return min((theta, trial), _mended(problem, theta, radius), key=lambda found: found[1])


def _mended(problem: _Problem, theta: Array, radius: float) -> tuple[Array, float]:
    """Return where one more step leads from a trial that did not help, and the cost there.

    In a narrow bent valley a step along its floor ends on a wall: from there a step leads back down, far along.
    """
    matrix, right = problem.normal(theta)
    there = problem.moved(theta, problem.step(matrix, right, theta, radius)[0])
    return there, problem.cost(there)


def _ending(left: float, cost: float) -> tuple[bool, str]:
    """Return whether a search that takes no more steps has converged; a free step would promise to gain ``left``."""
    if left < max(VISIBLE, STILL * cost):
        return True, "converged"
    return False, f"no step leads down any more, although the slope promises {left:.2g} of chi-squared"


def _failed(problem: _Problem, theta: Array, sentence: str) -> Fit:
    """Return a fit that says why there is none."""
    return replace(_untold(problem, theta, float("inf"), sentence), chain=problem.chain)


def _untold(problem: _Problem, theta: Array, cost: float, sentence: str) -> Fit:
    """Return a fit that was left before its end, and of which nobody asks how sure it is."""
    unknown = np.full((theta.size, theta.size), np.inf)
    return Fit(problem.at(theta), problem.coordinates, theta, cost, unknown, False, sentence)
