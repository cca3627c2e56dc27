"""What else could it be, and how likely is that?

Odds between fitted hypotheses follow Schwarz's criterion. No probability exceeds what the record of blind trials
supports: after n right names in n trials, Laplace's rule of succession gives (n + 1) / (n + 2).
"""

from math import exp

from identify.effects.effect import Effect
from identify.explain.explanation import Alternative
from identify.explain.select import Bench, Hypothesis, Round

TRIALS = 15  # blind trials of single and paired effects named right, of as many: tests/proof
CEILING = (TRIALS + 1) / (TRIALS + 2)
MENTIONED = 0.01  # an alternative less likely than this is excluded
MOST = 3


def odds(bench: Bench, final: Hypothesis, effect: Effect, rounds: list[Round]) -> tuple[float, tuple[Alternative, ...]]:
    """Return the probability of one effect of the final hypothesis, and what could stand in its place."""
    others = _substitutes(final, effect, rounds)
    weights = {}
    for other in others:
        swapped = _swapped(bench, final, effect, other, rounds)
        weight = exp(min(0.5 * swapped.advantage(final), 0.0))
        key = (other.id, other.place.label)
        weights[key] = max(weights.get(key, 0.0), weight)
    total = 1.0 + sum(weights.values())
    likely = sorted(weights.items(), key=lambda item: -item[1])[:MOST]
    named = [Alternative(i, stage, CEILING * w / total) for (i, stage), w in likely if w / total > MENTIONED]
    return CEILING / total, tuple(named)


def _substitutes(final: Hypothesis, effect: Effect, rounds: list[Round]) -> list[Effect]:
    """Return the effects fitted in the round that chose ``effect``, other than what the final hypothesis has."""
    taken = {(e.id, e.place) for e in final.effects}
    found: list[Effect] = []
    for step in rounds:
        if step.best is not None and (step.best.effects[-1].id, step.best.effects[-1].place) == (effect.id, effect.place):
            found += [h.effects[-1] for h in step.tried if (h.effects[-1].id, h.effects[-1].place) not in taken]
    return found


def _swapped(bench: Bench, final: Hypothesis, effect: Effect, other: Effect, rounds: list[Round]) -> Hypothesis:
    """Fit the final hypothesis with one effect replaced, from the values the selection had found for the other."""
    effects = tuple(other if e is effect else e for e in final.effects)
    for step in rounds:
        for tried in step.tried:
            if tried.effects[-1] is other:
                values = {**final.fit.chain.values, **tried.fit.chain.values}
                return bench.fitted(bench.with_effects(effects, values), effects)
    return bench.fitted(bench.with_effects(effects, final.fit.chain.values), effects)
