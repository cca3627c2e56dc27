"""Which corrections of free form are fitted, and how far is it worth going on with each?

A large mismatch is not linear: what first order promises says little of what a fit makes of it. Where the first fits
leave more than noise the others race, corners are moved to where they are best, and what is near the best is fitted to
its end.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import compress
from math import log

from identify.evidence import Evidence
from identify.explain.bench import Bench
from identify.explain.corners import again, cornered, either_side, slid
from identify.explain.hypothesis import Hypothesis
from identify.explain.race import KEPT
from identify.explain.side_by_side import ITERATIONS, fitted_from, raced
from identify.explain.sought import distinct, finer, of_one, one_again, relevelled, retimed, retuned
from identify.explain.steady import steady
from identify.explain.suddenly import from_a_run_on, in_breaks
from identify.explain.suspect import LARGE, LEVEL, Suspect, contenders, is_fine, overlooked, suspect, unexplained
from identify.explain.wander import all_wanders
from identify.fit import total_chi_squared
from identify.stage import Place
from identify.unnamed.correction import Correction
from identify.unnamed.lines import Line, Wave
from identify.unnamed.maps import BrokenMap, LevelTable
from identify.unnamed.sudden import Sudden, SuddenDynamics

NEAR = 2.0  # times the best sum of squares, up to which a search cut short is ended
MOVED, SLID = 2, 6  # times corners are sought anew, and slid, at most
WORTH = 0.01  # of what a fit leaves beyond the noise: what was slid by less is there
MOVABLE = 100.0  # times the best sum of squares, up to which they are moved
NEARLY = 0.995  # of the best promise, that first order may mistake
MOSTLY, PART = 0.5, 0.3  # of what is left: what overtones explain of what a line leaves, and that line of a wave
ASIDE, TURN = (-3, -2, -1, 1, 2, 3), 0.25  # of a turn over the longest run, by which a line is tried beside its place
SHARPENED = 0.3  # of the best promise, from which what was not fitted first has the knots the data ask for
NEXT, BESIDE = 0.97, 2  # of what one promises, and how many more of its place are looked at with more knots


@dataclass(frozen=True)
class Begun:
    """What corrections promise on top of a hypothesis, and the first fit of each that promises most.

    ``ranked`` are all, with the variance ``noise`` that none explains; without significance nothing is fitted. Those
    ``asked`` for are what those ``worth`` a fit were before they had the knots that the data ask for.
    """

    p_value: float
    ranked: Sequence[Suspect] = ()
    noise: float = 1.0
    asked: Sequence[Suspect] = ()
    worth: Sequence[Suspect] = ()
    fitted: Sequence[tuple[Correction, Hypothesis]] = ()

    @property
    def most(self) -> float:
        """Return the fall of chi-squared that the best of all promises."""
        return max(s.gain for s in self.ranked)


@dataclass(frozen=True)
class FirstFit:
    """What does the first fit of a correction leave? It begins at what is promised."""

    correction: Correction
    found: Suspect = field(compare=False)

    def __call__(self, bench: Bench, base: Hypothesis) -> Hypothesis:
        """Return the fit on top of a hypothesis."""
        return fitted_from(bench, base, self.found)


@dataclass(frozen=True)
class GoneOn:
    """What does a correction leave once its corners or one knot are slid, and overtones are in it?"""

    correction: Correction
    begun: Hypothesis = field(compare=False)

    def __call__(self, bench: Bench, base: Hypothesis) -> tuple[Correction, Hypothesis]:
        """Return what it has become, and the fit on top of a hypothesis."""
        law, fitted = in_step(bench, base, *slid_on(bench, base, self.correction, self.begun))
        return with_overtones(bench, base, *between_runs(bench, base, law, fitted))


def begun(bench: Bench, base: Hypothesis) -> Begun:
    """Fit the corrections that promise most on top of a hypothesis, none to its end.

    None where all that is left may be what its own effects do by chance.
    """
    if all_wanders(base, bench.observations):
        return Begun(1.0)
    ranked = bench.suspects(base)
    p_value = min(min((len(ranked) * s.p_value for s in ranked), default=1.0), 1.0)
    if p_value >= LEVEL:
        return Begun(p_value)
    evidence = bench.evidence(base)
    noise = unexplained(evidence, ranked)
    asked = contenders(ranked, noise)
    plainer = {s.correction.plainly for s in asked}  # what they may be disguises of stays what it is
    others = [s for s in ranked if not any(s is one for one in asked)]
    beside = [ranked if isinstance(s.correction, LevelTable) else others for s in asked]  # any law may be such a table
    sharp = [
        finer(evidence, s, noise) if s.correction.form in plainer else finest(evidence, laws, s, noise)
        for s, laws in zip(asked, beside, strict=True)
    ]
    smooth = {s.correction: s for s in distinct(evidence, sharp)}
    worth = [*smooth.values(), *cornered(evidence, ranked, noise)]
    fitted = [(s.correction, bench.remembered(FirstFit(s.correction, s), base)) for s in worth]
    return Begun(p_value, ranked, noise, asked, worth, fitted)


def finest(evidence: Evidence, others: Sequence[Suspect], asked: Suspect, noise: float) -> Suspect:
    """Return a suspect, or one of others that promises next to as much at its place, with the knots the data ask for.

    With few knots another law than the right one may promise a little more.
    """
    if asked.correction.searched or is_fine(asked.correction):
        return finer(evidence, asked, noise)
    least = NEXT * asked.worth(noise)[0]
    close = [s for s in others if s.correction.place is asked.correction.place and s.worth(noise)[0] > least]
    beside = [s for s in close if s is not asked and not (s.correction.searched or is_fine(s.correction))]
    return max((finer(evidence, s, noise) for s in [asked, *beside[:BESIDE]]), key=lambda s: s.worth(noise)[0])


def gone_on(
    bench: Bench, base: Hypothesis, first: Begun
) -> tuple[Sequence[Suspect], Sequence[tuple[Correction, Hypothesis]]]:
    """Return the corrections that are worth a fit, and their fits; of lines those that are there in all runs alike."""
    worth, fitted = first.worth, [bench.remembered(GoneOn(c, h), base) for c, h in first.fitted]
    least = min((h for _, h in fitted), key=lambda h: h.chi2)
    if left := untried(bench, base, first, least):
        others = raced(bench, base, left)
        worth, fitted = [*worth, *(s for s, _ in others)], [*fitted, *((s.correction, h) for s, h in others)]
    reach = max(MOVABLE * min(h.chi2 for _, h in fitted), (1.0 + base.noise_known) * base.count)
    fitted = [with_corners(bench, base, c, h) if h.chi2 < reach else (c, h) for c, h in fitted]
    fitted = ended(bench, fitted)
    kept = [steady(base, c, h) for c, h in fitted]
    return (list(compress(worth, kept)), list(compress(fitted, kept))) if any(kept) else (worth, fitted)


def untried(bench: Bench, base: Hypothesis, first: Begun, least: Hypothesis) -> list[Suspect]:
    """Return what was not fitted and may be the law all the same, with the knots the data ask for.

    Where the best fit, ``least``, may leave none but noise: what fits as well by a weight for every few readings, and
    of laws that one knot may do for those that promise nearly as much there, which where it is unknown they did not.
    """
    if not _enough(base, first, least):
        return rest(bench, base, first)
    fine = {s.correction.form for s in first.ranked if is_fine(s.correction)}
    left = rest(bench, base, first, lambda s: s.correction.form in fine or s.correction.single)
    return [s for s in left if s.correction.form in fine or s.gain > NEARLY * first.most]


def _enough(base: Hypothesis, first: Begun, least: Hypothesis) -> bool:
    """Return whether a fit may leave none but noise, and keeps nearly all that the best law promises."""
    return least.misfit <= base.noise_known and base.chi2 - least.chi2 >= KEPT * first.most


def all_tried(base: Hypothesis, first: Begun) -> bool:
    """Return whether all that promises a part of the best has raced: first fits of a large mismatch leave some."""
    least = min((h for _, h in first.fitted), key=lambda h: h.chi2)
    return first.most > LARGE and not _enough(base, first, least)


def rest(
    bench: Bench, base: Hypothesis, first: Begun, asked: Callable[[Suspect], bool] = lambda suspect: True,
    large: float = LARGE,
) -> list[Suspect]:  # fmt: skip
    """Return what promises a part of the best and was not fitted first, with the knots the data ask for."""
    evidence = bench.evidence(base)
    left = [s for s in overlooked(first.ranked, [*first.asked, *first.worth], large) if asked(s)]
    plain = [s.correction.searched or s.gain < SHARPENED * first.most for s in left]
    return [s if kept else finer(evidence, s, first.noise) for s, kept in zip(left, plain, strict=True)]


def with_corners(
    bench: Bench, base: Hypothesis, law: Correction, fitted: Hypothesis
) -> tuple[Correction, Hypothesis]:
    """Return a fit with corners, or its one knot, moved to where they are best beside the plain values it leaves.

    Or with one knot in the place of several, where first order had not said so.
    """
    for _ in range(MOVED):
        if not (isinstance(law, BrokenMap) or law.single) or fitted.misfit < base.noise_known:
            break
        plain = bench.fitted(base.fit.chain.with_values(fitted.fit.chain.values), base.effects, 0)
        evidence = bench.evidence(plain)
        if isinstance(law, BrokenMap):
            found = either_side(evidence, again(evidence, law))
        else:
            found = [one_again(evidence, law)]
        tried = [slid_on(bench, base, one.correction, fitted_from(bench, plain, one)) for one in found]
        other, better = min(tried, key=lambda pair: pair[1].chi2)
        if better.chi2 > fitted.chi2 - 1.0:
            break
        law, fitted = other, better
    return law, fitted


def slid_on(bench: Bench, base: Hypothesis, law: Correction, fitted: Hypothesis) -> tuple[Correction, Hypothesis]:
    """Return a fit whose corners, or one knot, are slid while all else follows, as often as it gets better."""
    for _ in range(SLID):
        there = _slid(bench, base, law, fitted)
        if there is None:
            break
        moved, weights = there
        chain = moved.put_in(base.fit.chain.with_values(fitted.fit.chain.values), weights)
        better = bench.fitted(chain, base.effects, ITERATIONS)
        gained = fitted.chi2 - better.chi2
        if gained > 1.0:
            law, fitted = moved, better
        if gained < max(WORTH * fitted.proven, 1.0):
            break
    return law, fitted


def _slid(
    bench: Bench, base: Hypothesis, law: Correction, fitted: Hypothesis
) -> tuple[Correction, Mapping[str, float]] | None:
    """Return a law with its corners, its one knot or its moment where the fit asks it to be; None where it does not."""
    if isinstance(law, BrokenMap):
        return slid(law, fitted.fit.chain.values)
    if law.jumps and of_one(law):
        return relevelled(bench.evidence(fitted), base.fit.chain, law)
    if isinstance(law, Sudden | SuddenDynamics):
        return retimed(bench.evidence(fitted), base.fit.chain, law)
    return retuned(bench.evidence(fitted), base.fit.chain, law) if law.searched or of_one(law) else None


def between_runs(
    bench: Bench, base: Hypothesis, law: Correction, fitted: Hypothesis
) -> tuple[Correction, Hypothesis]:
    """Return a fitted gain that leapt between two runs, as far as the data tell, as the one that holds in every run.
    """
    breaks = in_breaks(law, bench.observations)
    if not breaks:
        return law, fitted
    found, known = fitted.fit.chain.values, total_chi_squared(fitted.fit.chain, bench.observations)
    plain, weights = base.fit.chain.with_values(found), {p.name: found[p.name] for p in law.parameters()}
    there = [(total_chi_squared(c.put_in(plain, weights), bench.observations) - 2.0 * odds, c) for c, odds in breaks]
    left, best = min(there, key=lambda pair: pair[0])
    if left >= known:
        return law, fitted
    since = from_a_run_on(best)
    return since, bench.fitted(since.put_in(plain, weights), base.effects, ITERATIONS)


def in_step(bench: Bench, base: Hypothesis, law: Correction, fitted: Hypothesis) -> tuple[Correction, Hypothesis]:
    """Return a fitted line in front of the gap at a frequency close by, where it leaves less there.

    Half a turn out of step by the end of a run, no slope leads to where it is in step all along.
    """
    if law.place is Place.SENSE or not _is_part_of_a_wave(base, law, fitted):
        return law, fitted
    evidence = bench.evidence(base)
    hz = (law.knots[0] + times * TURN / evidence.longest_s for times in ASIDE)
    near = [suspect(evidence, replace(law, knots=(one,))) for one in hz if one > 0.0]
    first = [(s.correction, fitted_from(bench, base, s)) for s in near]
    best = min(first, key=lambda pair: pair[1].chi2)
    return slid_on(bench, base, *best) if best[1].chi2 < fitted.chi2 - 1.0 else (law, fitted)


def _is_part_of_a_wave(base: Hypothesis, law: Correction, fitted: Hypothesis) -> bool:
    """Return whether a law is a line that explains its part of what is left, and leaves some."""
    there = type(law) is Line and base.chi2 - fitted.chi2 >= PART * base.proven
    return there and fitted.misfit >= base.noise_known


def with_overtones(
    bench: Bench, base: Hypothesis, law: Correction, fitted: Hypothesis
) -> tuple[Correction, Hypothesis]:
    """Return a fitted line with overtones where it explains a part of what is left, and they most of what it leaves."""
    if not _is_part_of_a_wave(base, law, fitted):
        return law, fitted
    wave, found = Wave(law.place, law.knots, law.name), fitted.fit.chain.values
    weights = {name: value for name, value in found.items() if name.startswith(f"{law.name}.")}
    begun = bench.fitted(wave.put_in(base.fit.chain.with_values(found), weights), base.effects, ITERATIONS)
    other, better = slid_on(bench, base, wave, begun)
    asked = MOSTLY * fitted.proven + (better.parameters - fitted.parameters) * log(fitted.count)
    return (other, better) if better.chi2 + asked < fitted.chi2 else (law, fitted)


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
