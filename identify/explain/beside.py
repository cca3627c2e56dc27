"""What is missing from the model beside noise in front of the gap, and is that noise there at all?"""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from math import inf

import numpy as np
from scipy.linalg import LinAlgError

from identify.candidates import candidates
from identify.chain import Chain
from identify.effects.hum import near_mains
from identify.explain.anew import NO_CHANCE, line_anew
from identify.explain.bench import Bench
from identify.explain.carried import carried, differ, price, ratchets, weighed_again
from identify.explain.free_form import FirstFit, GoneOn
from identify.explain.hypothesis import Hypothesis
from identify.explain.locate import located
from identify.explain.promise import promised
from identify.explain.round import FORETOLD, Round, hopeful
from identify.explain.select import MOST_EFFECTS, Selected, selected
from identify.explain.sought import distinct, finer
from identify.explain.suspect import Suspect, is_fine, with_alike
from identify.explain.wander import MOSTLY, changes, unrepeated
from identify.stage import Place
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.lines import OneLine

CLOSELY = 2  # laws that are fitted to their end in the place of noise in front of the gap
SCATTERED = 0.05  # of what is left, by which repeats differ at least where noise in front of the gap has made it
CLEARLY = 3.0  # times what chance may hide in repeats, by which they differ at least where a law is held against it
BEYOND = 30.0  # times what chance may hide in repeats, from which a mismatch that comes back is not made by it
PART = 0.7  # of what repeats differ by, that the promise of a law leaves at most that foretells some: of noise, 0.99
ALIKE = 0.02  # of a frequency, within which a line that few readings show is the same
IN_FRONT = (Place.SOURCE, Place.G1)  # of F
ANOTHER = ("mains lines", "clock time")  # coordinates of what is another whenever the same is played again

Note = Callable[[str, float], None]


def selected_either(bench: Bench, plain: Hypothesis, note: Note, may_wander: bool) -> Selected:
    """Select what is missing; beside noise in front of the gap where no law without it explains all, as well as that.

    What is foretold is believed before what acts by chance. Where that wins a round, or most of what a winner leaves
    is another in every repeat, it is asked at once whether the noise is there; where it is found all the same and
    ratchets nothing, what is missing is selected without it. Where next to all that is left comes back with every
    repeat, it is not asked; where repeats clearly differ and no law promises to foretell that, it is asked first.
    """
    asked = cache(lambda: selected_beside(bench, plain, note) if may_wander else None)
    if may_wander and _is_another(bench, plain) and (beside := asked()) is not None:
        return beside

    def instead(there: Bench, best: Hypothesis) -> Selected | None:
        return asked() if best.effects[-1].by_chance or wanders(there, best) else None

    found = selected(bench, plain, note, by_chance=instead)
    by_chance = any(effect.by_chance for effect in found[1].effects)
    beside = asked() if by_chance or _scattered(*found[:2]) else None
    if by_chance and beside is None and not ratchets(*found[:2]):
        return selected(foretelling(bench), plain, note)
    if beside is None or (not by_chance and price(*found[:2]) < price(*beside[:2])):
        return found
    return beside


def wanders(bench: Bench, best: Hypothesis) -> bool:
    """Return whether most of what is left is another in every repeat, and no law promises to foretell much of it."""
    differs = _tries_chance(bench) and unrepeated(best.fit.chain, bench.observations) > MOSTLY
    return differs and not foretold(bench, best)


def _is_another(bench: Bench, plain: Hypothesis) -> bool:
    """Return whether repeats clearly differ, and no law promises to foretell much of what they differ by."""
    before, chance = differ(plain.fit.chain, bench.observations)
    clearly = _tries_chance(bench) and bool(np.any(before > CLEARLY * chance))
    return clearly and not foretold(bench, plain)


def _scattered(bench: Bench, found: Hypothesis) -> bool:
    """Return whether something is left, and enough of it is another in every repeat for noise to have made it."""
    return found.proven > 0.0 and unrepeated(found.fit.chain, bench.observations) > SCATTERED


def selected_beside(bench: Bench, plain: Hypothesis, note: Note) -> Selected | None:
    """Select what is missing beside noise in front of the gap; None where that is not there.

    Nor is it where the other laws explain as much without it, alone or with one that foretells what it makes by chance,
    named or of free form: a line at v, whose phase is another in every repeat, shakes the borders, too.
    """
    begun = carried(bench, plain)
    if begun is None:
        return None
    weighed, base = begun
    (law,) = base.effects
    more = weighed.explainable(base) > weighed.rough
    beside, final, rounds = selected(weighed, base, note, MOST_EFFECTS - 1) if more else (weighed, base, [])
    if law not in final.effects:  # another took its place
        return None
    if len(final.effects) > 1:
        beside, final = weighed_again(beside, final)
    if _does_without(bench, bench.without(final, law), price(beside, final)):
        return None
    return beside, final, [Round(weighed.without(base, law), 0, (base,)), *rounds]


def foretells_all(bench: Bench, plain: Hypothesis) -> bool:
    """Return whether one law of free form foretells all that repeats differ by: nothing acts by chance then.

    A line free of the stimulus may: what the stimulus goes up and down with is no line in that, but a ripple promises
    most of the misfit. One that goes on in front of the gap need not foretell all, in all runs together: it has
    overtones without end. Any other law may where repeats differ so clearly that few weights cannot follow noise. It is
    not asked where nothing that acts by chance is tried.
    """
    if not _tries_chance(bench):
        return False
    before, chance = differ(plain.fit.chain, bench.observations)
    if not np.any(before > chance):
        return False
    laws = [s for s in bench.suspects(plain) if not is_fine(s.correction)]
    lines, others = ([s for s in laws if s.correction.searched is searched] for searched in (True, False))
    line_hz, by_chance = line_anew(plain.fit.chain, bench.observations)
    goes = by_chance < NO_CHANCE
    promised = max((s.gain for s in lines), default=0.0) > FORETOLD * plain.proven
    likely = lines if promised or goes else []
    clearly = others if np.any(before > CLEARLY * chance) else []
    fitted = (pair for tried in (likely, clearly) if tried for pair in _fitted(bench, plain, tried))

    def foretells(law: Correction, h: Hypothesis) -> bool:
        left = differ(h.fit.chain, bench.observations, plain.fit.chain)[0]
        return bool(np.all(left <= chance)) or (goes and _is_of(law, line_hz) and _is_most(before, left))

    return any(foretells(*pair) for pair in fitted)


def _is_most(before: Array, left: Array) -> bool:
    """Return whether a law takes most of what repeats differ by, in all of them together, in units of chi-squared."""
    return float(np.sum(left)) <= (1.0 - FORETOLD) * float(np.sum(before))


def _is_of(law: Correction, line_hz: float) -> bool:
    """Return whether a law is a line in front of the gap that has one frequency, or an overtone at it.

    Not one of the mains, which have a name of their own beside noise.
    """
    if not isinstance(law, OneLine) or law.place not in IN_FRONT or near_mains(law.knots[0]):
        return False
    overtones = law.knots[0] * np.arange(1, 1 + len(law.weights) // 2)
    return bool(np.min(np.abs(overtones - line_hz)) < ALIKE * line_hz)


def comes_back(bench: Bench, plain: Hypothesis) -> bool:
    """Return whether a mismatch is so large, and so much alike whenever the same is played, that chance makes none.

    Or next to none: what may be hidden in how repeats differ is little against it.
    """
    before, chance = differ(plain.fit.chain, bench.observations)
    hidden = float(np.max(chance))
    return hidden > 0.0 and plain.proven > BEYOND * hidden and not np.any(before > chance)


def _tries_chance(bench: Bench) -> bool:
    """Return whether anything that acts by chance is tried."""
    return any(kind.by_chance for kind in bench.kinds)


def foretelling(bench: Bench) -> Bench:
    """Return the bench without what acts by chance."""
    return bench.of_kinds(kind for kind in bench.kinds if not kind.by_chance)


def foretold(bench: Bench, plain: Hypothesis) -> bool:
    """Return whether a law promises to foretell a good part of what repeats differ by, which of noise none does.

    All are asked, however little else one explains: what explains most may answer alike whenever the same is played.
    """
    def left(chain: Chain) -> float:
        try:
            with np.errstate(over="ignore", invalid="ignore"):
                return float(np.sum(changes(chain, bench.observations, plain.fit.chain)[:, 0]))
        except (ValueError, ArithmeticError, LinAlgError):  # first order may promise what cannot be simulated
            return inf

    before, evidence = left(plain.fit.chain), bench.evidence(plain)
    worth = hopeful(candidates(evidence, foretelling(bench).kinds), len(bench.observations))
    return any(left(promised(evidence, c).chain) < PART * before for c in worth)


def _does_without(bench: Bench, without: Hypothesis, asked: float) -> bool:
    """Return whether laws foretell as much as noise in front of the gap makes likely, at the price that is ``asked``.

    What answers alike whenever the same is played leaves all by which repeats differ. Where that is more than is asked,
    only what is another in every repeat is tried.
    """
    if price(bench, without) < asked:
        return True
    if float(np.sum(changes(without.fit.chain, bench.observations)[0])) > asked:
        free = bench.of_kinds(kind for kind in bench.kinds if kind.axis in ANOTHER)
        return _named(free, without, asked) or _unrepeated(bench, without, asked)
    laws = (h for c, h in located(bench, without).fitted if not is_fine(c))
    return _named(bench, without, asked) or any(price(bench, h) < asked for h in laws)


def _named(bench: Bench, without: Hypothesis, asked: float) -> bool:
    """Return whether one more law of the catalogue comes to the price that is asked."""
    foretold = [h for h in bench.round(without).tried if not h.effects[-1].by_chance][:CLOSELY]
    return any(price(bench, bench.fitted(h.fit.chain, h.effects)) < asked for h in foretold)


def _unrepeated(bench: Bench, without: Hypothesis, asked: float) -> bool:
    """Return whether one correction of free form that is another in every repeat comes to the price that is asked."""
    free = [s for s in bench.suspects(without) if s.correction.axis in ANOTHER and not is_fine(s.correction)]
    return any(price(bench, h) < asked for _, h in _fitted(bench, without, free))


def _fitted(bench: Bench, base: Hypothesis, found: Sequence[Suspect]) -> Iterator[tuple[Correction, Hypothesis]]:
    """Yield the corrections that promise most on top of a hypothesis, and their fits."""
    evidence = bench.evidence(base)
    ranked = sorted(found, key=lambda s: -s.gain)
    likely = with_alike(ranked, ranked[:CLOSELY])
    for s in distinct(evidence, [finer(evidence, s, 1.0) for s in likely]):
        begun = bench.remembered(FirstFit(s.correction, s), base)
        yield bench.remembered(GoneOn(s.correction, begun), base)
