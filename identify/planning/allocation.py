"""How long should every stimulus be played so that the intervals become smallest?

The criterion is the weighted mean, over rigs and quantities, of the log of the relative standard error: half a log of
g' M^-1 g each, convex in the times. Its optimum is approached by the multiplicative algorithm (Titterington, 1976;
Silvey, Titterington and Torsney, 1978), which here reads: give every stimulus the share of time that is its mean share
in the estimates. What is hardly used is then left out, and the rest rounded to whole repetitions by exchange.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array

Matrix = NDArray[np.float64]
Counts = NDArray[np.int64]
SWEEPS = 400
LOSS = 0.01  # of the mean logarithm, given up for a protocol of fewer steps
MOST_STEPS = 8
EXCHANGES = 200


@dataclass(frozen=True)
class Choice:
    """Stimuli to choose from: the information of one repetition of each about each rig, and what is asked for.

    ``matrices`` (rigs, stimuli, p, p); ``slopes`` (rigs, quantities, p) over the sizes; ``weights`` (rigs, quantities),
    adding up to one; ``prior`` (p, p); ``times_s`` of one repetition, shape (stimuli,).
    """

    matrices: Matrix
    slopes: Matrix
    weights: Matrix
    prior: Matrix
    times_s: Array

    def score(self, counts: Array | Counts) -> float:
        """Return the weighted mean log of the relative standard errors after ``counts`` repetitions of each."""
        _, variances = self._along(counts)
        return float(0.5 * np.sum(self.weights * np.log(variances)))

    def shares(self, counts: Array) -> Array:
        """Return the mean share of every stimulus in the estimates, shape (stimuli,)."""
        along, variances = self._along(counts)
        parts = np.einsum("rqi,rcij,rqj->rqc", along, self.matrices, along, optimize=True)
        return np.asarray(counts * np.einsum("rq,rqc->c", self.weights / variances, parts))

    def _along(self, counts: Array | Counts) -> tuple[Matrix, Matrix]:
        """Return C g, shape (rigs, quantities, p), and g' C g, shape (rigs, quantities)."""
        whole = self.prior + np.einsum("c,rcij->rij", counts, self.matrices)
        scale = 1.0 / np.sqrt(np.einsum("rii->ri", whole))
        inverse = np.linalg.pinv(whole * scale[:, :, None] * scale[:, None, :], rcond=1e-14, hermitian=True)
        covariance = inverse * scale[:, :, None] * scale[:, None, :]
        along = np.einsum("rij,rqj->rqi", covariance, self.slopes)
        return along, np.einsum("rqi,rqi->rq", along, self.slopes)

    def part(self, chosen: NDArray[np.bool_]) -> "Choice":
        """Return the choice among fewer stimuli."""
        return replace(self, matrices=self.matrices[:, chosen], times_s=self.times_s[chosen])


def spread(choice: Choice, time_s: float, sweeps: int = SWEEPS, start: Array | None = None) -> Array:
    """Return the shares of ``time_s`` that make the criterion smallest, shape (stimuli,), adding up to one."""
    weights = np.full(choice.times_s.size, 1.0 / choice.times_s.size) if start is None else start / np.sum(start)
    for _ in range(sweeps):
        weights = choice.shares(weights * time_s / choice.times_s)
        weights = weights / np.sum(weights)
    return weights


def thinned(choice: Choice, time_s: float, kept: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which stimuli to play: few of them, for a loss that is small; those ``kept`` stay."""
    weights = spread(choice, time_s)
    best = choice.score(weights * time_s / choice.times_s)
    chosen = (weights > 1e-3) | kept
    while np.count_nonzero(chosen) > 2:
        weights[~chosen] = 0.0
        fewer = chosen & ~_least(weights, chosen & ~kept)
        if np.array_equal(fewer, chosen):
            break
        part = choice.part(fewer)
        inside = spread(part, time_s, SWEEPS // 4, np.maximum(weights[fewer], 1e-3))
        loss = part.score(inside * time_s / part.times_s) - best
        if loss > LOSS and np.count_nonzero(chosen) <= MOST_STEPS:
            break
        chosen = fewer
        weights[fewer] = inside
    return chosen


def _least(weights: Array, among: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return a mask of the smallest weight among some; empty when there are none."""
    mask = np.zeros(weights.size, dtype=bool)
    if among.any():
        mask[np.flatnonzero(among)[np.argmin(weights[among])]] = True
    return mask


def whole(choice: Choice, time_s: float, least: Counts) -> Counts:
    """Return whole repetitions, at least ``least`` of each, that together fit ``time_s``."""
    weights = spread(choice, time_s)
    counts = np.maximum(np.floor(weights * time_s / choice.times_s).astype(np.int64), least)
    while counts @ choice.times_s > time_s and np.any(counts > least):
        spare = np.where(counts > least, counts * choice.times_s, -np.inf)
        counts[np.argmax(spare)] -= 1
    return _exchanged(choice, time_s, _filled(choice, time_s, counts), least)


def _filled(choice: Choice, time_s: float, counts: Counts) -> Counts:
    """Return the counts with whatever still fits, best gain a second first."""
    while True:
        here, left = choice.score(counts), time_s - counts @ choice.times_s
        gains = [
            (here - choice.score(counts + one)) / t if t <= left * (1.0 + 1e-12) else -np.inf
            for one, t in zip(np.eye(counts.size, dtype=np.int64), choice.times_s, strict=True)
        ]
        if not max(gains, default=-np.inf) > 0.0:
            return counts
        counts = counts + np.eye(counts.size, dtype=np.int64)[int(np.argmax(gains))]


def _exchanged(choice: Choice, time_s: float, counts: Counts, least: Counts) -> Counts:
    """Return the counts after giving up a repetition of one stimulus for another as long as that pays."""
    ones = np.eye(counts.size, dtype=np.int64)
    for _ in range(EXCHANGES):
        here, tried = choice.score(counts), [counts]
        for less in ones[counts > least]:
            given = [counts - less + more for more in ones if (counts - less + more) @ choice.times_s <= time_s]
            tried += [_filled(choice, time_s, moved) for moved in (counts - less, *given)]
        best = min(tried, key=choice.score)
        if choice.score(best) >= here - 1e-9:
            break
        counts = best
    return counts
