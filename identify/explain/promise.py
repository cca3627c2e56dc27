"""How far does chi-squared fall at the best value of an effect, while the plain parameters move to first order?

The effect's own parameters take Gauss-Newton steps; the plain ones are projected out (variable projection: Golub and
Pereyra, SIAM J. Numer. Anal. 10 (1973) 413). Where an effect is small this is its fit; where it is large, its start.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.linalg import LinAlgError

from identify.candidates import Candidate
from identify.chain import Chain
from identify.coordinate import Coordinate, coordinates_of
from identify.derivatives.sensitivities import DIFFERENCE
from identify.discretise import Matrix
from identify.evidence import Evidence
from identify.fit import HALVED
from identify.quadratic import boxed_step
from identify.stage import Place
from identify.taps import Taps
from identify.trace import Array

STEPS = 3
WIDEST = 1.0  # a step of a value searched in its log, at most
ENOUGH = 0.3  # of chi-squared: a step that gains less is the last
SHORTER = 0.25
STEADY = 3.0  # times what the last step gained that further ones may gain
UNSURE = 2.0  # times the error of the first order: by as much a fit may differ
PAIRS = 3  # of promises that are kept
ALIKE = 1e-6  # share of the information of two below which they are one
STEPPED = 0.005  # of a fall: by as much the samples' own grid, on which effects are compared here, may mistake it


@dataclass(frozen=True)
class Promise:
    """A candidate at its best values: its chain with the plain parameters moved, too, and the fall of chi-squared.

    ``slack`` is by how much a fit may differ: by what the fall was mistaken where the plain parameters were moved, by
    what more steps would gain, and by what a finer grid would change.
    """

    candidate: Candidate
    chain: Chain
    gain: float
    slack: float = 0.0


@dataclass(frozen=True)
class Pair:
    """Two promises, and the fall of chi-squared they make together."""

    one: Promise
    other: Promise
    gain: float


def promised(evidence: Evidence, candidate: Candidate) -> Promise:
    """Return a candidate at the values that gain most to first order in the plain parameters."""
    evidence = evidence.seen_by(candidate.effect)
    chain = candidate.effect.put_in(evidence.chain, candidate.values)
    change = evidence.change(chain)
    gain, risen = evidence.gained(change), 0.0
    for _ in range(STEPS):
        coordinates = _own(evidence, chain)
        better = _stepped(evidence, chain, coordinates, change, gain) if coordinates else None
        if better is None:
            risen = 0.0
            break
        risen, (chain, change, gain) = better[2] - gain, better
        if risen < ENOUGH:
            break
    there = evidence.followed(chain, change)
    kept = evidence.change(there)
    fallen = float(kept @ (2.0 * evidence.residual - kept))
    slack = abs(gain - fallen) if np.isfinite(fallen) else float("inf")
    return Promise(candidate, there, gain, UNSURE * slack + STEADY * risen + STEPPED * max(gain, 0.0))


def together(evidence: Evidence, promises: Sequence[Promise]) -> tuple[Pair, ...]:
    """Return the two promises that let chi-squared fall most together, each in proportion to its change, best first.

    No first of two need be the best law alone: neither has to stand in for the other where both are there. Of the
    forms of two effects the best is returned.
    """
    fine = evidence.fine
    products = fine.products_of(fine.changes([p.chain.with_values(fine.chain.values) for p in promises]))
    finite = np.isfinite(products.energies)
    kept = [p for p, keep in zip(promises, finite, strict=True) if keep]
    matrix, right = fine.less_plain(products.of(finite))
    found = []
    for at in combinations(range(len(kept)), 2):
        one, other = (kept[i] for i in at)
        sizes = np.linalg.pinv(matrix[np.ix_(at, at)], rcond=ALIKE, hermitian=True) @ right[list(at)]
        if one.candidate.effect.id != other.candidate.effect.id and np.all(sizes > 0.0):
            found.append(Pair(one, other, float(right[list(at)] @ sizes)))
    best: dict[frozenset[tuple[str, Place]], Pair] = {}
    for pair in sorted(found, key=lambda pair: -pair.gain):
        laws = (promise.candidate.effect for promise in (pair.one, pair.other))
        best.setdefault(frozenset((law.id, law.place) for law in laws), pair)
    return tuple(best.values())[:PAIRS]


def _own(evidence: Evidence, chain: Chain) -> tuple[Coordinate, ...]:
    """Return the coordinates of a chain's parameters that the fitted chain does not have."""
    runs = [o.trace.name for o in evidence.observations]
    plain = [p.name for p in evidence.chain.parameters()]
    return coordinates_of(chain, chain.values, runs, plain)


def _stepped(
    evidence: Evidence, chain: Chain, coordinates: Sequence[Coordinate], change: Array, gain: float
) -> tuple[Chain, Array, float] | None:
    """Return the chain one step further with its change and gain; None where no step gains."""
    try:
        rows = _slopes(evidence, chain, coordinates)
        matrix, right = evidence.normal_of(rows, change)
        widest = np.array([WIDEST if c.parameter.coordinate == "log" else np.inf for c in coordinates])
        prior = np.array([c.prior_sd**-2.0 for c in coordinates])
        step = boxed_step(matrix + np.diag(prior), right, -widest, widest)
    except (ValueError, LinAlgError):
        return None
    for length in (1.0, SHORTER):
        there = _moved(chain, coordinates, length * step)
        moved = evidence.change(there)
        reached = evidence.gained(moved)
        if reached > gain:
            return there, moved, reached
    return None


def _moved(chain: Chain, coordinates: Sequence[Coordinate], step: Array) -> Chain:
    """Return the chain a step further; values searched in their log move straight, but not through zero."""
    values = {}
    for coordinate, by in zip(coordinates, step.tolist(), strict=True):
        log = coordinate.parameter.coordinate == "log"
        values[coordinate.name] = coordinate.value(coordinate.bounded(float(np.log1p(max(by, HALVED))) if log else by))
    return chain.with_values(values)


def _slopes(evidence: Evidence, chain: Chain, coordinates: Sequence[Coordinate]) -> Matrix:
    """Return the change of the answer per coordinate, in units of the noise, shape (d, n), by differences."""
    varied = [chain.with_values({c.name: c.value(DIFFERENCE)}) for c in coordinates]
    return Taps(chain, evidence.observations).changes(varied, DIFFERENCE)
