"""Which of several candidates explains most, fitted side by side?

A few iterations at a time; one that cannot come near the best is not fitted further.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from typing import TYPE_CHECKING

from identify.chain import Chain
from identify.effects.effect import Effect, short
from identify.evidence import Evidence
from identify.explain.hypothesis import Hypothesis
from identify.explain.promise import Promise
from identify.explain.round import COMPARED, FAR
from identify.fit import total_chi_squared
from identify.phases import angles_of, scanned

if TYPE_CHECKING:
    from identify.explain.bench import Bench

SPRINT = 4  # iterations in which candidates are fitted side by side
LAPS = 12
KEPT = 0.8  # of what is promised, from which a fit has found it
DECISIVE = 1.0  # of chi-squared: what a candidate may still gain below this changes no odds
STEADY = 10.0  # times what a lap gained that the laps to come may gain
NEAR = 200.0  # of chi-squared: a fit further behind the best, and by FAR, is not continued
DOUBLED = 3  # candidates of a round that are fitted again from twice their strength
PARTS = (0.5, 0.25, 0.1, 0.03)  # of the way to what is promised, where all of it leads to nothing
TURNS = 4  # times phases are looked for anew once the rest has moved


def raced(
    bench: "Bench", base: Hypothesis, promises: Sequence[Promise], ahead: Sequence[Hypothesis] = ()
) -> list[Hypothesis]:
    """Fit candidates side by side, a few iterations at a time; one that cannot come near is not fitted further.

    Near what is best of them, and of what is ``ahead``: fits of the same base that were made before.
    """
    found = [bench.remembered(_First(p.candidate.effect, tuple(p.chain.values.items()), p), base) for p in promises]
    hopes = [h.hope for h in found]
    for _ in range(LAPS):
        best = min((*found, *ahead), key=lambda h: h.chi2, default=base)
        reach = max(NEAR, FAR * (base.chi2 - best.chi2))
        running = [
            not h.fit.converged and h.chi2 - best.chi2 < min(reach, max(COMPARED, more)) and more > DECISIVE
            for h, more in zip(found, hopes, strict=True)
        ]
        if not any(running):
            break
        lap = [
            bench.fitted(h.fit.chain, h.effects, SPRINT) if runs else h for h, runs in zip(found, running, strict=True)
        ]
        gained = [STEADY * (old.chi2 - new.chi2) for old, new in zip(found, lap, strict=True)]
        hopes = [min(gain, h.hope) for gain, h in zip(gained, lap, strict=True)]
        found = lap
    return found


def doubled(bench: "Bench", base: Hypothesis, tried: Sequence[Hypothesis], least: float = 0.0) -> list[Hypothesis]:
    """Fit what came near the best again with its effect twice as strong, where the best leaves more than noise.

    Plain values that were moved to stand in for a lag hold part of it back: a minimum with half of each. Twice as
    strong it explains four times as much; where that is less than ``least``, it is not asked.
    """
    found = sorted(tried, key=lambda h: h.chi2)
    if not found or found[0].misfit < bench.noise_known or 4.0 * (base.chi2 - found[0].chi2) < least:
        return found
    reach = found[0].chi2 + FAR * (base.chi2 - found[0].chi2)
    for number, h in enumerate(found[:DOUBLED]):
        stronger = h.effects[-1].doubled(h.fit.chain)
        if h.chi2 < reach and stronger is not h.fit.chain:
            again = bench.fitted(stronger.with_values(base.fit.chain.values), h.effects)
            found[number] = min((h, again), key=lambda one: one.chi2)
    return found


def begun_anew(bench: "Bench", base: Hypothesis, tried: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Fit lags again that were given up behind a law that is none, from where the rig file has the plain values.

    Where data tell little, these have moved far to stand in for a lag, and its fit has a long way back.
    """
    best = min(tried, key=lambda h: h.chi2, default=base)
    if base.effects or best is base or best.effects[-1].lags:
        return list(tried)
    least, reach = best.chi2 + COMPARED, base.chi2 - FAR * (base.chi2 - best.chi2)
    anew = [h.effects[-1].lags and not h.fit.converged and least < h.chi2 < reach for h in tried]
    return [_from_rig_file(bench, h) if again else h for h, again in zip(tried, anew, strict=True)]


def _from_rig_file(bench: "Bench", hypothesis: Hypothesis) -> Hypothesis:
    """Return a lag fitted from the plain values of the rig file, as long as it is or twice; itself where that is worse.

    Narrow valleys bend on the way, and from one start or the other a fit comes to rest in them.
    """
    effects, begun = hypothesis.effects, bench.from_rig_file(hypothesis)
    anew = [bench.fitted(chain, effects) for chain in (begun, effects[-1].doubled(begun))]
    return min((hypothesis, *anew), key=lambda h: h.chi2)


@dataclass(frozen=True)
class _First:
    """What does the first lap of a law leave, from the values it is promised at?"""

    effect: Effect
    values: tuple[tuple[str, float], ...]
    promise: Promise = field(compare=False)

    def __call__(self, bench: "Bench", base: Hypothesis) -> Hypothesis:
        """Return the fit on top of a hypothesis."""
        return _extended(bench, base, self.promise)


def _extended(bench: "Bench", base: Hypothesis, promise: Promise) -> Hypothesis:
    """Fit ``base`` with one more effect for a few iterations, and its angles until they stay.

    It begins where the other values are moved as promised or as they were, what leaves less; where that leaves more
    than ``base`` and leads to less than is promised, first order does not hold so far: then from both, and where that
    leads to nothing from as far on the way to what is promised as it does hold.
    """
    effect = promise.candidate.effect
    effects = (*base.effects, effect)
    angles = angles_of(effect.parameters())  # those of others are fitted already
    apart = promise.chain.with_values(base.fit.chain.values)
    starts = ((total_chi_squared(chain, bench.observations), chain) for chain in (promise.chain, apart))
    (left, start), (_, other) = sorted(starts, key=itemgetter(0))
    found = bench.fitted(scanned(start, bench.observations, angles), effects, SPRINT)
    apart_begins = start.values != other.values  # else the fit would be the same once more
    if apart_begins and left > base.chi2 and base.chi2 - found.chi2 < KEPT * promise.gain:
        again = bench.fitted(scanned(other, bench.observations, angles), effects, SPRINT)
        found = min((found, again), key=lambda h: h.chi2)
    if found.chi2 > base.chi2 and (nearer := _part_of_the_way(bench, base, promise)):
        again = bench.fitted(scanned(nearer, bench.observations, angles), effects, SPRINT)
        found = min((found, again), key=lambda h: h.chi2)
    begun = effect.completed(found.fit.chain, Evidence(base.fit, bench.observations))
    if begun is not found.fit.chain:  # a value that came to rest where it does nothing has no slope that leads away
        found = min((found, bench.fitted(begun, effects, SPRINT)), key=lambda h: h.chi2)
    for _ in range(TURNS):
        turned = scanned(effect.upright(found.fit.chain), bench.observations, angles)
        if turned is found.fit.chain:
            break
        before, found = found, bench.fitted(turned, effects, SPRINT)
        if found.chi2 > before.chi2 - DECISIVE:
            return min((before, found), key=lambda h: h.chi2)
    return found


def _part_of_the_way(bench: "Bench", base: Hypothesis, promise: Promise) -> Chain | None:
    """Return the chain that is moved as promised, in part, and leaves less than ``base``; None where no part does.

    What an effect has beside its sizes, its lags and corners, is as promised.
    """
    effect, there = promise.candidate.effect, promise.chain.values
    sizes = [p.name for p in effect.parameters() if p.coordinate == "linear" and effect.absent[short(p.name)] == 0.0]
    begin = {**there, **dict.fromkeys(sizes, 0.0), **base.fit.chain.values}
    for share in PARTS:
        values = {name: value + share * (there[name] - value) for name, value in begin.items() if name in there}
        chain = promise.chain.with_values(values)
        if total_chi_squared(chain, bench.observations) < base.chi2:
            return chain
    return None
