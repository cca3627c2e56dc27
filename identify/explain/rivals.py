"""What else could it be, and how likely is that?

Odds between fitted hypotheses follow Schwarz's criterion. No probability exceeds what the record of blind trials
supports: after n right names in n trials, Laplace's rule of succession gives (n + 1) / (n + 2).
"""

from math import exp

from identify.effects.effect import Effect
from identify.explain.explanation import Alternative
from identify.explain.select import Bench, Hypothesis, Round
from identify.stage import Place

TRIALS = 15  # blind trials of single and paired effects named right, of as many: tests/proof
CEILING = (TRIALS + 1) / (TRIALS + 2)
MENTIONED = 0.01  # an alternative less likely than this is excluded
MOST = 3
HOPELESS = -1000.0  # of the criterion: an effect this far behind when it was tried is not tried again


def odds(bench: Bench, final: Hypothesis, effect: Effect, rounds: list[Round]) -> tuple[float, tuple[Alternative, ...]]:
    """Return the probability of one effect of the final hypothesis, and what could stand in its place."""
    weights: dict[tuple[str, str], float] = {}
    for rival in _rivals(final, effect, rounds):
        other = rival.effects[-1]
        weight = exp(min(0.5 * _swapped(bench, final, effect, rival).advantage(final), 0.0))
        key = (other.id, other.place.label)
        weights[key] = max(weights.get(key, 0.0), weight)
    total = 1.0 + sum(weights.values())
    likely = sorted(weights.items(), key=lambda item: -item[1])[:MOST]
    named = [Alternative(i, stage, CEILING * w / total) for (i, stage), w in likely if w / total > MENTIONED]
    return CEILING / total, tuple(named)


def _rivals(final: Hypothesis, effect: Effect, rounds: list[Round]) -> list[Hypothesis]:
    """Return what was fitted in the round that chose ``effect`` and was not hopelessly behind it."""
    taken = {_kind(e) for e in final.effects}
    found: list[Hypothesis] = []
    for step in rounds:
        if step.best is not None and _kind(step.best.effects[-1]) == _kind(effect):
            others = [h for h in step.tried if _kind(h.effects[-1]) not in taken]
            found += [h for h in others if h.advantage(step.best) > HOPELESS]
    return found


def _kind(effect: Effect) -> tuple[str, Place]:
    """Return what an effect is and where, whatever its form."""
    return effect.id, effect.place


def _swapped(bench: Bench, final: Hypothesis, effect: Effect, rival: Hypothesis) -> Hypothesis:
    """Fit the final hypothesis with one effect replaced by what a rival has in its place."""
    effects = tuple(rival.effects[-1] if e is effect else e for e in final.effects)
    values = {**final.fit.chain.values, **rival.fit.chain.values}
    return bench.fitted(bench.with_effects(effects, values), effects)
