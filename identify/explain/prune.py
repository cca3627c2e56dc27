"""Which effects of a hypothesis, and which of their numbers, do no longer pay for themselves?"""

from identify.explain.bench import Bench
from identify.explain.hypothesis import Hypothesis


def pruned(bench: Bench, hypothesis: Hypothesis) -> Hypothesis:
    """Drop effects that no longer pay for themselves and for all laws tried, the weakest first.

    Not the one beside whose chance the data are weighed: the weights are part of it.
    """
    kept = bench.carried.law if bench.carried else None
    while len(hypothesis.effects) > 1:
        without = [bench.without(hypothesis, effect) for effect in hypothesis.effects if effect != kept]
        best = max(without, key=lambda h: h.advantage(hypothesis))
        if best.advantage(hypothesis) < -2.0 * bench.surprise:
            break
        hypothesis = best
    return simplified(bench, hypothesis)


def simplified(bench: Bench, hypothesis: Hypothesis) -> Hypothesis:
    """Take simpler forms of effects, with fewer parameters, where the others do not pay."""
    for effect in hypothesis.effects:
        found = [bench.reformed(hypothesis, effect, simpler) for simpler in effect.simpler()]
        best = max(found, key=lambda h: h.advantage(hypothesis), default=hypothesis)
        if best.advantage(hypothesis) > 0.0:
            return simplified(bench, best)
    return hypothesis
