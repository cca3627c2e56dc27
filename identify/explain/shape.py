"""What does unnamed physics look like: how much does it add along its own coordinate, and how sure is that?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain, signals
from identify.fit import Fit
from identify.interval import number
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.drawn import Drawn
from identify.unnamed.linear import Filter
from identify.unnamed.maps import LEVELS, BrokenMap, LevelMap, spline
from identify.unnamed.memory import BorderMap

POINTS = 81
SURE = 1.96  # standard deviations of a 95 % interval
VISITED = 1e-3  # share of the samples below which the ends of a level are not drawn

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Shape:
    """Curves along a coordinate with their 95 % bands, shape (points,) each; ``values`` says what they are of.

    ``names`` tell several curves apart; one curve has no name.
    """

    axis: str
    unit: str
    values: str
    value_unit: str
    at: Array
    names: tuple[str, ...]
    curves: tuple[Array, ...]
    halves: tuple[Array, ...]

    def to_dict(self) -> dict[str, object]:
        """Return plain numbers, for JSON."""
        return {
            "axis": self.axis, "unit": self.unit, "of": self.values, "value_unit": self.value_unit,
            "at": [number(float(x), 5) for x in self.at],
            "curves": [
                {"name": name or None, "value": [number(float(y), 4) for y in curve],
                 "half95": [number(float(h), 3) for h in half]}
                for name, curve, half in zip(self.names, self.curves, self.halves, strict=True)
            ],
        }  # fmt: skip


def shape_of(correction: Correction, fit: Fit, observations: Sequence[Observation]) -> Shape | None:
    """Return what a fitted correction adds; None where no curve shows it."""
    if isinstance(correction, Filter):
        return _response(correction, fit)
    if not correction.curved:
        return None
    if isinstance(correction, BrokenMap):
        return _of_corners(correction, fit, observations)
    if isinstance(correction, LevelMap | BorderMap | Drawn):
        return _of_levels(correction, fit, observations)
    at = np.linspace(correction.knots[0], correction.knots[-1], POINTS)
    rows = np.array([np.interp(at, correction.knots, one) for one in np.eye(len(correction.knots))]).T
    return _drawn(correction, fit, at, rows)


def _of_levels(correction: Correction, fit: Fit, observations: Sequence[Observation]) -> Shape:
    """Return the curves of a map of levels, less the straight line that F could have instead."""
    place = Place.G1 if isinstance(correction, BorderMap) else correction.place
    at, weights = _visited(correction, place, fit, observations)
    unit = np.eye(len(correction.knots))[:, [i - 1 for i in correction.numbers]]
    rows = np.array([_along(correction.knots, unit[:, j], at) for j in range(unit.shape[1])]).T
    return _drawn(correction, fit, at, _without_line(at, weights) @ rows)


def _of_corners(correction: BrokenMap, fit: Fit, observations: Sequence[Observation]) -> Shape:
    """Return the curve of a law with corners, less the straight line that F could have instead."""
    at, weights = _visited(correction, correction.place, fit, observations)
    rows = _without_line(at, weights) @ correction.shapes(at).T
    value, covariance = _weights(fit, [p.name for p in correction.parameters()])
    half = SURE * np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", rows, covariance, rows), 0.0))
    return Shape(correction.axis, correction.knot_unit, "added", "V", at, ("",), (np.asarray(rows @ value),), (half,))


def _visited(
    correction: Correction, place: Place, fit: Fit, observations: Sequence[Observation]
) -> tuple[Array, Array]:
    """Return levels over the range that a signal visits, V, and how often it is near each."""
    visits = np.concatenate([_entering(correction, place, fit.chain, o)[o.use] for o in observations])
    low, high = np.quantile(visits, (VISITED, 1.0 - VISITED))
    at = np.linspace(float(low), float(high), POINTS)
    return at, np.histogram(visits, POINTS, (float(low), float(high)))[0].astype(np.float64) + 1.0


def _entering(correction: Correction, place: Place, chain: Chain, observation: Observation) -> Array:
    """Return the signal that a map is a law of, V, shape (N,)."""
    taps = signals(chain, observation.trace)
    own = [i for i, stage in enumerate(chain.stages) if stage == correction]
    return taps[own[0] - 1 if own else chain.index(place) - 1]


def _along(knots: tuple[float, ...], values: Array, at: Array) -> Array:
    """Return a spline at levels ``at``."""
    rows, step = spline(knots, values), knots[1] - knots[0]
    piece = np.clip(((at - knots[0]) / step).astype(int), 0, len(knots) - 1)
    t = at - (knots[0] + piece * step)
    return np.asarray(sum(rows[piece, k] * t**k for k in range(4)))


def _without_line(at: Array, weights: Array) -> Matrix:
    """Return the matrix that takes from a curve its straight line, fitted where the signal has been."""
    line = np.column_stack((np.ones_like(at), at))
    fitted = np.linalg.solve((line * weights[:, None]).T @ line, (line * weights[:, None]).T)
    return np.asarray(np.eye(at.size) - line @ fitted)


def _drawn(correction: Correction, fit: Fit, at: Array, rows: Matrix) -> Shape:
    """Return the curves whose points are ``rows`` times the weights of each word."""
    names = ("border L", "border U") if isinstance(correction, BorderMap) else ("",) * len(correction.weights)
    curves, halves = [], []
    for word, _ in correction.weights:
        value, covariance = _weights(fit, [f"{correction.name}.{word}{i}" for i in correction.numbers])
        curves.append(np.asarray(rows @ value))
        halves.append(SURE * np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", rows, covariance, rows), 0.0)))
    unit = correction.weights[0][1]
    axis = LEVELS[Place.G1] if isinstance(correction, BorderMap) else correction.axis
    what = "drawn" if isinstance(correction, Drawn) else "added"
    return Shape(axis, correction.knot_unit, what, unit, at, names, tuple(curves), tuple(halves))


def _response(correction: Filter, fit: Fit) -> Shape:
    """Return by what factor a filter changes the size of a sine, over frequency."""
    names = [p.name for p in correction.parameters()]
    value, covariance = _weights(fit, names)
    at = np.geomspace(0.03 / max(correction.knots), 1.0 / min(correction.knots), POINTS) / (2.0 * np.pi)
    rows = correction.responses(at).T
    total = 1.0 + rows @ value
    slopes = np.real(np.conj(total)[:, None] * rows) / np.abs(total)[:, None]
    half = SURE * np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", slopes, covariance, slopes), 0.0))
    return Shape("frequency", "Hz", "gain", "V/V", at, ("",), (np.abs(total),), (half,))


def _weights(fit: Fit, names: Sequence[str]) -> tuple[Array, Matrix]:
    """Return the fitted weights and their covariance; one that was not searched is known."""
    index = {c.name: i for i, c in enumerate(fit.coordinates)}
    value = np.array([fit.chain.values[name] for name in names])
    covariance = np.zeros((value.size, value.size))
    seen = [j for j, name in enumerate(names) if name in index]
    at = [index[names[j]] for j in seen]
    slopes = np.array([fit.coordinates[i].slope(float(fit.theta[i])) for i in at])
    covariance[np.ix_(seen, seen)] = fit.covariance[np.ix_(at, at)] * np.outer(slopes, slopes)
    return value, covariance
