"""Does a mismatch come back when the same is played again, and if not, does it need the signal to move?

What physics without chance makes is the same in every repeat of a stimulus. What is not, wanders by itself: where it is
there while F rests it is added behind F, where it only shows while F moves it happens in F.
"""

from collections.abc import Iterator, Sequence
from math import log, sqrt

import numpy as np

from identify.chain import Chain, signals
from identify.colour import whitening
from identify.effects.effect import Effect
from identify.evidence import Evidence
from identify.explain.chance import MORE, as_large, scatter_of, scatters_all
from identify.explain.corrections import free_name
from identify.explain.hypothesis import Hypothesis
from identify.fit import Pull, chi_squared
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array, Mask
from identify.uncertainty.inflation import inflation
from identify.unnamed.correction import Correction
from identify.unnamed.maps import ClockMap

WINDOWS_S = (0.004, 0.02, 0.1)
MOSTLY = 0.5  # share of a misfit that must not come back
STILL = 1e-3  # of the largest rate of w, below which it rests
SURE = 0.2  # of the log of a size that scatter tells: courses of chance differ
CALM = 0.25  # of the misfit while F moves, below which what is left at rest is not the same thing


def wandering(evidence: Evidence) -> Iterator[tuple[Correction, Array, dict[str, float]]]:
    """Yield tables over the clock as fine as windows, with the square the data give each and its values.

    Nothing where the mismatch comes back with the stimulus or nothing was repeated.
    """
    if unrepeated(evidence.chain, evidence.observations) < MOSTLY:
        return
    place, name = where(evidence), free_name(evidence.chain)
    for window_s in WINDOWS_S:
        parts = [_windows(o, evidence, window_s) for o in evidence.observations]
        at, mean, squares = (np.concatenate([part[i] for part in parts]) for i in range(3))
        correction = ClockMap(place, tuple(at.tolist()), name)
        yield correction, squares, dict(zip((p.name for p in correction.parameters()), mean.tolist(), strict=True))


def unrepeated(chain: Chain, observations: Sequence[Observation]) -> float:
    """Return the share of the misfit that differs from repeat to repeat; 0 where nothing was repeated."""
    changed, beyond = _misfit_of_repeats(chain, observations)
    return changed / beyond if beyond else 0.0


def by_chance(
    chain: Chain, effects: Sequence[Effect], train: Sequence[Observation], chi2: float, held: Sequence[Observation]
) -> float:
    """Return how much of chi-squared beyond the noise on ``held`` effects make by chance, which no model foretells.

    No more than the share that differs between the repeats in the runs that were fitted.
    """
    if not any(effect.by_chance for effect in effects):
        return 0.0
    changed = min(unrepeated(chain, train), 1.0) * (chi2 - sum(o.count for o in held))
    return min(MORE * scatter_of(chain, effects, held), changed) if changed > 0.0 else 0.0


def sizing(chain: Chain, effects: Sequence[Effect], observations: Sequence[Observation]) -> Pull | None:
    """Return what the scatter tells of the size of what acts by chance: its mean alone leaves that to other values.

    As sure as the noise is that this scatter makes for all that is fitted. None where none can be seen.
    """
    effect = next((effect for effect in effects if effect.by_chance), None)
    swell = inflation(chain, observations) ** 2 if effect else 1.0
    if effect is None or swell == 1.0:
        return None
    beyond = sum(chi_squared(chain, o) - o.count for o in observations)
    changed, size = min(unrepeated(chain, observations), 1.0) * beyond, effect.parameters()[0].name
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
    changed, beyond = _misfit_of_repeats(chain, observations)
    return changed >= MOSTLY * beyond


def _misfit_of_repeats(chain: Chain, observations: Sequence[Observation]) -> tuple[float, float]:
    """Return what differs from repeat to repeat and what is left of them in all, both beyond the noise, chi-squared.

    Zeros where these cannot be told. Only what the model answers alike is compared: a first repeat begins from rest,
    the next where it ended.
    """
    total, changed, count = 0.0, 0.0, 0
    for o in observations:
        residual = o.residual(chain)
        answer, residual = (o.trace.y[:] - residual) / o.noise_v, _white(o, residual)
        for once, again in _repeats(o):
            both = o.use[once] & o.use[again] & (np.abs(answer[once] - answer[again]) < 1.0)
            a, b = residual[once][both], residual[again][both]
            total += 0.5 * float(a @ a + b @ b)
            changed += 0.5 * float(np.sum(np.square(a - b)))
            count += a.size
    beyond = total - count
    return (changed - count, beyond) if count and beyond > 6.0 * np.sqrt(2.0 * count) else (0.0, 0.0)


def _repeats(observation: Observation) -> Iterator[tuple[slice, slice]]:
    """Yield stretches of a run in which the same was played, one after another."""
    last: dict[str, slice] = {}
    for step in observation.trace.steps:
        here = slice(step.start, step.stop)
        before = last.get(step.label)
        if before is not None and before.stop - before.start == here.stop - here.start:
            yield before, here
        last[step.label] = here


def where(evidence: Evidence) -> Place:
    """Return sense for what is there while F rests, too, else F."""
    resting, moving = [], []
    for o in evidence.observations:
        beyond = np.square(_white(o, o.residual(evidence.chain))) - 1.0
        still = _still(evidence.chain, o)
        resting.append(beyond[still & o.use])
        moving.append(beyond[~still & o.use])
    rest, move = (np.concatenate(parts) for parts in (resting, moving))
    if not rest.size or not move.size:
        return Place.SENSE
    return Place.F if float(np.mean(rest)) < CALM * float(np.mean(move)) else Place.SENSE


def _still(chain: Chain, observation: Observation) -> Mask:
    """Return where the signal behind G2 hardly moves: F rests and its last move has passed."""
    level = signals(chain, observation.trace)[chain.index(Place.G2) - 1]
    rate = np.abs(np.diff(level, prepend=level[:1]))
    return np.asarray(rate < STILL * float(np.max(rate)), dtype=np.bool_)


def _windows(observation: Observation, evidence: Evidence, window_s: float) -> tuple[Array, Array, Array]:
    """Return the middle of every window on the clock, the mean residual in it in V, and its weight in chi-squared.

    The noise is that within the windows where it is larger than what was told of it. Noise that hangs together wanders
    by itself: what is weighed is made white.
    """
    size = max(round(window_s / evidence.sample_s), 1)
    number = np.arange(observation.trace.size) // size
    residual = observation.residual(evidence.chain)
    count = np.bincount(number, observation.use)
    each = np.maximum(count, 1)
    mean = np.bincount(number, np.where(observation.use, residual, 0.0)) / each
    white = _white(observation, residual)
    level = np.bincount(number, white) / each
    middle = observation.trace.start_s + (np.arange(count.size) + 0.5) * size * evidence.sample_s
    kept = count > 0
    scatter = np.where(observation.use, np.square(white - level[number]), 0.0)
    noise2 = max(float(np.sum(scatter)) / max(float(np.sum(count - 1.0, where=kept)), 1.0), 1.0)
    squares = count * np.square(level) / noise2
    return np.asarray(middle[kept], dtype=np.float64), mean[kept], np.asarray(squares[kept], dtype=np.float64)


def _white(observation: Observation, residual: Array) -> Array:
    """Return a residual, V, per noise and as white as a fit weighs it, shape (N,): 0 where it does not count."""
    white, use = np.zeros(residual.size), observation.use
    white[use] = whitening(observation.colour)(residual / observation.noise_v, use)
    return white
