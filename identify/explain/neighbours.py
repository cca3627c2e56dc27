"""Do other values of the same laws explain the recordings as well as those that were found?

A law of several numbers can come to rest at more than one place: a resonance beside a pole, a second play whose turns
fall between samples. The curvature at one of them says nothing of the others. So the values of every such law are
pushed several standard deviations aside, all others following, and fitted once more from there.
"""

from collections.abc import Sequence

import numpy as np

from identify.candidates import evidence_starts
from identify.chain import Chain
from identify.effects.effect import Effect
from identify.explain.bench import Bench
from identify.explain.hypothesis import Hypothesis
from identify.explain.race import SPRINT
from identify.fit import Fit
from identify.interval import Interval

ASIDE = (-6.0, 6.0)  # standard deviations
SEVERAL = 2  # numbers of one law from which it may come to rest at several places
WITHIN = 3.84  # of chi-squared above the best: values that a 95 % interval holds
HOPEFUL = 50.0  # of chi-squared above the best after the first iterations, from which a fit is not continued
BETTER = 0.5  # of chi-squared by which another place has to be better to take its place
ELSEWHERE = 0.3  # standard deviations from the best at which a fit is at another place
ITERATIONS = 12
MOVES = 8  # times the best may move


def settled(bench: Bench, best: Hypothesis) -> tuple[Hypothesis, tuple[Fit, ...]]:
    """Return the best fit of the same effects, and those at other places that a 95 % interval must hold.

    So must it those of another form with the same numbers. Where what effects make by chance swells the noise, or
    readings are weighed beside that, no fit is finer than that, and intervals are widened by it.
    """
    if best.swell > 1.0 or bench.carried:
        return best, _other_forms(bench, best)
    best = bench.finely(_upright(bench, best))
    others: list[Hypothesis] = []
    for _ in range(MOVES):
        others = [bench.finely(h) for h in _neighbours(bench, best)]
        better = min(others, key=lambda h: h.chi2, default=best)
        if better.chi2 > best.chi2 - BETTER:
            break
        best = better
    near = [h.fit for h in others if h.chi2 < best.chi2 + WITHIN]
    return best, (*(f for f in near if best.fit.distance(f) > ELSEWHERE), *_other_forms(bench, best))


def _other_forms(bench: Bench, best: Hypothesis) -> tuple[Fit, ...]:
    """Return the fits of the same effects with one in a fuller form, or another of the same numbers, as good as these.

    One number more that the data do not ask for may be there all the same: a resistor in line with a diode.
    """
    begun = [bench.reformed(best, effect, form, SPRINT) for effect in best.effects for form in effect.fuller()]
    found = _continued(bench, best, begun)
    return tuple(h.fit for h in found if h.chi2 < best.chi2 + WITHIN * best.swell)


def _continued(bench: Bench, best: Hypothesis, begun: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return fits that were begun brought to their end, without those that stay far from the best."""
    near = [h for h in begun if h.chi2 < best.chi2 + HOPEFUL * best.swell]
    return [h if h.fit.converged else bench.fitted(h.fit.chain, h.effects) for h in near]


def resettled(bench: Bench, hypothesis: Hypothesis) -> Hypothesis:
    """Return the hypothesis with values that no slope leads to looked for once more, now that the rest is known.

    Where that finds none better, asking it again costs nothing.
    """
    best = bench.remembered(_compared_again, hypothesis)
    chain = best.fit.chain
    for effect in best.effects:
        chain = effect.resettled(chain, bench.observations)
    best = best if chain is best.fit.chain else bench.fitted(chain, best.effects)
    for _ in range(MOVES):
        other = bench.remembered(_leapt, best)
        if other.chi2 > best.chi2 - BETTER:
            break
        best = other
    return best


def _leapt(bench: Bench, best: Hypothesis) -> Hypothesis:
    """Return the best fit from values of the effects to which no slope leads, the hypothesis itself without any."""
    leaps = [leap for effect in best.effects for leap in effect.leaps(best.fit.chain, bench.observations)]
    begun = [bench.fitted(leap, best.effects, SPRINT) for leap in leaps]
    return min(_continued(bench, best, begun), key=lambda h: h.chi2, default=best)


def _compared_again(bench: Bench, best: Hypothesis) -> Hypothesis:
    """Return the hypothesis with sizes that are found by comparing all compared once more beside the other effects.

    What was not known yet when a size was found had been taken for a part of what it does.
    """
    for effect in (e for e in best.effects if e.compared and len(best.effects) > 1):
        without = bench.without(best, effect)
        for values in evidence_starts(bench.evidence(without).seen_by(effect), effect):
            begun = bench.with_effects(best.effects, {**without.fit.chain.values, **effect.named(values)})
            best = min(best, bench.fitted(begun, best.effects), key=lambda h: h.chi2)
    return best


def spanning(name: str, inflation: float, fit: Fit, others: tuple[Fit, ...]) -> Interval:
    """Return the 95 % interval of a value, wide enough for every place at which the data may put it."""
    low, high = zip(*(f.ci95(name, inflation) for f in (fit, *others)), strict=True)
    return Interval(float(fit.chain.values[name]), min(low), max(high))


def _upright(bench: Bench, best: Hypothesis) -> Hypothesis:
    """Return the hypothesis with the values of every effect in their one form."""
    chain = best.fit.chain
    for effect in best.effects:
        chain = effect.upright(chain)
    return best if chain is best.fit.chain else bench.fitted(chain, best.effects)


def _neighbours(bench: Bench, best: Hypothesis) -> list[Hypothesis]:
    """Return the fits that start aside of the best and come to rest at another place, nearly as good or better."""
    found: list[Hypothesis] = []
    for name in (name for effect in best.effects for name in _numbers(effect)):
        for aside in ASIDE:
            start = _pushed(best.fit, name, aside)
            if start is None:
                continue
            first = bench.fitted(start, best.effects, SPRINT)
            if first.chi2 < best.chi2 + HOPEFUL and best.fit.distance(first.fit) > ELSEWHERE:
                last = first if first.fit.converged else bench.fitted(first.fit.chain, best.effects, ITERATIONS)
                found += [last] if best.fit.distance(last.fit) > ELSEWHERE else []
    return found


def _numbers(effect: Effect) -> list[str]:
    """Return the full names of what is pushed aside: numbers in which a law of several is not linear."""
    shared = [p for p in effect.parameters() if not p.local]
    return [p.name for p in shared if p.coordinate == "log"] if len(shared) >= SEVERAL else []


def _pushed(fit: Fit, name: str, aside: float) -> Chain | None:
    """Return the chain with one value pushed aside by so many standard deviations and all others following.

    None where the value was not searched.
    """
    names = [c.name for c in fit.coordinates]
    if name not in names:
        return None
    column = fit.covariance[:, names.index(name)]
    there = fit.theta + aside * column / np.sqrt(column[names.index(name)])
    pairs = zip(fit.coordinates, there, strict=True)
    return fit.chain.with_values({c.name: c.value(c.bounded(float(theta))) for c, theta in pairs})
