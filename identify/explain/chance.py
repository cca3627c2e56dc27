"""Does physics that acts by chance scatter more than is left of the readings?

Of noise in front of the gap the catalogue's law is the mean of what it does to w. Beside that, w wanders from moment to
moment, and that must be in the readings: a law that implies more of it than a model leaves in all is not at work. Where
all that is left may be such wandering, no further physics is looked for in it.
"""

from collections.abc import Sequence

import numpy as np

from identify.chain import Chain, advance, grid_of
from identify.colour import whitening
from identify.effects.effect import Effect, short
from identify.observe import Observation
from identify.stage import Block, Run
from identify.trace import Array

INSTANTS = 1 << 18  # of a run that are looked at, at most
COURSES = 2
TURNS = 3  # of sizing an effect
MORE = 2.0  # in energy: courses of chance differ, and a fit of their mean tells their size roughly


def scatters_more(chain: Chain, effect: Effect, observations: tuple[Observation, ...]) -> bool:
    """Return whether what an effect in a chain does by chance is more than all that the chain leaves of readings."""
    if not effect.by_chance:
        return False
    scattered, left, _ = _energies(chain, effect, observations)
    return scattered > MORE * left


def scatters_all(chain: Chain, effect: Effect, observations: tuple[Observation, ...]) -> bool:
    """Return whether what a chain leaves beyond the noise may be what an effect in it does by chance."""
    if not effect.by_chance:
        return False
    scattered, left, noise = _energies(chain, effect, observations)
    return left - noise < MORE * scattered


def scatter_of(chain: Chain, effects: Sequence[Effect], observations: Sequence[Observation]) -> float:
    """Return what effects in a chain do by chance, in chi-squared; 0 where none acts by chance."""
    total = 0.0
    for number, o in enumerate(observations):
        made = scatter_in(chain, effects, o, number)
        total += float(made @ made) * o.count / max(int(np.count_nonzero(o.use[: made.size])), 1)
    return total


def scatter_in(chain: Chain, effects: Sequence[Effect], observation: Observation, number: int) -> Array:
    """Return a course of what effects do by chance in a run, per noise and made white, shape (N,).

    0 where a reading does not count; of a long run the beginning. ``number`` is its own: each has a course of its own.
    """
    use = observation.use[: _samples(observation)]
    made = np.zeros(use.size)
    for effect in (e for e in effects if e.by_chance):
        course = _course(chain, effect, observation, number)
        made[use] += whitening(observation.colour)(course / observation.noise_v, use)
    return made


def as_large(chain: Chain, effect: Effect, observations: Sequence[Observation], chi2: float) -> Chain:
    """Return a chain with an effect as strong as makes so much of chi-squared by chance; its first number is its size.

    What it makes goes with the square of its size, nearly.
    """
    size = effect.parameters()[0].name
    for _ in range(TURNS):
        made = scatter_of(chain, (effect,), observations)
        if made <= 0.0:
            break
        chain = chain.with_values({size: chain.values[size] * float(np.clip(np.sqrt(chi2 / made), 0.1, 10.0))})
    return chain


def _energies(chain: Chain, effect: Effect, observations: tuple[Observation, ...]) -> tuple[float, float, float]:
    """Return what an effect does by chance, what a chain leaves, and what the noise makes of that, V^2 samples."""
    scattered, left, noise = 0.0, 0.0, 0.0
    for number, o in enumerate(observations):
        use = o.use[: _samples(o)]
        scattered += float(np.sum(np.square(_course(chain, effect, o, number)[use])))
        left += float(np.sum(np.square(o.residual(chain)[: use.size][use])))
        noise += o.noise_v**2 * float(np.sum(use))
    return scattered, left, noise


def _samples(observation: Observation) -> int:
    """Return how many samples of a run are looked at."""
    return min(observation.trace.size, INSTANTS // observation.substeps)


def _course(chain: Chain, effect: Effect, observation: Observation, number: int) -> Array:
    """Return a course of what an effect's noise does to the answer beside the mean of it, V, from two of its own."""
    first, second = _courses(chain, effect, observation, number)
    return np.asarray((first - second) / np.sqrt(2.0))


def _courses(chain: Chain, effect: Effect, observation: Observation, number: int) -> list[Array]:
    """Return answers in which the effect's noise takes different courses, V."""
    grid, size = grid_of(observation.trace, observation.substeps), _samples(observation) * observation.substeps
    quiet = chain.with_values({p.name: effect.absent[short(p.name)] for p in effect.parameters()})
    at, values = quiet.index(effect.place), [chain.values[p.name] for p in effect.parameters()]
    noises = [effect.course(values, grid, size, np.random.default_rng([number, i])) for i in range(COURSES)]
    head, tails = quiet.begin(grid)[:at], [quiet.begin(grid, at) for _ in noises]
    answers: list[list[Array]] = [[] for _ in noises]
    for piece in observation.pieces():
        block = piece.entering
        for stage in head:
            block = advance(stage, block)
        for noise, tail, answer in zip(noises, tails, answers, strict=True):
            answer.append(_behind(tail, block, noise[block.first : block.first + block.signal.size]))
        if block.first + block.signal.size >= size:
            break
    return [np.concatenate(answer)[: _samples(observation)] for answer in answers]


def _behind(tail: Sequence[Run], block: Block, noise: Array) -> Array:
    """Return what the rest of a chain answers where noise is added, at the samples."""
    noisy = block.signal + np.pad(noise, (0, block.signal.size - noise.size))
    block = block.holding(noisy)
    for stage in tail:
        block = advance(stage, block)
    return block.signal[:: block.grid.substeps]
