"""At which stage, and along which coordinate, does what the chain cannot explain enter?

Every correction is judged on the residual to first order, the plain parameters moving with it. Its weights are taken
as drawn from one normal distribution whose width the data choose, so that a correction of many weights has no advantage
over one of few (MacKay, Neural Computation 4 (1992) 415). What no correction explains counts as noise. The best of
every place is then fitted, because a large mismatch is not linear.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import exp

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2 as chi2_distribution

from identify.chain import local_name
from identify.derivatives.sensitivities import DIFFERENCE
from identify.evidence import Evidence
from identify.explain.bench import Bench
from identify.explain.corrections import corrections, sharpened
from identify.explain.hypothesis import Hypothesis
from identify.explain.wander import all_wanders, wandering
from identify.fit import chi_squared
from identify.stage import Place
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.linear import SlowFilter

ITERATIONS = 8  # a correction is nearly linear in its weights
FITTED = 4  # corrections that are fitted; the others are judged to first order
WIDTHS = np.geomspace(1e-2, 1e10, 49)  # of the weights' distribution over that at which they could just be seen
LEVEL = 1e-3  # probability of a false alarm, all corrections together
CLOSE = 0.9  # share of the best log likelihood from which another place is fitted
NEAR = 1.5  # times the best sum of squares, up to which a search cut short is ended
KNOWN = 10.0  # over the root of the samples: misfit that a correction of the right kind may leave
LAWLESS = 6  # power of the ratio of what two corrections leave that gives their odds where neither is the law
MOST = 64  # knots that are fitted
RANK = 1e-9  # eigenvalues of the weights' information below this share of the largest are not told by the data
LIKELY = 0.05  # posterior probability from which a place is mentioned beside the best
TEMPER = 0.05  # of a log likelihood: corrections are families near the truth, not the truth


@dataclass(frozen=True)
class Suspect:
    """A correction to first order: eigenvalues of its weights' information, and the square the data give each.

    ``values`` are all that solves the linear problem, weights and plain parameters, by full name. ``looks`` is among
    how many like it this one was chosen for what it shows.
    """

    correction: Correction
    information: Array
    squares: Array
    values: Mapping[str, float]
    looks: int = 1

    @cached_property
    def gain(self) -> float:
        """Return the fall of chi-squared."""
        return float(np.sum(self.squares))

    @property
    def p_value(self) -> float:
        """Return the probability of such a gain from noise alone."""
        once = float(chi2_distribution.sf(max(self.gain, 0.0), max(self.squares.size, 1)))
        return min(self.looks * once, 1.0)

    def worth(self, noise: float) -> tuple[float, float]:
        """Return the log of the likelihood ratio to no correction, and the price of the weights that is in it.

        ``noise`` is the variance of what no correction explains, in units of the noise's.
        """
        if not self.squares.size:
            return 0.0, 0.0
        seen = WIDTHS[:, None] * self.information / float(np.max(self.information))
        prices = 0.5 * np.sum(np.log1p(seen), axis=1) + np.log(self.looks)
        worth = 0.5 * np.sum(self.squares / noise * seen / (1.0 + seen), axis=1) - prices
        best = int(np.argmax(worth))
        return float(worth[best]), float(prices[best])


@dataclass(frozen=True)
class Located:
    """The corrections that explain most, fitted, best first, and the misfit without them.

    ``prices`` are what the weights of each cost, as logs of likelihoods; ``promised`` is the share of the misfit that
    the best correction of every place promises to first order.
    """

    base: Hypothesis
    fitted: tuple[tuple[Correction, Hypothesis], ...]
    p_value: float
    prices: tuple[float, ...] = ()
    promised: Mapping[Place, float] = field(default_factory=dict)

    @property
    def significant(self) -> bool:
        """Return whether something is there that noise does not make."""
        return bool(self.fitted) and self.p_value < LEVEL

    @property
    def best(self) -> Correction:
        """Return the correction that explains most."""
        return self.fitted[0][0]

    @property
    def share(self) -> float:
        """Return which share of the misfit the best correction explains."""
        return self.fitted[0][1].share(self.base)

    @cached_property
    def places(self) -> dict[Place, float]:
        """Return the posterior probability of every place that was fitted, the likeliest first."""
        worth = scores(self.base, [h for _, h in self.fitted], self.prices)
        left = [max(h.misfit, KNOWN / h.count**0.5) for _, h in self.fitted]
        found: dict[Place, float] = {}
        for (correction, _), score, misfit in zip(self.fitted, worth, left, strict=True):
            odds = max(exp(max(TEMPER * (score - max(worth)), -700.0)), (left[0] / max(misfit, left[0])) ** LAWLESS)
            for place in correction.same_at:
                found[place] = max(found.get(place, 0.0), odds)
        total = sum(found.values())
        return dict(sorted(((place, odds / total) for place, odds in found.items()), key=lambda item: -item[1]))

    def alternatives(self) -> tuple[Place, ...]:
        """Return the other places the data do not exclude."""
        return tuple(place for place, p in self.places.items() if p > LIKELY and place != self.best.place)

    def share_at(self, place: Place) -> float:
        """Return the share of the misfit that the best correction at a place explains, to first order if not fitted."""
        shares = [h.share(self.base) for c, h in self.fitted if c.place == place]
        return max(shares, default=self.promised.get(place, 0.0))


def scores(base: Hypothesis, fitted: Sequence[Hypothesis], prices: Sequence[float]) -> list[float]:
    """Return the log of the likelihood ratio of every fitted correction to none."""
    noise = max(1.0, min((h.chi2 / h.count for h in fitted), default=1.0))
    return [0.5 * (base.chi2 - h.chi2) / noise - price for h, price in zip(fitted, prices, strict=True)]


def suspects(evidence: Evidence) -> list[Suspect]:
    """Return every correction with its promise to first order, the likeliest first."""
    found = [_placed(suspect(evidence, correction)) for correction in corrections(evidence)]
    found += [Suspect(one, np.ones(squares.size), squares, values) for one, squares, values in wandering(evidence.fine)]
    noise = unexplained(evidence, found)
    return sorted(found, key=lambda s: -s.worth(noise)[0])


def unexplained(evidence: Evidence, found: Sequence[Suspect]) -> float:
    """Return the variance of what no correction explains, in units of the noise's, at least one."""
    left = evidence.left - max((s.gain for s in found), default=0.0)
    return max(1.0, left / evidence.residual.size)


def suspect(evidence: Evidence, correction: Correction) -> Suspect:
    """Return what a correction promises when all its weights and the plain parameters move together."""
    evidence = evidence.seen_by(correction)
    names, columns = _columns(evidence, correction)
    largest = np.maximum(columns.max(axis=1), -columns.min(axis=1))  # NaN where any is
    kept = (largest > DIFFERENCE) & np.isfinite(largest)
    if not kept.any():
        return Suspect(correction, np.empty(0), np.empty(0), {})
    if not kept.all():
        names, columns = [n for n, keep in zip(names, kept, strict=True) if keep], columns[kept]
    matrix, right = evidence.normal_of(columns)
    values, vectors = np.linalg.eigh(matrix)
    seen = values > RANK * values[-1]
    pulls = vectors[:, seen].T @ right
    weights = vectors[:, seen] @ (pulls / values[seen])
    moved = _moved(evidence, evidence.residual - weights @ columns)
    solved = {**moved, **dict(zip(names, weights.tolist(), strict=True))}
    looks = sum(o.trace.size for o in evidence.observations) // 2 if correction.searched else 1
    return Suspect(correction, values[seen], pulls**2 / values[seen], solved, looks)


def _moved(evidence: Evidence, residual: Array) -> dict[str, float]:
    """Return the values of the fitted parameters, by full name, once they have moved to explain a residual."""
    fit = evidence.fitted
    there = fit.theta + evidence.step(residual)
    return {c.name: c.value(c.bounded(float(t))) for t, c in zip(there, fit.coordinates, strict=True)}


def _columns(evidence: Evidence, correction: Correction) -> tuple[list[str], NDArray[np.float64]]:
    """Return the names of all weights, and the change of the answer by a unit of each, in units of the noise."""
    chain, step = correction.put_in(evidence.chain), evidence.observations[0].noise_v
    names = [p.name for p in correction.parameters()]
    columns = np.array([evidence.change(chain.with_values({name: step})) for name in names]) / step
    if not correction.local:
        return names, columns
    runs = [o.trace.name for o in evidence.observations]
    each = [np.where(mask, columns, 0.0) for mask in evidence.masks]
    return [local_name(name, run) for run in runs for name in names], np.concatenate(each)


def _placed(found: Suspect) -> Suspect:
    """Return a slow filter behind F at the stage whose physics does what it does, which no data can tell.

    What goes on in the direction of a step is the creep of a capacitor that holds, what sags back is a coupling.
    """
    if found.correction.form != SlowFilter.form or found.correction.place != Place.SENSE:
        return found
    creeps = sum(found.values.get(p.name, 0.0) for p in found.correction.parameters()) < 0.0
    return replace(found, correction=replace(found.correction, place=Place.F)) if creeps else found


def located(bench: Bench, base: Hypothesis) -> Located:
    """Fit the corrections that promise most on top of a hypothesis, the best of each of several places.

    None where all that is left may be what its own effects do by chance.
    """
    if all_wanders(base, bench.observations):
        return Located(base, (), 1.0)
    evidence = bench.evidence(base)
    ranked = suspects(evidence)
    p_value = min(min((len(ranked) * s.p_value for s in ranked), default=1.0), 1.0)
    if p_value >= LEVEL:
        return Located(base, (), p_value)
    noise = unexplained(evidence, ranked)
    worth = [finer(evidence, s, noise) for s in contenders(ranked, noise)]
    fitted = ended(bench, [(s.correction, fitted_from(bench, base, s)) for s in worth])
    prices = [s.worth(noise)[1] for s in worth]
    order = np.argsort([-score for score in scores(base, [h for _, h in fitted], prices)], kind="stable")
    return Located(
        base, tuple(fitted[i] for i in order), p_value, tuple(prices[i] for i in order), _promised(ranked, base)
    )


def contenders(ranked: Sequence[Suspect], noise: float) -> list[Suspect]:
    """Return what is worth a fit: of every place the best, and of the best place the second, if close enough."""
    worth = [s.worth(noise)[0] for s in ranked]
    close = [s for s, value in zip(ranked, worth, strict=True) if value > max(CLOSE * worth[0], 0.0)]
    first: dict[Place, Suspect] = {}
    for s in close:
        first.setdefault(s.correction.place, s)
    second = [s for s in close if s.correction.place == close[0].correction.place][1:2] if close else []
    return [*first.values(), *second][:FITTED] if close else list(ranked[:1])


def finer(evidence: Evidence, found: Suspect, noise: float) -> Suspect:
    """Return a suspect with as many knots as the data ask for."""
    sharper = [suspect(evidence, correction) for correction in sharpened(evidence, found.correction)]
    return max([found, *sharper], key=lambda s: s.worth(noise)[0])


def fitted_from(bench: Bench, base: Hypothesis, found: Suspect) -> Hypothesis:
    """Fit a correction on top of a hypothesis, from what solves the linear problem where that helps."""
    still = found.correction.put_in(base.fit.chain)
    solved = still.with_values(found.values)
    if len(found.correction.knots) > MOST:  # a table as fine as the data holds the answer already
        chi2 = sum(chi_squared(solved, o) for o in bench.observations)
        return replace(base, fit=replace(base.fit, chain=solved), chi2=chi2)
    helps = sum(chi_squared(solved, o) for o in bench.observations) < base.chi2
    return bench.fitted(solved if helps else still, base.effects, ITERATIONS)


def ended(bench: Bench, fitted: list[tuple[Correction, Hypothesis]]) -> list[tuple[Correction, Hypothesis]]:
    """Fit to the end what has not come there and is near enough to the best that the order could change.

    A table as fine as the data was solved, and is at its end.
    """
    best = min(h.chi2 for _, h in fitted)
    close = [h.chi2 < NEAR * best and h.chi2 - h.hope <= best for _, h in fitted]
    if sum(close) < 2:
        return fitted
    return [
        (c, bench.fitted(h.fit.chain, h.effects) if near and not h.fit.converged and len(c.knots) <= MOST else h)
        for (c, h), near in zip(fitted, close, strict=True)
    ]


def _promised(ranked: Sequence[Suspect], base: Hypothesis) -> dict[Place, float]:
    """Return the largest share of the misfit that the corrections of every place promise."""
    beyond = max(base.chi2 - base.count, base.noise_known * base.count)
    found: dict[Place, float] = {}
    for s in ranked:
        found[s.correction.place] = max(found.get(s.correction.place, 0.0), s.gain / beyond)
    return found
