"""At which stage, and along which coordinate, does what the chain cannot explain enter?

Every correction is judged on the residual to first order (suspect). The best of every place is then fitted, because a
large mismatch is not linear; where that leaves more than noise, laws with corners are tried, which no smooth map is.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress
from math import exp

from identify.chain import Chain
from identify.evidence import Evidence
from identify.explain.bench import Bench
from identify.explain.corners import again, cornered, slid
from identify.explain.hypothesis import Hypothesis
from identify.explain.race import KEPT
from identify.explain.round import FORETOLD
from identify.explain.steady import steady
from identify.explain.suspect import LEVEL, Suspect, contenders, finer, is_fine, overlooked, unexplained
from identify.explain.wander import all_wanders
from identify.fit import total_chi_squared
from identify.phases import turned_sines
from identify.stage import Place
from identify.unnamed.correction import Correction
from identify.unnamed.hysteresis import Hysteresis, Relays
from identify.unnamed.maps import BrokenMap, LevelMap, LevelTable

ITERATIONS = 8  # a correction is nearly linear in its weights
NEAR = 2.0  # times the best sum of squares, up to which a search cut short is ended
KNOWN = 60.0  # of chi-squared, by which a correction of the right kind may be behind
LAWLESS = 6  # power of the ratio of what two corrections leave that gives their odds where neither is the law
MOVED, SLID = 2, 6  # times corners are sought anew, and slid, at most
MOVABLE = 100.0  # times the best sum of squares, up to which they are moved
STRIDE, LAST = 3, 3  # iterations of a lap of the race, corrections that come to its end
LITTLE = 0.1  # share of a misfit: a correction that explains less tells only where that part of it enters
LIKELY = 0.05  # posterior probability from which a place is mentioned beside the best
DISGUISE = 0.25  # odds of what is less likely where it does the same: a law of v that one of F is, as G1 is built to be
# linear; a table that a law of few numbers foretells; another place than that at which such laws mostly are
ROUNDED = 5e-4  # of a misfit: by as much the right correction may be behind one elsewhere, as knots round either
TEMPER = 0.05  # of a log likelihood: corrections are families near the truth, not the truth


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
        least = min(h.misfit for _, h in self.fitted)
        left = [h.misfit - least + max(least, KNOWN / h.count) for _, h in self.fitted]
        found: dict[Place, float] = {}
        for (correction, h), score, misfit in zip(self.fitted, worth, left, strict=True):
            odds = max(exp(max(TEMPER * (score - max(worth)), -700.0)), (min(left) / misfit) ** LAWLESS)
            foretold = self.foretold(correction, h)
            of_g1 = correction.place is Place.G1 and isinstance(correction, LevelMap | BrokenMap | Hysteresis | Relays)
            odds *= DISGUISE if of_g1 or foretold else 1.0
            for place in entered_at(correction):
                found[place] = max(found.get(place, 0.0), odds if place is correction.place else DISGUISE * odds)
        for place in {correction.place for correction, h in self.fitted if self._as_good(h)}:
            found[place] = max(found[place], DISGUISE * max(found.values()))
        total = sum(found.values())
        return dict(sorted(((place, odds / total) for place, odds in found.items()), key=lambda item: -item[1]))

    def _as_good(self, fitted: Hypothesis) -> bool:
        """Return whether a correction is behind the best by no more than knots make of a law that is none of theirs."""
        least = min(h.chi2 for _, h in self.fitted)
        return fitted.chi2 - least < ROUNDED * (self.base.chi2 - least)

    def foretold(self, correction: Correction, fitted: Hypothesis) -> bool:
        """Return whether a correction is a disguise of a plainer one that was fitted and foretells nearly all of it.

        Of a table as fine as the data any law of few numbers is one; of dynamics by direction, those of both alike.
        """
        table = is_table(correction)
        plainer = [h for c, h in self.fitted if (not is_table(c) if table else c.form == correction.plainly)]
        return any(self.base.chi2 - h.chi2 > FORETOLD * (self.base.chi2 - fitted.chi2) for h in plainer)

    @property
    def astray(self) -> bool:
        """Return whether even the best correction explains so little that the rest may enter anywhere.

        What noise may make is no rest.
        """
        return self.base.chi2 - self.fitted[0][1].chi2 < LITTLE * self.base.proven

    def alternatives(self, unproven: bool = False) -> tuple[Place, ...]:
        """Return the other places the data do not exclude: all where held-out data are no better for the best."""
        likely = [place for place, p in self.places.items() if p > LIKELY]
        every = [*likely, *(place for place in Place if place not in likely)] if self.astray or unproven else likely
        return tuple(place for place in every if place != self.best.place)

    def share_at(self, place: Place) -> float:
        """Return the share of the misfit that the best correction at a place explains, to first order if not fitted."""
        shares = [h.share(self.base) for c, h in self.fitted if c.place == place]
        return max(shares, default=self.promised.get(place, 0.0))


def entered_at(correction: Correction) -> tuple[Place, ...]:
    """Return the places at which a correction may have entered, its own first.

    A table over the clock, as fine as the data, is put at F where it shows only while F moves: what is in front of F
    shows only then, too.
    """
    in_front = is_fine(correction) and correction.place is Place.F
    return (*correction.same_at, *((Place.G1, Place.SOURCE) if in_front else ()))


def is_table(correction: Correction) -> bool:
    """Return whether a correction is as fine as the data: over the clock, or over all levels that u rests on."""
    return is_fine(correction) or isinstance(correction, LevelTable)


def scores(base: Hypothesis, fitted: Sequence[Hypothesis], prices: Sequence[float]) -> list[float]:
    """Return the log of the likelihood ratio of every fitted correction to none."""
    noise = max(1.0, min((h.chi2 / h.count for h in fitted), default=1.0))
    return [0.5 * (base.chi2 - h.chi2) / noise - price for h, price in zip(fitted, prices, strict=True)]


def located(bench: Bench, base: Hypothesis) -> Located:
    """Fit the corrections that promise most on top of a hypothesis, the best of each of several places; remember them.

    None where all that is left may be what its own effects do by chance.
    """
    return bench.remembered(_located, base)


def _located(bench: Bench, base: Hypothesis) -> Located:
    """Fit them once; what was fitted on coarser grids goes on from there."""
    before = bench.told_before(_located, base)
    if before is not None:
        return _once_more(bench, base, before)
    if all_wanders(base, bench.observations):
        return Located(base, (), 1.0)
    ranked = bench.suspects(base)
    p_value = min(min((len(ranked) * s.p_value for s in ranked), default=1.0), 1.0)
    if p_value >= LEVEL:
        return Located(base, (), p_value)
    evidence = bench.evidence(base)
    noise = unexplained(evidence, ranked)
    worth, fitted = _fitted(bench, base, evidence, ranked, noise)
    prices = tuple(s.worth(noise)[1] for s in worth)
    return _ordered(Located(base, tuple(fitted), p_value, prices, _promised(ranked, base)))


def _once_more(bench: Bench, base: Hypothesis, before: Located) -> Located:
    """Return the same corrections fitted on these grids."""
    fitted = [
        (c, _as_it_is(bench, base, h.fit.chain) if is_fine(c) else bench.fitted(h.fit.chain, base.effects, ITERATIONS))
        for c, h in before.fitted
    ]
    return _ordered(replace(before, base=base, fitted=tuple(ended(bench, fitted))))


def _ordered(found: Located) -> Located:
    """Return the corrections by the odds of their places, those of one place by their scores."""
    worth = scores(found.base, [h for _, h in found.fitted], found.prices)
    by = sorted(range(len(worth)), key=lambda i: (-found.places[found.fitted[i][0].place], -worth[i]))
    return replace(found, fitted=tuple(found.fitted[i] for i in by), prices=tuple(found.prices[i] for i in by))


def _fitted(
    bench: Bench, base: Hypothesis, evidence: Evidence, ranked: Sequence[Suspect], noise: float
) -> tuple[list[Suspect], list[tuple[Correction, Hypothesis]]]:
    """Return the corrections that are worth a fit, and their fits; of lines those that are there in all runs alike."""
    smooth = [finer(evidence, s, noise) for s in contenders(ranked, noise)]
    worth = [*smooth, *cornered(evidence, ranked, noise)]
    fitted = [_slid_on(bench, base, s.correction, fitted_from(bench, base, s)) for s in worth]
    told = base.chi2 - min(h.chi2 for _, h in fitted)
    if min(h.misfit for _, h in fitted) > base.noise_known or told < KEPT * max(s.gain for s in ranked):
        unfitted = overlooked(ranked, worth)
        others = raced(bench, base, [s if s.correction.searched else finer(evidence, s, noise) for s in unfitted])
        worth, fitted = [*worth, *(s for s, _ in others)], [*fitted, *((s.correction, h) for s, h in others)]
    reach = max(MOVABLE * min(h.chi2 for _, h in fitted), (1.0 + base.noise_known) * base.count)
    fitted = [with_corners(bench, base, c, h) if h.chi2 < reach else (c, h) for c, h in fitted]
    fitted = ended(bench, fitted)
    kept = [steady(base, c, h) for c, h in fitted]
    return (list(compress(worth, kept)), list(compress(fitted, kept))) if any(kept) else (worth, fitted)


def raced(bench: Bench, base: Hypothesis, others: Sequence[Suspect]) -> list[tuple[Suspect, Hypothesis]]:
    """Fit corrections side by side, a few iterations at a time, the better half each time further; return the last.

    Where a mismatch is large the plain values stand in for it, and first order does not lead back from there: how much
    a correction promises says little of what it explains once all values may follow.
    """
    running = [(s, fitted_from(bench, base, s, STRIDE)) for s in others]
    while len(running) > LAST and min(h.misfit for _, h in running) > base.noise_known:
        ahead = sorted(running, key=lambda pair: pair[1].chi2)[: max(len(running) // 2, LAST)]
        running = [(s, bench.fitted(h.fit.chain, base.effects, STRIDE)) for s, h in ahead]
    return sorted(running, key=lambda pair: pair[1].chi2)[:LAST]


def fitted_from(bench: Bench, base: Hypothesis, found: Suspect, iterations: int = ITERATIONS) -> Hypothesis:
    """Fit a correction on top of a hypothesis, from what solves the linear problem where that helps."""
    still = found.correction.put_in(base.fit.chain)
    solved = still.with_values(found.values)
    if is_fine(found.correction):
        return _as_it_is(bench, base, solved)
    helps = total_chi_squared(solved, bench.observations) < base.chi2
    fitted = bench.fitted(solved if helps else still, base.effects, iterations)
    if not found.correction.searched:
        return fitted
    turned = turned_sines(fitted.fit.chain, bench.observations, [p.name for p in found.correction.parameters()])
    return fitted if turned is fitted.fit.chain else min(
        (fitted, bench.fitted(turned, base.effects, iterations)), key=lambda h: h.chi2
    )  # fmt: skip


def _as_it_is(bench: Bench, base: Hypothesis, chain: Chain) -> Hypothesis:
    """Return a table as fine as the data on top of a hypothesis: it holds the answer already."""
    return replace(base, fit=replace(base.fit, chain=chain), chi2=total_chi_squared(chain, bench.observations))


def with_corners(
    bench: Bench, base: Hypothesis, law: Correction, fitted: Hypothesis
) -> tuple[Correction, Hypothesis]:
    """Return a fit with corners moved to where they are best once the plain values are where the law lets them be."""
    for _ in range(MOVED):
        if not isinstance(law, BrokenMap) or fitted.misfit < base.noise_known:
            break
        plain = bench.fitted(base.fit.chain.with_values(fitted.fit.chain.values), base.effects, 0)
        sought, found = again(bench.evidence(plain), law)
        other, better = _slid_on(bench, base, sought, fitted_from(bench, plain, found))
        if better.chi2 > fitted.chi2 - 1.0:
            break
        law, fitted = other, better
    return law, fitted


def _slid_on(bench: Bench, base: Hypothesis, law: Correction, fitted: Hypothesis) -> tuple[Correction, Hypothesis]:
    """Return a fit whose corners, if it has any, are slid while all else follows, as often as that makes it better."""
    for _ in range(SLID):
        there = slid(law, fitted.fit.chain.values) if isinstance(law, BrokenMap) else None
        if there is None:
            break
        moved, weights = there
        chain = moved.put_in(base.fit.chain.with_values(fitted.fit.chain.values), weights)
        better = bench.fitted(chain, base.effects, ITERATIONS)
        if better.chi2 > fitted.chi2 - 1.0:
            break
        law, fitted = moved, better
    return law, fitted


def ended(bench: Bench, fitted: list[tuple[Correction, Hypothesis]]) -> list[tuple[Correction, Hypothesis]]:
    """Fit to the end what has not come there and is near enough to the best that the order could change.

    A table as fine as the data was solved, and is at its end.
    """
    best = min(h.chi2 for _, h in fitted)
    close = [h.chi2 < NEAR * best and h.chi2 - h.hope <= best for _, h in fitted]
    if sum(close) < 2:
        return fitted
    return [
        (c, bench.fitted(h.fit.chain, h.effects) if near and not h.fit.converged and not is_fine(c) else h)
        for (c, h), near in zip(fitted, close, strict=True)
    ]


def _promised(ranked: Sequence[Suspect], base: Hypothesis) -> dict[Place, float]:
    """Return the largest share of the misfit that the corrections of every place promise."""
    beyond = max(base.chi2 - base.count, base.noise_known * base.count)
    found: dict[Place, float] = {}
    for s in ranked:
        found[s.correction.place] = max(found.get(s.correction.place, 0.0), s.gain / beyond)
    return found
