"""What else could it be, and how likely is that?

Odds between fitted hypotheses follow Schwarz's criterion. No probability exceeds what the record of blind trials
supports: after n right and m wrong names, Laplace's rule of succession gives (n + 1) / (n + m + 2).
"""

from math import exp

from identify.blocks import Play
from identify.effects import catalogue
from identify.effects.effect import Effect
from identify.explain.explanation import Alternative
from identify.explain.select import Bench, Hypothesis, Round
from identify.stage import Place

# Names given to cases drawn unseen: tests/proof/validate.py, seeds 2000-2054, 3000-3023 and 4000-4027.
NAMED_RIGHT, NAMED_WRONG = 78, 8
CEILING = (NAMED_RIGHT + 1) / (NAMED_RIGHT + NAMED_WRONG + 2)
MENTIONED = 0.01  # an alternative less likely than this is excluded
MOST = 3


def odds(bench: Bench, final: Hypothesis, effect: Effect, rounds: list[Round]) -> tuple[float, tuple[Alternative, ...]]:
    """Return the probability of one effect of the final hypothesis, and what could stand in its place."""
    weights: dict[tuple[str, str], float] = {}
    for rival in _rivals(final, effect, rounds):
        other = rival.effects[-1]
        weight = exp(min(0.5 * bench.swapped(final, effect, rival).advantage(final), 0.0))
        key = (other.id, other.place.label)
        weights[key] = max(weights.get(key, 0.0), weight)
    if bench.plain.stage_of(Play) is not None:
        same = [c for c in effect.confused_with if c.exact and c.here in (None, effect.place)]
        weights |= {(c.id, (c.there or _place_of(c.id, effect.place)).label): 1.0 for c in same}
    total = 1.0 + sum(weights.values())
    likely = sorted(weights.items(), key=lambda item: -item[1])[:MOST]
    named = [Alternative(i, stage, CEILING * w / total) for (i, stage), w in likely if w / total > MENTIONED]
    return CEILING / total, tuple(named)


def _rivals(final: Hypothesis, effect: Effect, rounds: list[Round]) -> list[Hypothesis]:
    """Return what came close in the round that chose ``effect`` or what it was exchanged for."""
    taken = {_kind(e) for e in final.effects}
    for step in rounds:
        kinds = [_kind(e) for e in step.best.effects] if step.best else []
        if _kind(effect) in kinds:
            close = rounds[kinds.index(_kind(effect))].close
            return [h for h in close if _kind(h.effects[-1]) not in taken]
    return []


def _place_of(name: str, near: Place) -> Place:
    """Return where physics of the catalogue sits: at ``near`` if it may, else at its first place."""
    places = catalogue()[name].places if name in catalogue() else (near,)
    return near if near in places else places[0]


def _kind(effect: Effect) -> tuple[str, Place]:
    """Return what an effect is and where, whatever its form."""
    return effect.id, effect.place
