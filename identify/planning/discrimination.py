"""How sharply would a stimulus tell two fitted hypotheses apart?

If one of them is true, the other cannot follow the new readings where the answers of the two differ; but its parameters
would move to follow as far as what was recorded before lets them. With d the difference of the answers over the noise,
J the slopes of the false hypothesis and M its information so far, chi-squared is expected to rise by

    z^2 = d'd - (J'd)' (M + J'J)^-1 (J'd)

to first order: what is left of the difference once the false hypothesis is refitted to old and new data together. The
three sums add up over stimuli, so a protocol is weighed from its parts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import floor, sqrt

import numpy as np
from numpy.typing import NDArray

from identify.chain import simulate
from identify.coordinate import Coordinate, coordinates_of
from identify.derivatives.sensitivities import sensitivities
from identify.fit import Fit
from identify.observe import FINEST, Observation
from identify.quadratic import inverse
from identify.trace import Array, Trace

Matrix = NDArray[np.float64]
Pair = tuple[int, int]  # numbers of the true and of the false hypothesis

RUN = "follow-up"
ENOUGH = 12.0  # standard deviations from which a set is decided: Schwarz's price of more parameters and chance included
LEAST = 3.0  # standard deviations below which two hypotheses are not expected to be told apart
IDLE = 0.02  # share of ENOUGH that the time left must still promise
DOUBTFUL = 0.1  # share of z^2 that what even the finest grid leaves out of an answer may make
MOST_STEPS = 6
MOST_REPEATS = 40


@dataclass(frozen=True)
class Rival:
    """A fitted hypothesis, its probability, and its information from what was recorded so far, shape (p, p)."""

    fit: Fit
    probability: float
    coordinates: tuple[Coordinate, ...]
    known: Matrix


@dataclass(frozen=True)
class Sums:
    """What some readings tell the hypotheses apart by: d'd and J'd of every pair, J'J of every false hypothesis."""

    energy: Mapping[Pair, float]
    pull: Mapping[Pair, Array]
    matrix: Mapping[int, Matrix]

    def plus(self, other: "Sums", times: float = 1.0) -> "Sums":
        """Return the sums of these readings and of ``times`` as many others."""
        return Sums(
            {pair: value + times * other.energy[pair] for pair, value in self.energy.items()},
            {pair: value + times * other.pull[pair] for pair, value in self.pull.items()},
            {number: value + times * other.matrix[number] for number, value in self.matrix.items()},
        )

    def sharpness(self, rivals: Sequence[Rival]) -> dict[Pair, float]:
        """Return z of every pair: by how many standard deviations the false one is expected to be ruled out."""
        wide = {number: inverse(rivals[number].known + matrix) for number, matrix in self.matrix.items()}
        left = {pair: self.energy[pair] - float(pull @ wide[pair[1]] @ pull) for pair, pull in self.pull.items()}
        return {pair: sqrt(max(value, 0.0)) for pair, value in left.items()}


def rival(fit: Fit, probability: float, fixed: Sequence[str]) -> Rival:
    """Return a hypothesis ready for a run to come, in which what single runs have of their own is unknown."""
    coordinates = coordinates_of(fit.chain, fit.chain.values, [RUN], fixed)
    known = np.diag([c.prior_sd**-2.0 for c in coordinates])
    before = {c.name: k for k, c in enumerate(fit.coordinates)}
    shared = [k for k, c in enumerate(coordinates) if c.name in before]
    old = [before[coordinates[k].name] for k in shared]
    known[np.ix_(shared, shared)] = inverse(fit.covariance[np.ix_(old, old)])
    return Rival(fit, probability, coordinates, known)


def answers(rivals: Sequence[Rival], u: Array, rate_hz: float, substeps: int = 1) -> list[Array]:
    """Return what every hypothesis answers to ``u`` from rest, V."""
    return [simulate(one.fit.chain, _silent(u, rate_hz), substeps) for one in rivals]


def difference(readings: Sequence[Array], noise_v: float) -> dict[Pair, float]:
    """Return d'd of every two hypotheses: what tells them apart at most, were nothing refitted."""
    count = len(readings)
    return {
        (a, b): float(np.sum(np.square((readings[a] - readings[b]) / noise_v)))
        for a in range(count) for b in range(count) if a != b
    }  # fmt: skip


def told(rivals: Sequence[Rival], u: Array, rate_hz: float, noise_v: float, substeps: int = 1) -> Sums:
    """Return what the readings of ``u``, played from rest, tell the hypotheses apart by.

    The slopes, which only have to be about right, are taken on a grid of ``substeps``.
    """
    trace = _silent(u, rate_hz)
    readings = answers(rivals, u, rate_hz, FINEST)
    pulls: dict[Pair, Array] = {}
    matrices: dict[int, Matrix] = {}
    for b, false in enumerate(rivals):
        scales = {c.name: c.slope(0.0) for c in false.coordinates}
        seen = Observation(trace, np.ones(u.size, dtype=bool), noise_v, substeps)
        slopes = sensitivities(false.fit.chain, scales, seen).slopes()
        matrices[b] = slopes @ slopes.T
        for a, reading in enumerate(readings):
            if a != b:
                pulls[a, b] = slopes @ ((reading - readings[b]) / noise_v)
    return Sums(difference(readings, noise_v), pulls, matrices)


def trusted(rivals: Sequence[Rival], sums: Sums, u: Array, rate_hz: float, noise_v: float) -> bool:
    """Return whether what ``u`` tells is the hypotheses' own: not what a simulation in steps leaves out of them."""
    coarse, fine = (answers(rivals, u, rate_hz, n) for n in (FINEST, 4 * FINEST))
    worst = max(float(np.sum(np.square((a - b) / noise_v))) for a, b in zip(coarse, fine, strict=True))
    return worst <= max(DOUBTFUL * min(sums.sharpness(rivals).values()) ** 2, DOUBTFUL)


def _silent(u: Array, rate_hz: float) -> Trace:
    return Trace(RUN, rate_hz, u, np.broadcast_to(0.0, u.shape))


@dataclass(frozen=True)
class Choice:
    """How often every stimulus is played, and how sharply all of it tells every pair apart."""

    repeats: tuple[int, ...]
    sharpness: Mapping[Pair, float]


def chosen(rivals: Sequence[Rival], sums: Sequence[Sums], times_s: Sequence[float], time_s: float) -> Choice:
    """Return the stimuli that decide soonest, each added where it promises most per second, until time is up.

    What counts is the mean sharpness over all pairs, each weighed by the probabilities of both, up to ``ENOUGH``.
    """
    counts = [0] * len(sums)
    whole = _nothing(sums[0])
    promise = _promise(rivals, whole)
    while promise < ENOUGH * (1.0 - 1e-9):
        options = {}
        for k, one in enumerate(sums):
            fresh = counts[k] == 0 and sum(map(bool, counts)) >= MOST_STEPS
            if not fresh and counts[k] < MOST_REPEATS and times_s[k] <= time_s:
                options[k] = (_promise(rivals, whole.plus(one)) - promise) / times_s[k]
        best = max(options, key=lambda k: options[k], default=None)
        if best is None or options[best] * time_s < IDLE * ENOUGH:
            break
        counts[best] += 1
        time_s -= times_s[best]
        whole = whole.plus(sums[best])
        promise = _promise(rivals, whole)
    return Choice(tuple(counts), whole.sharpness(rivals))


def of_every_kind(
    rivals: Sequence[Rival], sums: Sequence[Sums], kinds: Sequence[str], times_s: Sequence[float], time_s: float
) -> Choice:
    """Return of every kind of stimulus the one that tells most, none longer than its share of the time.

    Where the hypotheses are only near the truth, what they promise says little of how the truth will differ from each:
    what is new to all of them does. Each is played once, or as often as there is time where that promises too little.
    """
    counts = [0] * len(sums)
    share_s = time_s / len(set(kinds))
    short = [k for k in range(len(sums)) if times_s[k] <= share_s]
    promises = {k: _promise(rivals, sums[k]) for k in short}
    for kind in {kinds[k] for k in short}:
        counts[max((k for k in short if kinds[k] == kind), key=lambda k: promises[k])] = 1
    if _promise(rivals, _whole(sums, counts)) < ENOUGH:
        counts = [n * min(floor(share_s / times_s[k]), MOST_REPEATS) if n else 0 for k, n in enumerate(counts)]
    return Choice(tuple(counts), _whole(sums, counts).sharpness(rivals))


def _whole(sums: Sequence[Sums], counts: Sequence[int]) -> Sums:
    """Return what stimuli tell together, each played so often."""
    whole = _nothing(sums[0])
    for one, n in zip(sums, counts, strict=True):
        whole = whole.plus(one, n)
    return whole


def _promise(rivals: Sequence[Rival], sums: Sums) -> float:
    """Return the mean sharpness, weighed by how likely it is that a pair has to be told apart."""
    z = sums.sharpness(rivals)
    weights = {(a, b): rivals[a].probability * rivals[b].probability for a, b in z}
    total = sum(weights.values())
    return sum(weights[pair] * min(value, ENOUGH) for pair, value in z.items()) / total


def _nothing(like: Sums) -> Sums:
    return like.plus(like, -1.0)


def spread(gains: Sequence[float], kinds: Sequence[str], most: int) -> list[int]:
    """Return the numbers of the stimuli that promise most, as many of every kind."""
    share = max(floor(most / max(len(set(kinds)), 1)), 1)
    found: list[int] = []
    for kind in dict.fromkeys(kinds):
        of_kind = [k for k, other in enumerate(kinds) if other == kind]
        found += sorted(of_kind, key=lambda k: -gains[k])[:share]
    return sorted(found)
