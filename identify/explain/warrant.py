"""Is a name earned: does the physics explain what it should, as well as a free-form correction in its place would?"""

from dataclasses import dataclass, replace
from math import log

from identify.blocks import Play
from identify.effects.effect import Effect
from identify.effects.hum import Hum, near_mains
from identify.explain.anew import goes_on
from identify.explain.bench import Bench
from identify.explain.hypothesis import LEAST_TOLD, STRONG, Hypothesis
from identify.explain.locate import SAME, Located, located, told_by_one, within_reach
from identify.explain.rivals import left_to_explain, unheard
from identify.explain.round import FORETOLD, Round
from identify.explain.suspect import is_fine
from identify.fit import Fit, total_chi_squared
from identify.stage import Place
from identify.unnamed.correction import Correction
from identify.unnamed.lines import GapRipple, Line

NEGLIGIBLE = 0.05  # share of what an effect explains that may remain without casting doubt on its name
BY_THE_CLOCK = 0.5  # the same of what goes with the clock, where the effect does not: its law could not make that
SAME_PLACE = 0.4  # share of what a name leaves, and a free-form correction finds, that one at its own place may explain


@dataclass(frozen=True)
class Warranted:
    """The hypothesis whose names are earned, and what a free-form search finds on top of it.

    ``elsewhere`` are fits of the same effects at other values that the data do not exclude.
    """

    hypothesis: Hypothesis
    beyond: Located
    elsewhere: tuple[Fit, ...] = ()


def warranted(bench: Bench, plain: Hypothesis, final: Hypothesis, rounds: list[Round]) -> Warranted:
    """Return the effects that earn their names.

    When nothing remains beyond the noise, all do: a wrong set of names does not reproduce recordings of several kinds.
    Else the effect found last has to be more likely than physics of no catalogue, and not to leave more than a little
    that a free-form correction at its own place could take away: then the place may be right, but the law is not. What
    its own chance makes does not speak against it. Nor must such a correction at another place do better without it,
    or one alone better than all names: where readings are weighed beside noise in front of the gap, than all beside
    that, which was held against corrections before (identify.explain.beside). If it does not earn its name, the one
    before it is asked. And no name is earned by a law that does better at a place where it would be other physics.
    """
    steps = [(this.base, this.best) for this in rounds if this.best is not None]
    strayed = misplaced(bench, final)
    earned = [(base, winner) for base, winner in steps if not strayed & set(winner.names)]
    start = bench.again(rounds[1].base) if bench.carried and len(rounds) > 1 else plain
    hypothesis = final if len(earned) == len(steps) else earned[-1][1] if earned else start
    asked = len(hypothesis.effects) > 1 + len(start.effects) or _challenged(bench, start, hypothesis)
    alone = located(bench, start) if asked and within_reach(bench, start, hypothesis.chi2) else None
    if alone is not None and _outdone(alone, hypothesis, bench.surprise):
        return Warranted(start, alone)
    chance = [e for e in hypothesis.effects if e.by_chance]
    lined = bool(chance) and goes_on(hypothesis.fit.chain, bench.observations)
    for effect in (e for e in chance if lined or hypothesis.swell > 1.0):  # chance is believed last
        under = located(bench, bench.without(hypothesis, effect))
        if lined or _foretells(under, hypothesis):
            return Warranted(under.base, under)
    beyond = located(bench, hypothesis)
    while hypothesis.effects and beyond.significant and earned:
        base, winner = earned.pop()
        rest = start if base.effects == start.effects else earned[-1][1] if earned else plain
        under = alone if alone is not None and rest is start else located(bench, rest)
        effect = winner.effects[-1]
        needless = bench.plain.stage_of(Play) is not None and _needless(beyond, under, effect.place)
        if not needless and not _doubtful(beyond, effect, base.chi2 - winner.chi2):
            break
        hypothesis, beyond = rest, under
    return Warranted(hypothesis, beyond)


def _challenged(bench: Bench, plain: Hypothesis, names: Hypothesis) -> bool:
    """Return whether a correction of free form promises, to first order, more than one name explains, numbers paid for.

    Or its first fit leaves none but noise of what the name hardly tells. Not where it acts by chance, which no law
    foretells.
    """
    if not names.effects or names.swell > 1.0:
        return False
    if told_by_one(bench, plain, names):
        return True
    asked_of, ranked = bench.suspects_near(plain, SAME * plain.chi2)
    told = asked_of - names.chi2 - _price(plain, names)
    return any(s.gain - 2.0 * s.worth(1.0)[1] > told for s in ranked if not is_fine(s.correction))


def _outdone(alone: Located, names: Hypothesis, surprise: float) -> bool:
    """Return whether one correction of free form does clearly better than all names together, its numbers paid for.

    Were these right, nothing could: laws that stand in for one of no catalogue leave something. And two of them, of
    which each might have been any, are a coincidence that one is not. A line at the mains is hum without overtones.
    """
    more = len(names.effects) - len(alone.base.effects)
    spared = _price(alone.base, names) + 2.0 * surprise * (more - 1)
    hum = {effect.place for effect in names.effects if effect.id == Hum.id}
    told = [(h, price) for (c, h), price in zip(alone.fitted, alone.prices, strict=True)
            if not is_fine(c) and not (hum & {c.place, *c.same_at} and _is_mains(c))]  # fmt: skip
    return any(h.fall(names) - 2.0 * price + spared > STRONG for h, price in told)


def _is_mains(correction: Correction) -> bool:
    """Return whether a correction adds a line at the frequency of the mains, to a signal or to half the gap."""
    return isinstance(correction, Line | GapRipple) and near_mains(correction.knots[0])


def _price(plain: Hypothesis, names: Hypothesis) -> float:
    """Return what the numbers of names cost, as twice a log of odds: of each what the mismatch tells (Schwarz)."""
    return (names.parameters - plain.parameters) * log(max(plain.chi2 - names.chi2, LEAST_TOLD))


def _foretells(under: Located, chance: Hypothesis) -> bool:
    """Return whether a correction of free form makes most of what a hypothesis with chance in it would explain.

    What acts by chance could have made any scatter; a law of few numbers that foretells it is believed first. A table
    as fine as the data foretells nothing.
    """
    told = [h for c, h in under.fitted if under.significant and not is_fine(c)]
    return any(under.base.chi2 - h.chi2 > FORETOLD * (under.base.chi2 - chance.chi2) for h in told)


def _needless(beyond: Located, under: Located, place: Place) -> bool:
    """Return whether a correction of free form elsewhere does clearly better than a law, which adds nothing to it.

    Where signals pass a gap: without one, linear physics is the same before it and behind it.
    ``beyond`` are corrections on top of the law at ``place``, ``under`` are those without it.
    """
    law, told = beyond.base, under.base.chi2 - beyond.base.chi2
    both = min((fitted for _, fitted in beyond.fitted), key=lambda h: h.chi2)
    alone = [h for c, h in under.fitted if place not in ((c.place,) if c.dynamics else c.like_at)]
    better = [fitted for fitted in alone if fitted.advantage(law, told) > STRONG]
    return any(both.advantage(fitted, told) < STRONG for fitted in better)


def _doubtful(beyond: Located, effect: Effect, told: float) -> bool:
    """Return whether an effect that explained ``told`` of chi-squared leaves what its own law should have explained."""
    another_thing = beyond.best.axis == "clock time" != effect.along
    little = (BY_THE_CLOCK if another_thing else NEGLIGIBLE) * told
    more = left_to_explain(beyond) > little and beyond.share_at(effect.place) > SAME_PLACE * min(beyond.share, 1.0)
    return more or unheard(beyond, told) > 1.0


def misplaced(bench: Bench, hypothesis: Hypothesis) -> set[str]:
    """Return the names of effects whose laws explain the data clearly better elsewhere, one by one or together."""
    places = {place for effect in hypothesis.effects for place in effect.elsewhere}
    found: set[str] = set()
    for place in places:
        movable = [e for e in hypothesis.effects if place in e.elsewhere and not _known_at(bench, e, place)]
        if not movable:
            continue
        sets = [{effect} for effect in movable] + ([set(movable)] if len(movable) > 1 else [])
        found |= {e.name for moved in sets if _moved(bench, hypothesis, moved, place) > STRONG for e in moved}
    return found


def _known_at(bench: Bench, effect: Effect, place: Place) -> bool:
    """Return whether the catalogue has a name for what ``effect`` would be at ``place``: fits compared them."""
    return any(kind.id == effect.elsewhere[place] for kind in bench.kinds)


def _moved(bench: Bench, hypothesis: Hypothesis, moved: set[Effect], place: Place) -> float:
    """Return the advantage of the same laws with some of them at another place.

    The fit begins at the values they have, or at those one would begin with there: signals are of other sizes.
    """
    there = {e: replace(e, place=place) for e in moved}
    effects = tuple(there.get(e, e) for e in hypothesis.effects)
    begun = [bench.with_effects(effects, hypothesis.fit.chain.values)]
    if len(moved) == 1:
        ((effect, other),) = there.items()
        evidence = bench.evidence(bench.without(hypothesis, effect)).seen_by(other)
        begun += [begun[0].with_values(other.named(values)) for values in other.starts(evidence)]
    start = min(begun, key=lambda chain: total_chi_squared(chain, bench.observations))
    return bench.fitted(start, effects).advantage(hypothesis)
