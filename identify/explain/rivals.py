"""What else could it be, and how likely is that?

Fitted hypotheses are weighed by their odds on the same data (Schwarz's criterion, a parameter at the price of the
logarithm of what the mismatch tells). Beside them stand what no catalogue names, a piece of physics whose likeness in
the catalogue is the better, the less of it the name leaves, and nothing at all; and a law that much does which has no
name is its own with even chances.
"""

from collections.abc import Sequence
from math import e, exp, log, sqrt

from identify.blocks import Play
from identify.effects import catalogue
from identify.effects.effect import Effect
from identify.explain.bench import Bench
from identify.explain.exchange import swapped
from identify.explain.explanation import Alternative
from identify.explain.hypothesis import Hypothesis
from identify.explain.locate import Located
from identify.explain.round import Kind, Round, kind_of

MENTIONED = 0.02  # an alternative less likely than this is excluded
MOST = 3  # names in all
WEIGHED = 8  # rivals that are fitted beside the other effects found
UNHEARD = 0.1  # share of what goes wrong in circuits that no catalogue lists: an assumption
OTHERWISE = 0.05  # how often the right law leaves something that shows: values in a rig file, a second small effect
LATE = 2.5  # samples: what lasts less may be the moments at which readings are taken
UNSEEN = 9.0  # of chi-squared: what may be left of a mismatch without anybody seeing it


def odds(
    bench: Bench, final: Hypothesis, effect: Effect, rounds: list[Round], beyond: Located
) -> tuple[float, tuple[Alternative, ...]]:
    """Return the probability of one effect of the final hypothesis, and what could stand in its place."""
    own = kind_of(effect)
    weights: dict[Kind, float] = {}
    told = _information(effect, rounds)
    for other, rival in _rivals(bench, final, effect, rounds):
        weight = exp(min(0.5 * _ahead(bench, rival, final, told), 0.0))
        weights[kind_of(other)] = max(weights.get(kind_of(other), 0.0), weight)
    if bench.plain.stage_of(Play) is not None:
        weights |= dict.fromkeys(_equals(final, effect), 1.0)
    weights.pop(own, None)
    total = 1.0 + sum(weights.values()) + unheard(beyond, told) + _nothing(bench, final, effect, told)
    total += 1.0 if ordinary(bench, final, effect) else 0.0
    likely = _of_every_name(own, sorted(weights.items(), key=lambda item: -item[1]))
    named = [Alternative(i, place.label, w / total) for (i, place), w in likely if w / total > MENTIONED]
    return 1.0 / total, tuple(named)


def ordinary(bench: Bench, final: Hypothesis, effect: Effect) -> bool:
    """Return whether much that no catalogue lists does as an effect of a hypothesis does.

    Where readings scatter unlike each other, so do those that come at uneven moments, as what lasts two samples or less
    does: they are late on average.
    """
    much = effect.ordinary(final.fit.chain)
    if much or all(o.colour.sizes is None for o in bench.observations):
        return much
    late_s = sum(final.fit.chain.values[p.name] for p in effect.parameters() if p.unit == "s")
    return 0.0 < late_s < LATE / bench.observations[0].trace.rate_hz


def _equals(final: Hypothesis, effect: Effect) -> list[Kind]:
    """Return what gives the same data as an effect, whatever is played: no fit need tell that."""
    beside = {kind_of(other) for other in final.effects}  # a chain has no effect twice at a place
    kinds = [(c.id, c.there or catalogue()[c.id].places[0]) for c in effect.equals]
    return [kind for kind in kinds if kind not in beside]


def _ahead(bench: Bench, rival: Hypothesis, final: Hypothesis, told: float) -> float:
    """Return by how much a rival is ahead of the final hypothesis, twice a log of odds.

    Where the data are weighed beside a law that is known roughly, one more number may mend what that leaves: it counts
    once it explains more.
    """
    mends = rival.parameters > final.parameters and final.chi2 - rival.chi2 < bench.rough
    return rival.advantage(final, told) - (max(rival.fall(final), 0.0) if mends else 0.0)


def _of_every_name(own: Kind, ranked: Sequence[tuple[Kind, float]]) -> list[tuple[Kind, float]]:
    """Return as many as are said, the likeliest first: a name at a second place only where there is room for it."""
    said = {own[0]}
    found: list[tuple[Kind, float]] = []
    again: list[tuple[Kind, float]] = []
    for kind, weight in ranked:
        (again if kind[0] in said else found).append((kind, weight))
        said.add(kind[0])
    return sorted([*found, *again][: MOST - 1], key=lambda item: -item[1])


def unheard(beyond: Located, told: float) -> float:
    """Return the odds, against a name that explains a mismatch, of physics that no catalogue lists.

    Physics drawn at random is mimicked by a law of the catalogue up to a share of its square that is uniform in its
    root. If the name is right, what free-form corrections still find is chance, with its p-value as evidence against
    it (Sellke, Bayarri and Berger, The American Statistician 55 (2001) 62).
    """
    left = max(left_to_explain(beyond), UNSEEN)
    p = min(beyond.p_value, 1.0 / e)
    chance = -e * p * log(p) if p > 0.0 else 0.0
    share = min(left / max(told, UNSEEN), 1.0)
    return UNHEARD / (1.0 - UNHEARD) * sqrt(share) / (chance + OTHERWISE)


def left_to_explain(beyond: Located) -> float:
    """Return by how much free-form corrections still make chi-squared fall, disguises of plainer ones aside."""
    told = [fitted.chi2 for free, fitted in beyond.fitted if not beyond.foretold(free, fitted)]
    return beyond.base.chi2 - min(told, default=beyond.base.chi2)


def _rivals(bench: Bench, final: Hypothesis, effect: Effect, rounds: list[Round]) -> list[tuple[Effect, Hypothesis]]:
    """Return what came near in the round that chose ``effect``, fitted beside the other effects of the final set.

    What was found later may have brought others near that were not then, as long as they leave no more than it took.
    """
    step = _round_of(effect, rounds)
    if step is None:
        return []
    beside = [other for other in final.effects if other != effect]
    later = [h for h in step.undecided if not any(h is other for other in step.near)] if beside else []
    able = [h for h in (*step.near, *later) if kind_of(h.effects[-1]) != kind_of(effect)]
    near = [h for h in able if h.effects[-1].fits(beside)][:WEIGHED]
    if not beside:
        return [(h.effects[-1], h) for h in near]
    return [(h.effects[-1], swapped(bench, final, effect, h)) for h in near]


def _nothing(bench: Bench, final: Hypothesis, effect: Effect, told: float) -> float:
    """Return the odds, against an effect, that it is not there: that chance made what it explains."""
    without = bench.without(final, effect)
    return exp(min(bench.surprise + 0.5 * without.advantage(final, told), 0.0))


def _information(effect: Effect, rounds: list[Round]) -> float:
    """Return what the mismatch tells that ``effect`` was chosen for."""
    step = _round_of(effect, rounds)
    return step.information if step else 0.0


def _round_of(effect: Effect, rounds: list[Round]) -> Round | None:
    """Return the round that chose ``effect`` or what it was exchanged for, None when there is none."""
    for number, step in enumerate(rounds):
        kinds = [kind_of(other) for other in step.best.effects] if step.best else []
        if kind_of(effect) in kinds:
            return rounds[min(kinds.index(kind_of(effect)), number)]  # a round may choose two in the place of one
    return None
