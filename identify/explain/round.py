"""What does one step of the selection consider: what is worth a look, a fit, and a name?"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

from scipy.stats import chi2 as chi2_distribution

from identify.candidates import Candidate
from identify.effects.effect import Effect
from identify.explain.hypothesis import Hypothesis, is_discovery
from identify.explain.promise import Pair, Promise
from identify.stage import Place

Kind = tuple[str, Place]
LOOKED_AT = 16  # candidates whose own parameters are fitted to first order
PAIRED = 32  # candidates that are asked for what they promise by twos
HOPEFUL = 0.03  # share of the best promise at its start below which a candidate is not looked at
DOUBTFUL = 0.05  # probability of a start's gain by chance above which nothing speaks for an effect
FITTED_A_ROUND = 8
NEXT = 2e-4  # share of what is explained already that one more effect must explain: a rig file is not exact either
WHOLE = 0.9  # share of what is left, from which an effect counts however little that is
STANDS_IN = 0.3  # share of the best start's gain from which a lag is fitted though another law explains all
UNFORESEEN = 3  # fits a round of what first order does not foresee
PROMISING = 0.2  # share of the best promise below which a candidate is not fitted
NEARLY = 0.9  # share of the best promise that the samples' own grid, on which promises are made, may mistake
FORETOLD = 0.7  # share of what chance would explain, from which a law that foretells it is believed first
COMPARED = 60.0  # of twice the log of odds: what is further behind is as good as excluded
SLACK = 30.0  # times the probability at which chance is excluded, up to which a candidate is fitted
FAR = 0.3  # share of the best fall by which a fit may be behind and still come near
OPEN = 9.0  # of chi-squared: a law that is behind by less is not shut out
FULLER = 500.0  # of chi-squared: by as much one more value of a law may bring it ahead
HOPELESS = -1000.0  # of the criterion: an effect this far behind when it was tried is not tried again


@dataclass(frozen=True)
class Round:
    """One step of the selection: how many tests speak against a discovery in it, what was fitted, best first."""

    base: Hypothesis
    looks: int
    tried: tuple[Hypothesis, ...]
    settled: Hypothesis | None = None  # the winner, once the effects before it were looked at again beside it
    passed_over: tuple[Promise, ...] = ()  # what promised nearly as much as the best, and was not fitted
    pairs: tuple[Pair, ...] = ()  # what promises most by twos, where no law explains it all

    @property
    def information(self) -> float:
        """Return what the mismatch tells: by how much chi-squared falls at best."""
        return max((self.base.chi2 - h.chi2 for h in self.tried), default=0.0)

    def lead(self, hypothesis: Hypothesis) -> float:
        """Return how far a hypothesis is ahead of the winner of the fits, below zero when it is behind."""
        return hypothesis.advantage(self.tried[0], self.information)

    @property
    def close(self) -> tuple[Hypothesis, ...]:
        """Return what was not hopelessly behind the winner, its own fuller forms first: on a grid fine enough for them,
        none of these is behind.
        """
        fuller = [] if not self.tried else self.tried[0].effects[-1].fuller()
        contain = [h for h in self.tried if h.effects[-1] in fuller]
        others = [h for h in self.tried[1:] if self.lead(h) > HOPELESS and h.effects[-1] not in fuller]
        return (*self.tried[:1], *contain, *others)

    @property
    def undecided(self) -> tuple[Hypothesis, ...]:
        """Return the best of every kind that a further effect may bring ahead: the winner leaves more than its lead.

        The winner's own values may stand in for what is not found yet.
        """
        left = max((h.chi2 - h.count for h in self.tried[:1]), default=0.0)
        found: dict[Kind, Hypothesis] = {}
        for h in self.tried:
            if self.lead(h) > HOPELESS or h.chi2 - self.tried[0].chi2 < left:
                found.setdefault(kind_of(h.effects[-1]), h)
        return tuple(found.values())

    def without(self, law: Effect) -> "Round":
        """Return the round without a law, at its place, and what acts by chance."""
        others = (h for h in self.tried if h.swell == 1.0 and kind_of(h.effects[-1]) != kind_of(law))
        return replace(self, tried=tuple(others), settled=None)

    @property
    def kinds(self) -> tuple[Hypothesis, ...]:
        """Return the best of every kind."""
        found: dict[Kind, Hypothesis] = {}
        for h in self.tried:
            found.setdefault(kind_of(h.effects[-1]), h)
        return tuple(found.values())

    @property
    def near(self) -> tuple[Hypothesis, ...]:
        """Return what the winner must be compared with closely."""
        return tuple(h for h in self.tried if self.lead(h) > -COMPARED)

    @property
    def best(self) -> Hypothesis | None:
        """Return the hypothesis that wins the round, None when chance may have made it or it is not worth a name."""
        winner = self.settled or (self.tried[0] if self.tried else None)
        if winner is None or not is_discovery(winner.p_value(self.base), self.looks):
            return None
        return winner if winner.gains_enough(self.base) else None


def kind_of(effect: Effect) -> Kind:
    """Return what an effect is and where, whatever its form."""
    return effect.id, effect.place


def ranked(base: Hypothesis, tried: Sequence[Hypothesis]) -> tuple[Hypothesis, ...]:
    """Return hypotheses on the same base, the most probable first.

    What acts by chance could have made any scatter: where a law that foretells it explains nearly as much, and leaves
    what may be noise, that law is before it.
    """
    told = max((base.chi2 - h.chi2 for h in tried), default=0.0)
    found = sorted(tried, key=lambda h: -h.advantage(base, told))
    if found and found[0].swell > 1.0:
        foretold = [h for h in found if h.swell == 1.0 and not h.proven and base.chi2 - h.chi2 > FORETOLD * told]
        found.sort(key=lambda h: h not in foretold)
    return tuple(found)


def richer(base: Hypothesis, tried: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return what one more parameter of its law may bring ahead: all near a best fit that leaves more than noise.

    Where it may leave none, the best, which is not to be mended by a second law, and what is behind it by more than
    chance: no law is shut out for a value it was not given. Of a large mismatch that value may bring a part.
    """
    best = min(tried, key=lambda h: h.chi2, default=base)
    told = base.chi2 - best.chi2
    least, reach = -inf, FAR * told
    if best.misfit < best.noise_known:
        least, reach = OPEN, min(reach, max(FULLER, NEXT * told))
    return [h for h in tried if h is best or least < h.chi2 - best.chi2 < reach]


def hopeful(screened: Sequence[Candidate], runs: int) -> list[Candidate]:
    """Return what is worth a closer look: the best forms of every effect at every place, those that promise most."""
    best = max((c.gain for c in screened), default=0.0)
    kept: list[Candidate] = []
    for candidate in screened:
        same = [c for c in kept if kind_of(c.effect) == kind_of(candidate.effect)]
        rival = all(candidate.gain > 0.6 * c.gain and c.effect.form != candidate.effect.form for c in same)
        told = candidate.gain > HOPEFUL * best and chance(candidate, candidate.gain, runs) < DOUBTFUL
        if told and len(same) < 2 and (not same or rival):
            kept.append(candidate)
    return kept


def chance(candidate: Candidate, gain: float, runs: int) -> float:
    """Return how likely noise alone would make an effect, its parameters free, gain so much."""
    return float(chi2_distribution.sf(max(gain, 0.0), candidate.effect.freedom(runs)))


def passed_over(promises: Sequence[Promise], fitted: Sequence[Promise]) -> tuple[Promise, ...]:
    """Return what was not fitted although it promises nearly as much as the best: a finer grid may turn the order."""
    best = max((p.gain for p in fitted), default=0.0)
    left = [p for p in promises if p not in fitted and p.gain > NEARLY * best]
    return tuple(sorted(left, key=lambda p: -p.gain)[:FITTED_A_ROUND])


def unforeseen(
    promises: Sequence[Promise], fitted: Sequence[Promise], tried: Sequence[Hypothesis], base: Hypothesis, there: float
) -> list[Promise]:
    """Return what was not fitted, gains much from its start, and is not told by a first order in the plain parameters.

    These have moved far to stand in for it, and its fit does not begin where their first order leads. Where the best
    fit leaves much of what is ``there`` beside the plain ones, they have for all laws, and everything is returned.
    """
    best = max((p.candidate.gain for p in fitted), default=0.0)
    left = [p for p in promises if p not in fitted]
    if not base.effects and base.chi2 - min((h.chi2 for h in tried), default=base.chi2) < WHOLE * there:
        return left
    told = [p for p in left if p.slack > abs(p.gain) and p.candidate.gain > PROMISING * best]
    return sorted(told, key=lambda p: -p.candidate.gain)[:UNFORESEEN]


def lagging(
    screened: Sequence[Candidate], tried: Sequence[Hypothesis], base: Hypothesis, wanders: bool, there: float
) -> list[Candidate]:
    """Return every lag that was not fitted, from its best start, where the best fit leaves much of a misfit.

    The plain values stand in for a lag, and first order does not lead back from where they have gone. What is ``there``
    of chi-squared says what is much. Where it leaves little, those whose start alone explains a fair share of what the
    best start does: where data tell little, another law explains with values that are off what a lag does. Where the
    misfit ``wanders``, from repeat to repeat, what acts by chance is
    returned, too: first order foresees the mean of it alone.
    """
    best = min(tried, key=lambda h: h.chi2, default=base)
    if there <= 0.0:
        return []
    whole = base.chi2 - best.chi2 > WHOLE * there
    least = STANDS_IN * max((c.gain for c in screened), default=0.0) if whole else 0.0
    fitted = {kind_of(h.effects[-1]) for h in tried}

    def late(effect: Effect) -> bool:
        return effect.lags or (wanders and effect.by_chance and not whole)

    found: dict[Kind, Candidate] = {}
    for c in (c for c in screened if late(c.effect) and c.gain >= least and kind_of(c.effect) not in fitted):
        found.setdefault(kind_of(c.effect), c)
    return list(found.values())


def outdone(promises: Sequence[Promise], fitted: Sequence[Promise], fall: float) -> list[Promise]:
    """Return what was not fitted although it promises more than the best fit kept: the best promise was a mistake."""
    left = [p for p in promises if p not in fitted and p.gain > fall]
    return sorted(left, key=lambda p: -p.gain)[:FITTED_A_ROUND]


def promising(promises: Sequence[Promise], tried: int, runs: int) -> list[Promise]:
    """Return what is worth a fit: what chance has hardly made, and whose fit may come near that of the best."""
    told = [p for p in promises if is_discovery(chance(p.candidate, p.gain + p.slack, runs) / SLACK, tried)]
    most = sorted(told, key=lambda p: -p.gain)
    best, sure = max((p.gain for p in most), default=0.0), max((p.gain - p.slack for p in most), default=0.0)
    may_win = [p for p in most if p.gain > PROMISING * best and p.gain + p.slack > sure - COMPARED]
    return may_win[:FITTED_A_ROUND]


def counts(start: Hypothesis, base: Hypothesis, best: Hypothesis, there: float) -> bool:
    """Return whether a further effect explains more than what the right law of a large one leaves, taken roughly.

    Or all but little of what is ``there`` to explain: that no law does which stands in for the flaws of another.
    """
    large = base.chi2 - best.chi2 > NEXT * (start.chi2 - base.chi2)
    return large or base.chi2 - best.chi2 > WHOLE * there > 0.0
