"""Does a mismatch come back when the same is played again, and if not, may what acts by chance have made it?

What physics without chance makes is the same in every repeat of a stimulus. What is not, wanders by itself.
"""

from collections.abc import Iterator, Sequence
from math import log, sqrt

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain
from identify.colour import whitening
from identify.effects.effect import Effect
from identify.explain.chance import MORE, as_large, scatter_in, scatter_of, scatters_all
from identify.explain.contact import resting
from identify.explain.hypothesis import Hypothesis, proven
from identify.fit import Pull, total_chi_squared
from identify.observe import Observation
from identify.trace import Array, Mask
from identify.uncertainty.inflation import inflation

MOSTLY = 0.5  # share of a misfit that must not come back
NEARLY = 0.75  # share of a misfit that chance must make, run by run, to be all that is left
DRIFT_S = 0.02  # whose means tell what drifts from what is quick
SEEN = 2.0  # times what noise makes of a drift, from which it is there
SLOW_S = (0.02, 0.1)  # means in which the slow wandering is looked for, that no single reading shows
PROVEN = 6.0  # standard deviations of chance, from which there is a misfit
SURE = 0.2  # of the log of a size that scatter tells: courses of chance differ
QUIET = 0.25  # of what chance must make, below which a run is too quiet for it: courses of chance differ
HANGS = 3.0  # standard deviations from which readings that follow each other hang together


def unrepeated(chain: Chain, observations: Sequence[Observation]) -> float:
    """Return the share of the misfit that differs from repeat to repeat, 1 at most; 0 where nothing was repeated."""
    changed, beyond = _misfit_of_repeats(chain, observations)
    return min(changed / beyond, 1.0) if beyond else 0.0


def by_chance(
    chain: Chain, effects: Sequence[Effect], observations: Sequence[Observation], share: float = 1.0
) -> float:
    """Return how much of chi-squared beyond the noise effects make by chance, which no model foretells.

    No more in any run than is there, in what changes while F rests as in all else, and of that no more than a
    ``share``, that of what differs from repeat to repeat. Where F never moves, nothing in front of it makes any. None
    at all where they make not nearly all of what differs, or where most of what drifts while F rests, or between a
    repeat and the next, is not of their making: something else does it.
    """
    if share <= 0.0 or not any(effect.by_chance for effect in effects):
        return 0.0
    total, differs, drifts, anew = 0.0, 0.0, np.zeros(2), np.zeros(2)
    for number, o in enumerate(observations):
        made = scatter_in(chain, effects, o, number)
        residual = o.residual(chain)
        left, use = whitened(o, residual)[: made.size], o.use[: made.size]
        rests = _stretches(resting(chain, o)[: made.size] & use)
        moves, makes = _changes(left, rests), _changes(made, rests)
        there, mine = _apart(left, moves, use), _apart(made, makes, use)
        noise = np.array([np.count_nonzero(rests), np.count_nonzero(use & (rests == 0))])
        beyond, part = share * np.maximum(there - noise, 0.0), o.count / max(int(np.count_nonzero(use)), 1)
        total += part * float(np.sum(np.minimum(MORE * mine, beyond)))
        differs += part * float(np.sum(beyond))
        window = max(round(DRIFT_S * o.trace.rate_hz), 1)
        drifts += _drifts(moves, makes, rests, window)
        for once, again, both in compared(o, residual):
            if again.stop <= made.size:
                its, new = ((each[once] - each[again]) / sqrt(2.0) for each in (made, left))
                anew += _drifts(new, its, _stretches(both), window)
    others = drifts[1] > MOSTLY * drifts[0] or anew[1] > MOSTLY * anew[0]
    return 0.0 if others or total < NEARLY * differs else total


def _drifts(left: Array, made: Array, stretches: NDArray[np.int64], window: int) -> Array:
    """Return how much of what is ``left`` drifts within stretches, and of that is not ``made``, shape (2,).

    Both are given as their changes within stretches, or from repeat to repeat; what windows' means move by is a drift.
    Of the noise there is one square in every window, however large that was taken to be.
    """
    inside = np.flatnonzero(stretches)
    begins = np.flatnonzero(np.diff(stretches[inside], prepend=0) | np.diff(inside // window, prepend=-1))
    count = np.diff(begins, append=inside.size)
    there, its = (float(np.sum(np.square(np.add.reduceat(each[inside], begins)) / count)) for each in (left, made))
    beyond = there - SEEN * begins.size
    return np.maximum([beyond, beyond - MORE * its], 0.0)


def _stretches(still: Mask) -> NDArray[np.int64]:
    """Return the number, from 1 on, of the stretch of True that every sample is in, 0 for none, shape (N,)."""
    return np.where(still, np.cumsum(np.diff(still, prepend=False) & still), 0)


def _changes(values: Array, stretches: NDArray[np.int64]) -> Array:
    """Return values less the mean of the stretch they are in, 0 outside, shape (N,)."""
    means = np.bincount(stretches, values) / np.maximum(np.bincount(stretches), 1)
    return np.where(stretches > 0, values - means[stretches], 0.0)


def _apart(values: Array, change: Array, use: Mask) -> Array:
    """Return the square of what changes within stretches, and of all else, shape (2,)."""
    changed = float(np.sum(np.square(change)))
    return np.array([changed, float(np.sum(np.square(values), where=use)) - changed])


def by_chance_elsewhere(
    chain: Chain, effects: Sequence[Effect], train: Sequence[Observation], held_out: Sequence[Observation]
) -> float:
    """Return as ``by_chance`` does of held-out runs, with the share that differs between repeats of those fitted.

    Nothing in runs that are quieter than it would have them: these speak against it.
    """
    chance = [effect for effect in effects if effect.by_chance]
    if not chance or left_beyond(chain, held_out) < QUIET * scatter_of(chain, chance, held_out):
        return 0.0
    return by_chance(chain, chance, held_out, unrepeated(chain, train))


def without_chance(
    chain: Chain, effects: Sequence[Effect], observations: Sequence[Observation], noise_known: float
) -> tuple[float, float]:
    """Return chi-squared less what effects make by chance, and by how much that swells the noise of sums.

    Nothing is their making where all that is left may be noise, whose variance is known to ``noise_known``, and no more
    than hangs together: what comes through G2 does, a noise that is larger than it was taken for does not. Nor is it
    where readings are weighed beside such chance: the weights have it in them.
    """
    chi2, noise = total_chi_squared(chain, observations), round(sum(o.expected for o in observations))
    weighed = any(o.colour.wander is not None for o in observations)
    if weighed or not any(effect.by_chance for effect in effects) or not proven(chi2, noise, noise_known):
        return chi2, 1.0
    together = MORE * _hanging(chain, observations)
    if not together:
        return chi2, 1.0
    made = min(by_chance(chain, effects, observations, unrepeated(chain, observations)), together)
    return max(chi2 - made, min(chi2, noise)), inflation(chain, observations) ** 2


def _hanging(chain: Chain, observations: Sequence[Observation]) -> float:
    """Return how much of chi-squared readings have in common with the next ones and not with those of a repeat.

    0 where chance may make what they have in common; all of it where nothing was repeated.
    """
    common = sum(_in_common(whitened(o, o.residual(chain)), o.use) for o in observations)
    count = sum(int(np.count_nonzero(o.use[:-1] & o.use[1:])) for o in observations)
    return common * _anew(chain, observations) if common > HANGS * sqrt(count) else 0.0


def _anew(chain: Chain, observations: Sequence[Observation]) -> float:
    """Return the share, 1 at most, of what readings have in common with the next ones that no repeat has again."""
    total, changed = 0.0, 0.0
    for o in observations:
        for once, again, both in _compared(chain, o):
            total += 0.5 * (_in_common(once, both) + _in_common(again, both))
            changed += 0.5 * _in_common(once - again, both)
    return min(max(changed / total, 0.0), 1.0) if total > 0.0 else 1.0


def _in_common(values: Array, use: Mask) -> float:
    """Return the sum of the products of neighbours that both count."""
    return float(np.sum(values[:-1] * values[1:], where=use[:-1] & use[1:]))


def left_beyond(chain: Chain, observations: Sequence[Observation]) -> float:
    """Return chi-squared beyond the noise."""
    return total_chi_squared(chain, observations) - sum(o.expected for o in observations)


def sizing(chain: Chain, effects: Sequence[Effect], observations: Sequence[Observation]) -> Pull | None:
    """Return what the scatter tells of the size of what acts by chance: its mean alone leaves that to other values.

    As sure as the noise is that this scatter makes for all that is fitted. None where none can be seen.
    """
    effect = next((effect for effect in effects if effect.by_chance), None)
    swell = inflation(chain, observations) ** 2 if effect else 1.0
    if effect is None or swell == 1.0:
        return None
    changed, size = unrepeated(chain, observations) * left_beyond(chain, observations), effect.parameters()[0].name
    if changed <= 0.0 or chain.values[size] <= 0.0:
        return None
    target = as_large(chain, effect, observations, changed).values[size]
    return Pull(lambda there: log(there.values[size]), log(target), SURE / sqrt(swell))


def all_wanders(hypothesis: Hypothesis, observations: tuple[Observation, ...]) -> bool:
    """Return whether all that a hypothesis leaves may be what its own effects do by chance, which never comes back.

    Where repeats cannot tell, it may.
    """
    chain = hypothesis.fit.chain
    if not any(scatters_all(chain, effect, observations) for effect in hypothesis.effects):
        return False
    left = left_beyond(chain, observations)
    changed, beyond = _misfit_of_repeats(chain, observations)
    return changed >= MOSTLY * beyond and by_chance(chain, hypothesis.effects, observations) >= NEARLY * left


def _misfit_of_repeats(chain: Chain, observations: Sequence[Observation]) -> tuple[float, float]:
    """Return what differs from repeat to repeat and what is left of them in all, both beyond the noise, chi-squared.

    Of single readings, or else of means: what wanders slowly below the noise shows there alone. Zeros where these
    cannot be told. Only what the model answers alike is compared: a first repeat begins from rest, the next where it
    ended.
    """
    for total, changed, count in _of_all_means(chain, observations).tolist():
        if count and total - count > PROVEN * sqrt(2.0 * count):
            return changed - count, total - count
    return 0.0, 0.0


def changes(chain: Chain, observations: Sequence[Observation], plain: Chain | None = None) -> Array:
    """Return by how much repeats differ beyond the noise, chi-squared, and of how many values, shape (1 + slow, 2).

    Of single readings first, then of means over ``SLOW_S``; of those that the ``plain`` chain answers alike, where it
    is given: a law that makes repeats differ is not held against those alone that it leaves alike.
    """
    _, changed, count = _of_all_means(chain, observations, plain).T
    return np.stack((changed - count, count), axis=1)


def _of_all_means(chain: Chain, observations: Sequence[Observation], plain: Chain | None = None) -> Array:
    """Return what ``_of_means`` does of single readings, then of means over ``SLOW_S``, shape (1 + slow, 3)."""
    seen = [(o.trace.rate_hz, list(_compared(chain, o, plain))) for o in observations]
    return np.array([np.sum([_of_means(pairs, s * rate) for rate, pairs in seen], axis=0) for s in (0.0, *SLOW_S)])


def _of_means(pairs: Sequence[tuple[Array, Array, Mask]], samples: float) -> Array:
    """Return the squares of means of a stretch and its repeat, those of their difference, and how many, shape (3,)."""
    size, found = max(round(samples), 1), np.zeros(3)
    for once, again, both in pairs:
        at = np.flatnonzero(both)
        begins = np.arange(0, at.size - size + 1, size)
        if begins.size:
            cut = at[: begins.size * size]
            one, two = (np.add.reduceat(each[cut], begins) / sqrt(size) for each in (once, again))
            found += 0.5 * float(one @ one + two @ two), 0.5 * float((one - two) @ (one - two)), begins.size
    return found


def _compared(
    chain: Chain, observation: Observation, plain: Chain | None = None
) -> Iterator[tuple[Array, Array, Mask]]:
    """Yield what is left of a stretch and of its repeat, and where the model answers both alike and both count.

    Or where the ``plain`` one does, if it is given.
    """
    residual = observation.residual(chain)
    white, alike = whitened(observation, residual), residual if plain is None else observation.residual(plain)
    for once, again, both in compared(observation, alike):
        yield white[once], white[again], both


def compared(observation: Observation, residual: Array) -> Iterator[tuple[slice, slice, Mask]]:
    """Yield where a stretch is, where its repeat is, and where the model answers both alike and both count.

    ``residual`` is what the model leaves, V, shape (N,).
    """
    answer = (observation.trace.y[:] - residual) / observation.noise_v
    for once, again in _repeats(observation):
        alike = np.abs(answer[once] - answer[again]) < 1.0
        yield once, again, observation.use[once] & observation.use[again] & alike


def _repeats(observation: Observation) -> Iterator[tuple[slice, slice]]:
    """Yield stretches of a run in which the same was played, one after another, as far as both were recorded."""
    last: dict[str, slice] = {}
    for step in observation.trace.steps:
        here = slice(step.start, step.stop)
        before = last.get(step.label)
        size = min(here.stop, observation.trace.size) - here.start
        if before is not None and size > 0 and before.stop - before.start == here.stop - here.start:
            yield slice(before.start, before.start + size), slice(here.start, here.start + size)
        last[step.label] = here


def whitened(observation: Observation, residual: Array) -> Array:
    """Return a residual, V, per noise and as white as a fit weighs it, shape (N,): 0 where it does not count."""
    white, use = np.zeros(residual.size), observation.use
    white[use] = whitening(observation.colour)(residual / observation.noise_v, use)
    return white
