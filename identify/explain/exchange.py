"""Would another law do better in the place of one that was found before the others were?

An effect chosen first also had to cover for those found after it; beside them another law may do better. And what was
found after it also covers for what it does wrongly: beside that other law, again another may do better.
"""

from collections.abc import Sequence
from functools import partial
from itertools import combinations
from math import inf
from typing import TYPE_CHECKING

from identify.effects.effect import Effect
from identify.explain.hypothesis import STRONG, Hypothesis
from identify.explain.round import COMPARED, FULLER, NEXT, Round

if TYPE_CHECKING:
    from identify.explain.bench import Bench

EXCHANGED = 7  # rivals that an effect chosen early is exchanged for
CROSSED = 3  # pairs of laws that are fitted in the place of the last two
MISTAKEN = 0.02  # of what was explained: by as much first order may be mistaken about such a pair
LATE = 0.02  # of what a law that makes signals late explains: by as much a lag may be behind and be a part of it
TOLD = 4.0  # standard deviations from which a number is told
LAPS = 12  # iterations after which an exchange that is far behind is not fitted further


def exchanged(bench: "Bench", hypothesis: Hypothesis, rounds: Sequence[Round], needed: float = inf) -> Hypothesis:
    """Exchange single effects for what could not be excluded when they were chosen, where that pays.

    The last two together, too, and the last for two lags. Then each for a law of fewer numbers, where its own have come
    to where the two hardly differ. Nothing is fitted to its end that is not about to bring chi-squared to ``needed``.
    """
    if len(rounds) > 1:
        before, this = rounds[-2:]
        options = crossed(bench, hypothesis, before, this, needed)
        hypothesis = max([hypothesis, *options], key=lambda h: h.advantage(hypothesis))
    hypothesis = parted(bench, hypothesis, rounds[-1]) if rounds else hypothesis
    for number, effect in enumerate(hypothesis.effects[:-1]):
        rest = [e for e in hypothesis.effects if e is not effect]
        rivals = [r for r in rounds[number].undecided if r.effects[-1].fits(rest)][:EXCHANGED]
        options = [swapped(bench, hypothesis, effect, r, needed) for r in rivals if r.effects[-1] != effect]
        hypothesis = max([hypothesis, *options], key=lambda h: h.advantage(hypothesis))
    for effect in hypothesis.effects:
        hypothesis = plainer(bench, hypothesis, effect)
    return hypothesis


def crossed(
    bench: "Bench", hypothesis: Hypothesis, before: Round, this: Round, needed: float = inf
) -> list[Hypothesis]:
    """Fit two laws in the place of the last two where these promise more: to first order, or in proportion to each.

    Either a rival of the round before and a law tried in this one, or two of the round before that do best by twos.
    What is not about to reach the chi-squared ``needed`` is not fitted to its end.
    """
    base, promises = before.base, []
    for pair in before.pairs:
        effects = (*base.effects, *(p.candidate.effect for p in (pair.one, pair.other)))
        values = {**pair.one.chain.values, **pair.other.chain.values, **base.fit.chain.values}
        promises.append((base.chi2 - pair.gain, bench.with_effects(effects, values), effects))
    for rival in [r for r in before.undecided if r.effects != this.base.effects][:EXCHANGED]:
        evidence = bench.evidence(rival)
        for tried in [h for h in this.tried if h.effects[-1].fits(rival.effects)]:
            effects = (*rival.effects, tried.effects[-1])
            chain = bench.with_effects(effects, {**tried.fit.chain.values, **rival.fit.chain.values})
            seen = evidence.seen_by(effects[-1])
            promises.append((rival.chi2 - _gain(*seen.products(seen.change(chain))), chain, effects))
    reach = hypothesis.chi2 + MISTAKEN * max(base.chi2 - hypothesis.chi2, 0.0)
    others = [p for p in promises if p[0] < reach and {*p[2]} != {*hypothesis.effects}]
    worth = sorted(others, key=lambda p: p[0])[:CROSSED]
    found = [bench.fitted(chain, effects, LAPS) for _, chain, effects in worth]
    near = [h.fit.converged or h.chi2 - h.hope > min(hypothesis.chi2, needed) for h in found]
    ended = [h if done else bench.fitted(h.fit.chain, h.effects) for h, done in zip(found, near, strict=True)]
    return [h for h in ended if bench.possible(h)]


def _gain(along: float, energy: float) -> float:
    """Return the fall of chi-squared that a change promises as it is, or at the size that suits it best."""
    return max(2.0 * along - energy, along**2 / energy if along > 0.0 and energy > 0.0 else 0.0)


def parted(bench: "Bench", hypothesis: Hypothesis, this: Round) -> Hypothesis:
    """Put two lags of one number each in the place of a law of two that makes signals late, where that clearly pays.

    Far above the noise a resonance that hardly rings is nearly two lags, and each of these alone nearly all of it.
    """
    law, told = hypothesis.effects[-1], this.base.chi2 - hypothesis.chi2
    if not law.lags or len(law.parameters()) < 2 or this.base.effects != hypothesis.effects[:-1]:
        return hypothesis
    lags = [h for h in this.tried if h.effects[-1].lags and len(h.effects[-1].parameters()) == 1]
    near = [h for h in lags if h.chi2 - hypothesis.chi2 < LATE * told]
    found = [_both(bench, *pair) for pair in combinations(near, 2) if not _alike(*(h.effects[-1] for h in pair))]
    best = max((h for h in found if bench.possible(h)), key=lambda h: h.advantage(hypothesis), default=hypothesis)
    return best if best.advantage(hypothesis) > STRONG else hypothesis


def _alike(one: Effect, other: Effect) -> bool:
    """Return whether two lags are the same data, whatever is played: together they are one that is longer."""
    same = (one.id, one.place) == (other.id, other.place)  # one law, tried from two starts
    return same or any(c.id == other.id and c.there in (None, other.place) for c in one.equals)


def _both(bench: "Bench", one: Hypothesis, other: Hypothesis) -> Hypothesis:
    """Fit the last laws of two hypotheses, both lags, together: from half of each."""
    law = other.effects[-1].told_apart(one.fit.chain)
    ((mine,), (its,), (theirs,)) = (effect.parameters() for effect in (one.effects[-1], law, other.effects[-1]))
    halves = {mine.name: 0.5 * one.fit.chain.values[mine.name], its.name: 0.5 * other.fit.chain.values[theirs.name]}
    effects = (*one.effects, law)
    return bench.fitted(bench.with_effects(effects, {**one.fit.chain.values, **halves}), effects)


def plainer(bench: "Bench", hypothesis: Hypothesis, effect: Effect) -> Hypothesis:
    """Put the law with fewer numbers that an effect has become in its place, where that pays."""
    law, values = effect.plainer(hypothesis.fit.chain) or (effect, {})
    if not law.fits(hypothesis.effects):
        return hypothesis
    effects = hypothesis.effects_with(law, effect)
    found = bench.fitted(bench.with_effects(effects, {**hypothesis.fit.chain.values, **values}), effects)
    return found if found.advantage(hypothesis) > 0.0 else hypothesis


def swapped(
    bench: "Bench", hypothesis: Hypothesis, effect: Effect, rival: Hypothesis, needed: float = inf
) -> Hypothesis:
    """Fit ``hypothesis`` with one effect replaced by the last one of a rival, in the form that then does best.

    Beside effects that were found later a law may tell more of its values than it did alone. It is not fitted to its
    end where it is not about to reach the chi-squared ``needed``. The other effects have come farther than beside the
    rival.
    """
    law = rival.effects[-1]
    effects = hypothesis.effects_with(law, effect)
    others = {p.name for other in hypothesis.effects if other is not effect for p in other.parameters()}
    known = hypothesis.fit.chain.values
    come = {name: value for name, value in known.items() if name.partition("[")[0] in others}
    values = {**known, **rival.fit.chain.values, **come}

    def fitted() -> Hypothesis:
        found = bench.fitted(bench.with_effects(effects, values), effects, LAPS)
        near = found.advantage(hypothesis) > -COMPARED and found.chi2 - found.hope < needed
        if near and not found.fit.converged:
            return bench.fitted(found.fit.chain, effects)
        return found

    found = bench.once(effects, fitted)
    if found.chi2 - hypothesis.chi2 > FULLER and _far(bench, hypothesis, effect, found):
        return found
    fuller = [_filled(bench, found, law, form) for form in law.fuller()]
    return max([found, *fuller, *_simpler(bench, found, law)], key=lambda h: h.advantage(found))


def _far(bench: "Bench", hypothesis: Hypothesis, effect: Effect, found: Hypothesis) -> bool:
    """Return whether a law in the place of an effect is behind by more than one more value of it may bring.

    Of a large mismatch that is a part of what the effect explains.
    """
    told = bench.without(hypothesis, effect).chi2 - hypothesis.chi2
    return found.chi2 - hypothesis.chi2 > NEXT * told


def _simpler(bench: "Bench", found: Hypothesis, law: Effect) -> list[Hypothesis]:
    """Fit the forms of a law that lack a number which is not told beside the others, as it may have been alone."""
    fitted = []
    for form in law.simpler():
        lost = {p.name for p in law.parameters()} - {p.name for p in form.parameters()}
        if all(abs(found.fit.chain.values[name]) < TOLD * found.fit.sd(name) for name in lost):
            effects = found.effects_with(form, law)
            fitted.append(bench.once(effects, partial(bench.reformed, found, law, form)))
    return fitted


def _filled(bench: "Bench", found: Hypothesis, law: Effect, form: Effect) -> Hypothesis:
    """Fit a fuller form of a law, to its end where it is about to explain more than the law, which it contains."""

    def fitted() -> Hypothesis:
        begun = bench.reformed(found, law, form, LAPS)
        if begun.fit.converged or begun.chi2 - begun.hope > found.chi2:
            return begun
        return bench.fitted(begun.fit.chain, begun.effects)

    return bench.once(found.effects_with(form, law), fitted)
