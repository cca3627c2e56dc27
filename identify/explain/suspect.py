"""What does every correction of free form promise to first order, the plain parameters moving with it?

Its weights are taken as drawn from one normal distribution whose width the data choose, so that a correction of many
weights has no advantage over one of few (MacKay, Neural Computation 4 (1992) 415). What no correction explains counts
as noise.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import exp, log

import numpy as np
from scipy.stats import chi2 as chi2_distribution

from identify.chain import local_name
from identify.derivatives.sensitivities import DIFFERENCE
from identify.evidence import Evidence
from identify.first_order import Products
from identify.stage import Place
from identify.trace import Array
from identify.unnamed.correction import Correction

WIDTHS = np.geomspace(1e-2, 1e10, 49)  # of the weights' distribution over that at which they could just be seen
LEVEL = 1e-3  # probability of a false alarm, all corrections together
HINT = 0.05  # the same of a hint that something is there
FITTED = 4  # corrections that are fitted; the others are judged to first order
CLOSE = 0.8  # share of the best log likelihood from which another place is fitted
UNTUNED = 0.4  # share of what a law of one frequency explains that is left half of what runs resolve beside it
LARGE = 1000.0  # of chi-squared: a mismatch that leaves first order
PART = 0.15  # of the best promise, from which anything is fitted for a few iterations
MOST = 64  # knots that are fitted
RANK = 1e-9  # eigenvalues of the weights' information below this share of the largest are not told by the data


@dataclass(frozen=True)
class Suspect:
    """A correction to first order: eigenvalues of its weights' information, and the square the data give each.

    ``values`` are all that solves the linear problem, weights and plain parameters, by full name. ``looks`` is the
    log of among how many like it this one was chosen for what it shows.
    """

    correction: Correction
    information: Array
    squares: Array
    values: Mapping[str, float]
    looks: float = 0.0

    @cached_property
    def gain(self) -> float:
        """Return the fall of chi-squared."""
        return float(np.sum(self.squares))

    @property
    def p_value(self) -> float:
        """Return the probability of such a gain from noise alone."""
        once = float(chi2_distribution.logsf(max(self.gain, 0.0), max(self.squares.size, 1)))
        return exp(max(min(self.looks + once, 0.0), -700.0))

    def worth(self, noise: float) -> tuple[float, float]:
        """Return the log of the likelihood ratio to no correction, and the price of the weights that is in it.

        ``noise`` is the variance of what no correction explains, in units of the noise's. The price is all by which
        that log is below what the fall of chi-squared says: weights that the data hardly tell gain by chance, too.
        """
        if not self.squares.size:
            return 0.0, 0.0
        seen = WIDTHS[:, None] * self.information / float(np.max(self.information))
        prices = 0.5 * np.sum(np.log1p(seen), axis=1) + self.looks
        worth = 0.5 * np.sum(self.squares / noise * seen / (1.0 + seen), axis=1) - prices
        best = float(np.max(worth))
        return best, 0.5 * self.gain / noise - best


def is_fine(correction: Correction) -> bool:
    """Return whether a correction is a table over the clock as fine as the data, which is solved and not fitted."""
    return len(correction.knots) > MOST


def unexplained(evidence: Evidence, found: Sequence[Suspect]) -> float:
    """Return the variance of what no correction explains, in units of the noise's, at least one."""
    left = evidence.left - max((s.gain for s in found), default=0.0)
    return max(1.0, left / evidence.residual.size)


def explainable(ranked: Sequence[Suspect]) -> float:
    """Return by how much more than chance a correction lets chi-squared fall; 0 where that may be chance, too."""
    told = [s.gain - s.squares.size for s in ranked if len(ranked) * s.p_value < LEVEL]
    return max(told, default=0.0)


def hinted(ranked: Sequence[Suspect]) -> bool:
    """Return whether any correction lets chi-squared fall by more than noise would now and then."""
    return any(len(ranked) * s.p_value < HINT for s in ranked)


def suspect(evidence: Evidence, correction: Correction) -> Suspect:
    """Return what a correction promises when all its weights and the plain parameters move together."""
    evidence = evidence.seen_by(correction)
    names, products = products_of(evidence, correction)
    kept = np.isfinite(products.energies) & (products.energies > DIFFERENCE**2)
    if not kept.any():
        return Suspect(correction, np.empty(0), np.empty(0), {})
    names, products = [n for n, keep in zip(names, kept, strict=True) if keep], products.of(kept)
    matrix, right = evidence.less_plain(products)
    values, vectors = np.linalg.eigh(matrix)
    seen = values > RANK * values[-1]
    pulls = vectors[:, seen].T @ right
    weights = vectors[:, seen] @ (pulls / values[seen])
    solved = {**moved(evidence, products.mimic @ weights), **dict(zip(names, weights.tolist(), strict=True))}
    looks = log(sum(o.trace.size for o in evidence.observations) // 2) if correction.searched else 0.0
    return Suspect(correction, values[seen], pulls**2 / values[seen], solved, looks)


def moved(evidence: Evidence, made: Array) -> dict[str, float]:
    """Return the values of the fitted parameters, by full name, once they have moved beside a change of the answer.

    ``made`` is what that does along their slopes.
    """
    fit = evidence.fitted
    there = fit.theta + evidence.step(made)
    return {c.name: c.value(c.bounded(float(t))) for t, c in zip(there, fit.coordinates, strict=True)}


def products_of(evidence: Evidence, correction: Correction) -> tuple[list[str], Products]:
    """Return the names of all weights, and the products of what a unit of each changes.

    Where every run has weights of its own, or all of a run hangs on one knot, what a weight changes elsewhere is zero.
    """
    chain, step = correction.put_in(evidence.chain), evidence.observations[0].noise_v
    names = [p.name for p in correction.parameters()]
    ends = [(o.trace.start_s, o.trace.start_s + (o.trace.size - 1) / o.trace.rate_hz) for o in evidence.observations]
    knots = [knot for knot in (correction.only_knot(*run) for run in ends) if knot is not None]
    number = np.arange(len(names))
    if len(knots) == len(ends):  # no run sees the knots of another: those of all are moved at once
        words = np.reshape(names, (-1, len(correction.knots)))
        chains = [chain.with_values(dict.fromkeys(word, step)) for word in words]
        owners = [np.arange(len(words)) * len(correction.knots) + knot for knot in knots]
    else:
        chains = [chain.with_values({name: step}) for name in names]
        owners = [number + i * len(names) if correction.local else number for i in range(len(ends))]
    if correction.local:
        names = [local_name(name, o.trace.name) for o in evidence.observations for name in names]
    return names, evidence.products_by_run(chains, step, owners)


def contenders(ranked: Sequence[Suspect], noise: float) -> list[Suspect]:
    """Return what is worth a fit: of every place the best, and of the best place the second, if close enough.

    A law of one frequency may come close once it is at its own. Beside what may be a disguise the best of the plainer
    form it may be one of.
    """
    worth, least = [s.worth(noise)[0] for s in ranked], [UNTUNED if s.correction.searched else 1.0 for s in ranked]
    close = [s for s, w, part in zip(ranked, worth, least, strict=True) if w > max(CLOSE * part * worth[0], 0.0)]
    first: dict[Place, Suspect] = {}
    for s in close:
        first.setdefault(s.correction.place, s)
    second = [s for s in close if s.correction.place == close[0].correction.place][1:2] if close else []
    found = with_alike(ranked, [*first.values(), *second][:FITTED] if close else list(ranked[:1]))
    plainer = {s.correction.plainly for s in found} - {s.correction.form for s in found}
    return [*found, *(next(s for s in ranked if s.correction.form == form) for form in sorted(plainer - {""}))]


def with_alike(ranked: Sequence[Suspect], chosen: Sequence[Suspect]) -> list[Suspect]:
    """Return what was chosen, and beside a law of one frequency the same at others that promise nearly as much.

    To first order a line in front of the gap does at any frequency most of what it does at its own.
    """
    known = {(s.correction.form, s.correction.place): s.gain for s in chosen if s.correction.searched}
    beside = [s for s in ranked if s.gain > CLOSE * known.get((s.correction.form, s.correction.place), np.inf)]
    return [*chosen, *(s for s in beside if not any(s is one for one in chosen))]


def overlooked(ranked: Sequence[Suspect], fitted: Sequence[Suspect], large: float = LARGE) -> list[Suspect]:
    """Return what promises a part of the best and was not fitted: it may be the law all the same.

    The best of every form at every place; none where the best explains no more than ``large``, in chi-squared.
    """
    most = max(s.gain for s in ranked)
    found: dict[tuple[str, Place], Suspect] = {}
    for s in (s for s in ranked if s.gain > PART * most and not is_fine(s.correction) and most > large):
        found.setdefault((s.correction.form, s.correction.place), s)
    known = {(s.correction.form, s.correction.place) for s in fitted if not is_fine(s.correction)}
    return with_alike(ranked, [s for key, s in found.items() if key not in known])
