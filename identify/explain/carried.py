"""Does noise in front of the gap carry w along, and how are the readings weighed beside that?

What differs between repeats no law foretells. Where noise in front of the gap makes it, it has the structure that
identify.wandering tells from two numbers, which are found as those that make the differences between repeats most
likely: whatever else is missing from the model is the same in both and falls out of them. Weighed so, the readings show
what the noise had hidden.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf, log, sqrt
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError
from scipy.optimize import minimize

from identify.blocks import Play
from identify.chain import Chain
from identify.colour import Colour
from identify.effects.effect import Effect
from identify.effects.inside_play import gap_v
from identify.explain.bench import Bench
from identify.explain.confirm import UNFINISHED
from identify.explain.hypothesis import Hypothesis
from identify.explain.wander import PROVEN, by_chance_elsewhere, changes, compared, whitened
from identify.explain.weights import Carried
from identify.fit import Pull
from identify.observe import Observation, pooled_rms, refined
from identify.trace import Array, Mask

SIZES = 10.0 ** np.arange(-4.5, -0.1, 0.5)  # of the gap: sd at which the search begins
BANDS = (0.01, 0.1)  # of the sample rate: bandwidths at which it begins
WORTH = 0.25  # share of what repeats differ by that the noise must make likelier, to be looked at closely
LEFT = 0.02  # share of it that may still be there once the readings are weighed
TRIALS = 60  # of a search, at most
SIMPLEX = np.array([[0.0, 0.0], [0.4, 0.0], [0.0, 1.0]])  # logs of size and bandwidth from which it goes
MEAN = 25.0  # of chi-squared, that the mean must explain: chance does in one of 1e5
SHARE = 0.02  # and of what is left: any law takes some of that
ROUGH = 0.2  # share of what the mean explains that its law, which follows it by one number, may leave
NEARLY = 0.01  # share of what the weights take away, that may be left because they hold to first order
SURE = (0.2, 1.5)  # of the logs of size and bandwidth: the structure is that of small deviations, of one form of noise


@dataclass(frozen=True, eq=False)
class Repeats:
    """What a model leaves of one run, V, and what is played twice in it: samples, and which both count."""

    observation: Observation
    residual: Array
    pairs: tuple[tuple[slice, slice, Mask], ...]

    def cost(self, colour: Colour) -> float:
        """Return twice the negative log of the likelihood of their differences, but for a constant."""
        white = whitened(replace(self.observation, colour=colour), self.residual)
        logs = colour.wander.logs if colour.wander is not None else np.zeros(white.size)
        total = 0.0
        for once, again, both in self.pairs:
            apart = (white[once] - white[again])[both]
            total += 0.5 * float(apart @ apart + np.sum((logs[once] + logs[again])[both]))
        return total


def carried(bench: Bench, plain: Hypothesis) -> tuple[Bench, Hypothesis] | None:
    """Return the bench whose readings are weighed beside noise in front of the gap, and its mean fitted there.

    None where repeats differ by no more than the noise of the reading, or not as such noise makes them differ, or where
    its mean is not in the readings: noise behind the gap ratchets nothing.
    """
    laws = in_question(bench, plain)
    if not laws:
        return None
    chain, seen = plain.fit.chain, bench.observations
    before, chance = differ(chain, seen)
    repeats = repeats_of(chain, seen)
    begun = begun_at(laws[0], chain, repeats)
    if begun is None:
        return None
    found = [_weighed(bench, _with(law, law.put_in(chain, {}), begun), (law,), repeats) for law in laws]
    beside, base = min(found, key=lambda pair: price(*pair))
    after, _ = changes(base.fit.chain, beside.observations).T
    if np.any(after > LEFT * np.maximum(before, 0.0) + chance):
        return None
    mean, needed = _mean(beside, base)
    rough = max(ROUGH * mean, NEARLY * _volume(beside))
    return (_as_rough(beside, rough), base) if mean > needed else None


def in_question(bench: Bench, plain: Hypothesis) -> list[Effect]:
    """Return the laws of noise in front of the gap, where repeats differ by more than the noise of the reading.

    None without a gap, or where readings are weighed beside something else.
    """
    chain, seen = plain.fit.chain, bench.observations
    laws = [law for kind in bench.kinds if kind.by_chance for law in kind.variants() if law.applicable(chain)]
    if not laws or chain.stage_of(Play) is None or not gap_v(chain) or not all(o.colour.white for o in seen):
        return []
    before, chance = differ(chain, seen)
    return laws if np.any(before > chance) else []


def ratchets(bench: Bench, final: Hypothesis) -> bool:
    """Return whether the mean of what acts by chance in a hypothesis is in the readings, weighed beside that chance.

    What else differs from repeat to repeat, as a contact that makes elsewhere at every turn, has no such mean. Where
    repeats do not tell, it may be there.
    """
    before, chance = differ(final.fit.chain, bench.observations)
    if not all(o.colour.white for o in bench.observations) or not np.any(before > chance):
        return True
    mean, needed = _mean(*weighed_again(bench, final))
    return mean > needed


def _mean(beside: Bench, found: Hypothesis) -> tuple[float, float]:
    """Return what the mean of what acts by chance explains beside that chance, and how much it must, chi-squared."""
    law = next(effect for effect in found.effects if effect.by_chance)
    return beside.without(found, law).chi2 - found.chi2, MEAN + SHARE * found.proven


def differ(chain: Chain, observations: Sequence[Observation], plain: Chain | None = None) -> tuple[Array, Array]:
    """Return by how much repeats differ beyond the noise, and by how much chance would let them, chi-squared.

    Those that the ``plain`` chain answers alike, where it is given.
    """
    before, count = changes(chain, observations, plain).T
    return before, PROVEN * np.sqrt(2.0 * count)


def weighed_again(bench: Bench, final: Hypothesis) -> tuple[Bench, Hypothesis]:
    """Return bench and hypothesis with the noise measured once more beside all else that was found."""
    repeats = repeats_of(final.fit.chain, bench.observations)
    again, found = _weighed(bench, final.fit.chain, final.effects, repeats)
    return _as_rough(again, bench.rough), found


def left_by_chance(bench: Bench, effects: Sequence[Effect], chain: Chain, held_out: Sequence[Observation]) -> float:
    """Return what named effects add by chance to the variance left on held-out data, over that of the noise."""
    if not _carries(bench, effects):
        made = by_chance_elsewhere(chain, effects, bare(bench.observations), bare(held_out))
        return made / sum(o.count for o in held_out)
    left, weighed_left = _left(chain, held_out)
    return max(left**2 - weighed_left**2, 0.0)


def scatters_so(bench: Bench, effect: Effect, chain: Chain, held_out: Sequence[Observation]) -> bool:
    """Return whether held-out data scatter as an effect does by chance.

    What readings are weighed beside, where they leave more than the noise, and no more as they are weighed by the chain
    alone: what else differs from repeat to repeat is not white in that.
    """
    if by_chance_elsewhere(chain, (effect,), bare(bench.observations), bare(held_out)) > 0.0:
        return True
    if not _carries(bench, (effect,)):
        return False
    left, weighed_left = _left(chain, held_out)
    return weighed_left <= UNFINISHED < left


def _carries(bench: Bench, effects: Sequence[Effect]) -> bool:
    """Return whether readings are weighed beside what one of the effects does by chance."""
    return bench.carried is not None and bench.carried.law in effects


def _left(chain: Chain, held_out: Sequence[Observation]) -> tuple[float, float]:
    """Return what a chain leaves, in units of the noise: as if nothing wandered, and as the data are weighed."""
    left, weighed_left = (pooled_rms(w for o in seen for w in o.whitened(chain)) for seen in (bare(held_out), held_out))
    return left, weighed_left


def rougher(bench: Bench, better: Hypothesis, effect: Effect, name: str) -> float:
    """Return by how much the interval of an effect's value widens where its law is but a rough mean of what it does.

    It holds all values with which chi-squared rises by no more than what that may be off by, beside chance; but where
    readings are weighed beside what the effect does, none that the differences of repeats exclude.
    """
    if not effect.by_chance:
        return 1.0
    explains = max(bench.without(better, effect).chi2 - better.chi2, 0.0)
    wider = sqrt(1.0 + ROUGH * explains / 1.96**2)
    sd = better.fit.sd(name) / better.fit.chain.values[name]  # of its log
    if not _carries(bench, (effect,)) or not sd:
        return wider
    sure = dict(zip((p.name for p in effect.parameters()), SURE, strict=True))
    return min(wider, max(sure[name] / sd, 1.0))


def price(bench: Bench, hypothesis: Hypothesis) -> float:
    """Return twice the negative log of the likelihood, but for a constant, and the price of what was searched."""
    return hypothesis.chi2 + _volume(bench) + hypothesis.parameters * log(hypothesis.count)


def _volume(bench: Bench) -> float:
    """Return what the weights of a bench add to twice the negative log of a likelihood."""
    return sum(float(np.sum(o.colour.wander.logs)) for o in bench.observations if o.colour.wander is not None)


def weighed(law: Effect, chain: Chain, observations: Sequence[Observation]) -> tuple[Observation, ...]:
    """Return observations weighed beside the noise of which a chain has the mean."""
    return tuple(replace(o, colour=_colour(law, chain, o)) for o in observations)


def alike_weighed(bench: Bench, chain: Chain, observations: Sequence[Observation]) -> tuple[Observation, ...]:
    """Return observations weighed as those of a bench are, by a chain that has what that weighs beside."""
    return weighed(bench.carried.law, chain, observations) if bench.carried else tuple(observations)


def bare(observations: Sequence[Observation]) -> tuple[Observation, ...]:
    """Return observations weighed as if nothing wandered."""
    return tuple(replace(o, colour=Colour()) if o.colour.wander is not None else o for o in observations)


def _colour(law: Effect, chain: Chain, observation: Observation) -> Colour:
    """Return how the noise of a run hangs together beside what a law carries along."""
    return Colour(wander=law.wander(chain, observation))


def repeats_of(chain: Chain, observations: Sequence[Observation]) -> list[Repeats]:
    """Return what a chain leaves of every run, and what is played twice there."""
    left = [(o, o.residual(chain)) for o in observations]
    return [Repeats(o, residual, tuple(compared(o, residual))) for o, residual in left]


def _as_rough(bench: Bench, rough: float) -> Bench:
    """Return a bench of which it is known by how much the law it is weighed beside may be off."""
    return replace(bench, carried=replace(bench.carried, rough=rough)) if bench.carried else bench


def _with(law: Effect, chain: Chain, logs: Array) -> Chain:
    """Return a chain with a law's numbers, from their logs."""
    return chain.with_values({p.name: float(x) for p, x in zip(law.parameters(), np.exp(logs), strict=True)})


def cost_of(law: Effect, chain: Chain, repeats: Sequence[Repeats]) -> Callable[[Array], float]:
    """Return the cost of differences between repeats over the logs of a law's numbers; infinity where there is none."""

    def cost(logs: Array) -> float:
        there = _with(law, chain, logs)
        try:
            return sum(r.cost(_colour(law, there, r.observation)) for r in repeats)
        except (ValueError, ArithmeticError, LinAlgError):
            return inf

    return cost


def begun_at(law: Effect, chain: Chain, repeats: Sequence[Repeats]) -> Array | None:
    """Return logs of size and bandwidth near the likeliest; None where none makes much of what repeats differ by."""
    bands = [band * repeats[0].observation.trace.rate_hz for band in BANDS]
    cost = cost_of(law, law.put_in(chain, {}), repeats)
    found = [(cost(at), at) for at in np.log([(size * gap_v(chain), band) for size in SIZES for band in bands])]
    least, at = min(found, key=lambda each: each[0])
    return at if tells_much(repeats, least) else None


def tells_much(repeats: Sequence[Repeats], cost: float) -> bool:
    """Return whether what has such a cost makes much of what repeats differ by likelier."""
    without = sum(r.cost(Colour()) for r in repeats)
    count = sum(int(np.count_nonzero(both)) for r in repeats for *_, both in r.pairs)
    return without - cost > WORTH * (without - count)


def likeliest(law: Effect, chain: Chain, repeats: Sequence[Repeats], begun: Array) -> tuple[Array, float]:
    """Return the logs of a law's numbers with which repeats differ most likely, from a beginning, and what they cost.
    """
    options: Any = {"xatol": 0.02, "fatol": 1.0, "maxfev": TRIALS, "initial_simplex": begun + SIMPLEX}
    found: Any = minimize(cost_of(law, chain, repeats), begun, method="Nelder-Mead", options=options)
    return np.asarray(found.x), float(found.fun)


def _weighed(
    bench: Bench, chain: Chain, effects: tuple[Effect, ...], repeats: Sequence[Repeats]
) -> tuple[Bench, Hypothesis]:
    """Return the bench weighed as makes what repeats differ by most likely, and the chain fitted there.

    The numbers of what acts by chance are searched from those of the chain, and held near what repeats tell.
    """
    law = next(effect for effect in effects if effect.by_chance)
    names = [p.name for p in law.parameters()]
    begun = np.log([chain.values[name] for name in names])
    logs, _ = likeliest(law, chain, repeats, begun)
    pull = Pull(lambda there: np.log([there.values[name] for name in names]), logs, np.array(SURE))
    chain = _with(law, chain, logs)
    coarsest = [replace(o, substeps=1, left_out=None) for o in bench.observations]
    seen = tuple(refined(o, chain) for o in weighed(law, chain, coarsest))
    beside = replace(bench.on(seen), carried=Carried(law, pull))
    return beside, beside.fitted(chain, effects)
