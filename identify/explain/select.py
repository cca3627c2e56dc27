"""Which set of effects explains the residual, with no more in it than the data ask for?

Forward selection, then backward deletion: each round takes the best further effect if it pays for its parameters.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf

from identify.explain.bench import Bench
from identify.explain.decide import decided
from identify.explain.exchange import exchanged
from identify.explain.hypothesis import Hypothesis
from identify.explain.locate import first_fits, located, told_by_one, within_reach
from identify.explain.neighbours import resettled
from identify.explain.prune import pruned
from identify.explain.round import WHOLE, Round, counts
from identify.explain.suspect import is_fine
from identify.explain.wander import all_wanders

MOST_EFFECTS = 3
ALL = 0.8  # of what is left, that a law has to explain together with as many like it as may follow, the last alone
FAR_LESS = 0.5  # of what laws leave, from below which a single correction shows that they are not the physics
MOSTLY = 0.5  # share of what the best law explains alone, that another must
OTHERS = 4  # laws beside which one more is looked for in the place of the best
STUCK = 0.1  # share of what an effect explains that the plain model explains as well, fitted from there

Note = Callable[[str, float], None]
Selected = tuple[Bench, Hypothesis, list[Round]]
ByChance = Callable[[Bench, Hypothesis], Selected | None]


def selected(
    bench: Bench, start: Hypothesis, note: Note, most: int = MOST_EFFECTS,
    by_chance: ByChance | None = None,
) -> Selected:  # fmt: skip
    """Add effects one by one, ``most`` at most, while each pays for itself, then drop those made superfluous by others.

    Returns the bench on the grids the winner needs, the winner, and what every round considered. What ``by_chance``
    makes of the winner of a round is returned instead, if anything.
    """
    best, rounds = start, list[Round]()
    for number in range(most):
        note(f"trying effects, round {number + 1}", 0.15 + 0.15 * number)
        part = ALL / (MOST_EFFECTS - number) if number else 0.0
        least = part * _explainable(bench, best) if number else 0.0
        bench, this = decided(bench, bench.round(best, least))
        if number == 1 and this.best is None:
            rounds[0], (bench, this) = _from_another(bench, rounds[0], this)
        plain = None if best.effects else _unended(bench, this)
        if plain is not None:
            best, (bench, this) = plain, decided(bench, bench.round(plain))
        start = start if best.effects else this.base
        if by_chance and this.best and (other := by_chance(bench, this.best)) is not None:
            return other
        this, ends = _settled(bench, start, this, rounds, part, least)
        if ends and this.best is not None:
            return bench, this.best, [*rounds, this]
        rounds.append(this)
        if this.best is None:  # its base was fitted again where finer grids were needed to compare it
            return bench, pruned(bench, this.base), rounds
        finer = bench.fine_enough(this.best)
        best = this.best if finer is bench else finer.fitted(this.best.fit.chain, this.best.effects)
        bench, best = finer, resettled(finer, best)
        if number + 1 < most and _is_all(bench, start, best, rounds):
            break
    return bench, pruned(bench, best), rounds


def _from_another(bench: Bench, first: Round, second: Round) -> tuple[Round, tuple[Bench, Round]]:
    """Return both rounds as they are without the law that won the first, where another leaves nothing with one more.

    Alone a law explains most that does part of what another would: nothing is found beside it then. Both rounds stay
    as they are where there is no such law, or nothing left.
    """
    if not second.base.proven:
        return first, (bench, second)
    alone, law = second.base, second.base.effects[-1]  # beside which the others explain too little
    others, least = first.without(law), MOSTLY * (first.base.chi2 - alone.chi2)
    likely = [h for h in others.kinds if first.base.chi2 - h.chi2 > least][:OTHERS]
    for h in map(bench.again, likely):
        there, found = decided(bench, bench.round(h, ALL * (h.chi2 - h.count), law))
        if found.best is not None and not found.best.proven and found.best.chi2 < alone.chi2:
            return others, (there, found)
    return first, (bench, second)


def _is_all(bench: Bench, start: Hypothesis, best: Hypothesis, rounds: Sequence[Round]) -> bool:
    """Return whether no law is looked for beside the best of a round: one thing is not two, and chance tells none.

    Nor is one where all that is left may be what a law that is known roughly leaves. Where two laws promise together
    all there is, they are looked at all the same.
    """
    if bench.rough and _explainable(bench, best) <= bench.rough:
        return True
    if (all_wanders(best, bench.observations) and not best.proven) or (len(rounds) > 1 and best.swell > 1.0):
        return True
    first = rounds[0]
    by_two = len(rounds) == 1 and any(pair.gain > first.base.chi2 - first.base.count for pair in first.pairs)
    return not by_two and told_by_one(bench, start, best)


def _settled(
    bench: Bench, start: Hypothesis, this: Round, before: list[Round], part: float, least: float
) -> tuple[Round, bool]:
    """Return a round in which other laws had their turn in the place of the winner's, and whether the search ends.

    Nothing won it where the winner does not belong, as a third law, or once the first may have been mistaken.
    """
    number, enough = len(before), 0.0
    if number and this.best is not None:
        enough = _hopeless(bench, start, this.best)
    if number > 1 and not enough and not _belongs(start, this, part, least):  # no exchange is likely to make it
        return replace(this, tried=()), False
    if this.best is not None:
        needed = enough or _needed(this.best, this, least)
        this = replace(this, settled=exchanged(bench, this.best, [*before, this], needed))
    ends = this.best is not None and this.best.chi2 > enough > 0.0
    if number == 1 and not ends and not _belongs(start, this, part, least):
        return replace(this, tried=(), settled=None), False
    return this, ends


def _unended(bench: Bench, this: Round) -> Hypothesis | None:
    """Return the plain fit of a first round brought to its end from where physics led: it looked like that physics."""
    if this.best is None:
        return None
    plain = bench.without(this.best, this.best.effects[-1])
    return plain if this.base.chi2 - plain.chi2 > STUCK * (this.base.chi2 - this.best.chi2) else None


def _hopeless(bench: Bench, start: Hypothesis, best: Hypothesis) -> float:
    """Return the chi-squared of one correction of free form that leaves far less than all laws so far, 0 without one.

    Two laws at different places are more than one correction can make, and two at one are found by now: the catalogue
    has not the law, unless another in the place of one of them does as well.
    """
    if bench.complete(best) or best.swell > 1.0:
        return 0.0
    start, enough = bench.again(start), (1.0 + FAR_LESS * best.misfit) * best.count
    told = [h.chi2 for h in first_fits(bench, start)]
    if min(told, default=inf) >= enough and within_reach(bench, start, enough):
        told = [h.chi2 for c, h in located(bench, start).fitted if not is_fine(c)]
    return min((chi2 for chi2 in told if chi2 < enough), default=0.0)


def _explainable(bench: Bench, base: Hypothesis) -> float:
    """Return how much of chi-squared there is to explain: what noise cannot make, or free-form corrections find.

    Beside chance these find mostly what it makes, which no law foretells.
    """
    if base.swell > 1.0:
        return base.proven
    found = max((s.gain - s.squares.size for s in bench.suspects(base)), default=0.0)
    return max(base.proven, found)


def _needed(best: Hypothesis, this: Round, least: float) -> float:
    """Return the chi-squared of what explains ``least``; infinity beside chance, of which no fall of it is asked."""
    return this.base.chi2 - least if best.swell == 1.0 else inf


def _belongs(start: Hypothesis, this: Round, part: float, least: float) -> bool:
    """Return whether a further law explains its part of what is left, so that those that may follow explain the rest.

    Else it stands in for physics that is in no catalogue, and so would they. ``least`` is that part to first order; it
    is not asked where chance is part of it, only its part of what noise cannot make.
    """
    best = this.best
    if best is None:
        return False
    beyond = max(this.base.chi2 - this.base.count, this.base.noise_known * this.base.count)
    there = least / part if best.swell == 1.0 else beyond
    if not counts(start, this.base, best, there):
        return False
    if this.base.chi2 - best.chi2 > WHOLE * there:
        return True
    return best.gains_enough(this.base, part) if best.swell > 1.0 else this.base.chi2 - best.chi2 > least
