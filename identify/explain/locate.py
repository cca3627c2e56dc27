"""At which stage, and along which coordinate, does what the chain cannot explain enter?

Every correction is judged on the residual to first order (suspect); the best of every place are fitted (free_form).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import exp, inf

from identify.explain.bench import Bench
from identify.explain.free_form import all_tried, begun, ended, gone_on, rest
from identify.explain.hypothesis import Hypothesis
from identify.explain.knowing import ruled_out
from identify.explain.round import FORETOLD
from identify.explain.side_by_side import ITERATIONS, as_it_is, raced
from identify.explain.steady import steady
from identify.explain.suspect import LEVEL, Suspect, explainable, is_fine
from identify.stage import Place
from identify.unnamed.correction import Correction
from identify.unnamed.hysteresis import Hysteresis, Relays
from identify.unnamed.maps import BrokenMap, LevelMap, LevelTable

KNOWN = 60.0  # of chi-squared, by which a correction of the right kind may be behind
LAWLESS = 6  # power of the ratio of what two corrections leave that gives their odds where neither is the law
LITTLE = 0.1  # share of a misfit: a correction that explains less tells only where that part of it enters
LIKELY = 0.05  # posterior probability from which a place is mentioned beside the best
DISGUISE = 0.25  # odds of what is less likely where it does the same: a law of v that one of F is, as G1 is built to be
SAME = 1e-3  # of chi-squared, by which a hypothesis on finer grids may differ and be the same
# linear; a table that a law of few numbers foretells; another place than that at which such laws mostly are
ROUNDED = 5e-4  # of a misfit: by as much the right correction may be behind one elsewhere, as knots round either
UNFINISHED = 2  # power of the share that the best leaves of what another is behind: odds where it leaves some
TEMPER = 0.05  # of a log likelihood: corrections are families near the truth, not the truth
EASILY = 3e4  # of chi-squared, that no laws explain which stand in for others, without leaving some of it
LESSER = 0.5  # of a mismatch, that the larger of two laws leaves at most
HARDLY = 0.03  # of a large mismatch, that a first fit of the right correction may leave
MOSTLY = 0.9  # of what laws tell, that a law of one lag, threshold or rate promises that may tell more
BEHIND, NEARER = 1e3, 1.0  # of chi-squared, or times what is to be left, by which a first fit may be behind that


@dataclass(frozen=True)
class Located:
    """The corrections that explain most, fitted, best first, and the misfit without them.

    ``prices`` are what the weights of each cost, as logs of likelihoods; ``promised`` is the share of the misfit that
    the best correction of every place promises to first order, ``ruled_out`` are places at which it has not come in.
    ``doubt`` is by how much chi-squared would fall again beside the best of them, where that was asked.
    """

    base: Hypothesis
    fitted: tuple[tuple[Correction, Hypothesis], ...]
    p_value: float
    prices: tuple[float, ...] = ()
    promised: Mapping[Place, float] = field(default_factory=dict)
    ruled_out: tuple[Place, ...] = ()
    doubt: float | None = None

    @property
    def significant(self) -> bool:
        """Return whether something is there that noise does not make."""
        return bool(self.fitted) and self.p_value < LEVEL

    @property
    def best(self) -> Correction:
        """Return the correction that explains most."""
        return self.fitted[0][0]

    @property
    def place(self) -> Place:
        """Return where the mismatch enters: where the best correction is, or has its like if it has not come in there.
        """
        return next(iter(self.places)) if self.best.place in self.ruled_out else self.best.place

    @property
    def share(self) -> float:
        """Return which share of the misfit the best correction explains."""
        return self.fitted[0][1].share(self.base)

    @cached_property
    def nearest(self) -> Hypothesis:
        """Return the fit that leaves least."""
        return min((h for _, h in self.fitted), key=lambda h: h.chi2)

    @property
    def leaves_noise(self) -> bool:
        """Return whether nothing would be found in what the nearest leaves, and noise may be as much as that."""
        return self.doubt == 0.0 and not self.nearest.proven

    @cached_property
    def places(self) -> dict[Place, float]:
        """Return the posterior probability of every place that was fitted, the likeliest first."""
        worth = scores(self.base, [h for _, h in self.fitted], self.prices)
        best = self.nearest.misfit
        left = [h.misfit - best + max(0.0 if self.leaves_noise else best, KNOWN / h.count) for _, h in self.fitted]
        found: dict[Place, float] = {}
        for (correction, h), score, misfit in zip(self.fitted, worth, left, strict=True):
            odds = max(exp(max(TEMPER * (score - max(worth)), -700.0)), (min(left) / misfit) ** LAWLESS)
            odds = max(odds, self._in_doubt(h))
            foretold = self.foretold(correction, h)
            of_g1 = correction.place is Place.G1 and isinstance(correction, LevelMap | BrokenMap | Hysteresis | Relays)
            odds *= DISGUISE if of_g1 or foretold else 1.0
            for place in entered_at(correction):
                found[place] = max(found.get(place, 0.0), odds if place is correction.place else DISGUISE * odds)
        for place in {correction.place for correction, h in self.fitted if self._as_good(h)}:
            found[place] = max(found[place], DISGUISE * max(found.values()))
        found = {p: odds for p, odds in found.items() if p not in self.ruled_out} or found
        total = sum(found.values())
        return dict(sorted(((place, odds / total) for place, odds in found.items()), key=lambda item: -item[1]))

    def _in_doubt(self, fitted: Hypothesis) -> float:
        """Return the odds of a correction that explains less than the best: by no more than that leaves, it may be."""
        behind = fitted.chi2 - self.nearest.chi2
        return (self.doubt / (self.doubt + behind)) ** UNFINISHED if self.doubt else 0.0

    def _as_good(self, fitted: Hypothesis) -> bool:
        """Return whether a correction is behind the best by no more than knots make of a law that is none of theirs."""
        least = self.nearest.chi2
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
        """Return the other places the data do not exclude: all where held-out data are no better for the best.

        So it is where what is not ruled out was not fitted.
        """
        likely = [place for place, p in self.places.items() if p > LIKELY]
        is_open = self.astray or unproven or self.best.place in self.ruled_out
        every = [*likely, *(place for place in Place if place not in likely)] if is_open else likely
        return tuple(place for place in every if place not in (self.place, *self.ruled_out))

    def share_at(self, place: Place) -> float:
        """Return the share of the misfit that the best correction at a place explains, to first order if not fitted."""
        shares = [h.share(self.base) for c, h in self.fitted if c.place == place]
        return max(shares, default=self.promised.get(place, 0.0))


def doubted(bench: Bench, found: Located) -> Located:
    """Return the same with how much corrections would find once more beside the best: the law itself leaves nothing.

    Where that is something, what was not fitted as the best might have left none but noise is. A table as fine as the
    data takes all there is.
    """
    if not found.significant or is_fine(found.best):
        return found
    doubt = _doubt(bench, found)
    others = _others(bench, found) if doubt else found
    if [id(h) for _, h in others.fitted] != [id(h) for _, h in found.fitted]:  # arrays have no one answer to ==
        found, doubt = others, _doubt(bench, others)
    return _ordered(replace(found, doubt=doubt))


def _doubt(bench: Bench, found: Located) -> float:
    """Return by how much corrections would let chi-squared fall once more beside the best of those that were fitted."""
    return explainable(bench.suspects(found.nearest))


def _others(bench: Bench, found: Located) -> Located:
    """Return the corrections that were fitted, and the best of those that might have been; of lines as ``gone_on``."""
    base, first = found.base, bench.remembered(begun, found.base)
    if not first.ranked or all_tried(base, first):
        return found
    known = {(law.form, law.place) for law, _ in found.fitted}
    left = rest(bench, base, first, lambda s: (s.correction.form, s.correction.place) not in known, 0.0)
    raced_on = raced(bench, base, left, -inf)
    others = [(s, h) for s, h in raced_on if steady(base, s.correction, h)]
    fitted = ended(bench, [*found.fitted, *((s.correction, h) for s, h in others)])
    prices = (*found.prices, *(s.worth(first.noise)[1] for s, _ in others))
    return replace(found, fitted=tuple(fitted), prices=prices)


def entered_at(correction: Correction) -> tuple[Place, ...]:
    """Return the places at which a correction may have entered, its own first.

    A table over the clock, as fine as the data, is put at F where it shows only while F moves: what is in front of F
    shows only then, too.
    """
    in_front = is_fine(correction) and correction.place is Place.F
    return (*correction.like_at, *((Place.G1, Place.SOURCE) if in_front else ()))


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
    before = bench.told_before(_located, base, SAME * base.chi2)
    if before is not None:
        return _once_more(bench, base, before[1])
    first = bench.remembered(begun, base)
    if not first.fitted:
        return Located(base, (), first.p_value)
    worth, fitted = gone_on(bench, base, first)
    prices = tuple(s.worth(first.noise)[1] for s in worth)
    promised, elsewhere = _promised(first.ranked, base), ruled_out(base.fit.chain, bench.observations)
    return _ordered(Located(base, tuple(fitted), first.p_value, prices, promised, elsewhere))


def within_reach(bench: Bench, base: Hypothesis, chi2: float) -> bool:
    """Return whether one correction of free form may come to a chi-squared, as far as a first fit of each tells.

    What follows such a fit takes far longer, and brings nearer by a part. Where names explain so much that laws which
    stand in for others would have left some of it, that is not gone after.
    """
    if base.chi2 - chi2 < EASILY:
        return True
    behind = max(BEHIND, NEARER * (chi2 - base.count))
    return any(h.chi2 - chi2 < behind for h in first_fits(bench, base))


def told_by_one(bench: Bench, start: Hypothesis, laws: Hypothesis) -> bool:
    """Return whether a first fit of one correction leaves next to nothing of a mismatch, and laws leave most of it.

    Two laws at different places are more than one correction can make, and the larger of them tells more than half: it
    is one thing then, and none of the laws. So it is where one of no more numbers leaves nothing at all that any would
    find beside it, and laws much. What acts by chance tells what it may have made, and is not asked.
    """
    if laws.swell > 1.0:
        return False
    return _told_little(bench, start, laws) or _by_fewer(bench, bench.again(start), laws)


def _told_little(bench: Bench, start: Hypothesis, laws: Hypothesis) -> bool:
    """Return whether laws leave most of a mismatch of which a first fit of one correction leaves next to nothing."""
    promised = max((s.gain for s in bench.suspects_near(start, SAME * start.chi2)[1]), default=0.0)
    if start.chi2 - laws.chi2 >= LESSER * promised and laws.proven <= LESSER * start.proven:
        return False
    start = bench.again(start)
    least = max(start.noise_known * start.count, HARDLY * (start.chi2 - start.count))
    alone = [h for h in first_fits(bench, start) if h.chi2 - h.count < least]
    return any(laws.chi2 - h.chi2 > LESSER * (start.chi2 - h.chi2) for h in alone)


def _by_fewer(bench: Bench, start: Hypothesis, laws: Hypothesis) -> bool:
    """Return whether a correction with no more numbers than laws and one more does all of what they leave a part of."""
    most = laws.parameters - start.parameters + 1
    single = [s.gain for s in bench.suspects_near(start, SAME * start.chi2)[1] if s.correction.single]
    if max(single, default=0.0) < MOSTLY * (start.chi2 - laws.chi2):
        return False
    if explainable(bench.suspects(laws)) < BEHIND:
        return False
    few = [h for h in first_fits(bench, start) if h.parameters - start.parameters < most]
    near = any(h.chi2 < laws.chi2 and h.misfit < h.noise_known for h in few)  # else a race is not worth what it takes
    if not near or not (fitted := located(bench, start).fitted):
        return False
    best, found = min(fitted, key=lambda pair: pair[1].chi2)
    numbers = found.parameters - start.parameters + len(best.knots)
    return numbers <= most and laws.chi2 - found.chi2 > BEHIND and not explainable(bench.suspects(found))


def first_fits(bench: Bench, base: Hypothesis) -> list[Hypothesis]:
    """Return corrections of few numbers as first fitted on top of a hypothesis, or to the end where they were before.

    Tables as fine as the data are none.
    """
    known = bench.told_before(_located, base, SAME * base.chi2) is not None
    tried = located(bench, base).fitted if known else bench.remembered(begun, base).fitted
    return [h for correction, h in tried if not is_fine(correction)]


def _once_more(bench: Bench, base: Hypothesis, before: Located) -> Located:
    """Return the same corrections fitted on these grids."""
    fitted = [
        (c, as_it_is(bench, base, h.fit.chain) if is_fine(c) else bench.fitted(h.fit.chain, base.effects, ITERATIONS))
        for c, h in before.fitted
    ]
    return _ordered(replace(before, base=base, fitted=tuple(ended(bench, fitted))))


def _ordered(found: Located) -> Located:
    """Return the corrections by the odds of their places, those of one place by their scores."""
    worth = scores(found.base, [h for _, h in found.fitted], found.prices)
    by = sorted(range(len(worth)), key=lambda i: (-found.places.get(found.fitted[i][0].place, 0.0), -worth[i]))
    return replace(found, fitted=tuple(found.fitted[i] for i in by), prices=tuple(found.prices[i] for i in by))


def _promised(ranked: Sequence[Suspect], base: Hypothesis) -> dict[Place, float]:
    """Return the largest share of the misfit that the corrections of every place promise."""
    beyond = max(base.chi2 - base.count, base.noise_known * base.count)
    found: dict[Place, float] = {}
    for s in ranked:
        found[s.correction.place] = max(found.get(s.correction.place, 0.0), s.gain / beyond)
    return found
