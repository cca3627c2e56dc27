"""Would another law do better in the place of one that was found before the others were?

An effect chosen first also had to cover for those found after it; beside them another law may do better.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from identify.effects.effect import Effect
from identify.explain.hypothesis import Hypothesis
from identify.explain.round import COMPARED, Round

if TYPE_CHECKING:
    from identify.explain.select import Bench

EXCHANGED = 4  # rivals that an effect chosen early is exchanged for
LAPS = 12  # iterations after which an exchange that is far behind is not fitted further
FULLER = 500.0  # of chi-squared: by as much one more value of a law may bring it ahead


def exchanged(bench: "Bench", hypothesis: Hypothesis, rounds: Sequence[Round]) -> Hypothesis:
    """Exchange single effects for what could not be excluded when they were chosen, where that pays.

    Then each for a law of fewer numbers, where its own have come to where the two hardly differ.
    """
    for number, effect in enumerate(hypothesis.effects[:-1]):
        rest = {e.id for e in hypothesis.effects if e is not effect}
        rivals = [r for r in rounds[number].undecided if r.effects[-1].id not in rest][:EXCHANGED]
        options = [swapped(bench, hypothesis, effect, r) for r in rivals if r.effects[-1] != effect]
        hypothesis = max([hypothesis, *options], key=lambda h: h.advantage(hypothesis))
    for effect in hypothesis.effects:
        hypothesis = plainer(bench, hypothesis, effect)
    return hypothesis


def plainer(bench: "Bench", hypothesis: Hypothesis, effect: Effect) -> Hypothesis:
    """Put the law with fewer numbers that an effect has become in its place, where that pays."""
    law, values = effect.plainer(hypothesis.fit.chain) or (effect, {})
    if law.id in hypothesis.names:
        return hypothesis
    effects = hypothesis.effects_with(law, effect)
    found = bench.fitted(bench.with_effects(effects, {**hypothesis.fit.chain.values, **values}), effects)
    return found if found.advantage(hypothesis) > 0.0 else hypothesis


def swapped(bench: "Bench", hypothesis: Hypothesis, effect: Effect, rival: Hypothesis) -> Hypothesis:
    """Fit ``hypothesis`` with one effect replaced by the last one of a rival, in the form that then does best.

    Beside effects that were found later a law may tell more of its values than it did alone.
    """
    law = rival.effects[-1]
    effects = hypothesis.effects_with(law, effect)
    values = {**hypothesis.fit.chain.values, **rival.fit.chain.values}
    found = bench.fitted(bench.with_effects(effects, values), effects, LAPS)
    if not found.fit.converged and found.advantage(hypothesis) > -COMPARED:
        found = bench.fitted(found.fit.chain, effects)
    if found.chi2 - hypothesis.chi2 > FULLER:
        return found
    return max([found, *(bench.reformed(found, law, form) for form in law.fuller())], key=lambda h: h.advantage(found))
