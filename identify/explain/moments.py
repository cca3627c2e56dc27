"""What of a mismatch that does not come back with the stimulus goes with the clock: all the time, or at single moments?

What is there while F rests, too, is added behind F; what only shows while F moves happens in F, and so does what is
gone once F has stood at a border for a while: there it remembers nothing.
"""

from collections.abc import Iterator
from math import log

import numpy as np

from identify.blocks import Play
from identify.evidence import Evidence
from identify.explain.contact import forgetting, resting
from identify.explain.corrections import free_name, slowest_s
from identify.explain.wander import MOSTLY, unrepeated, whitened
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.timed import ClockMap, Moments

WINDOWS_S = (0.004, 0.02, 0.1)
BURST_S = 0.001  # the window in which single moments are sought
BURST = 9.0  # of chi-squared, beyond what the largest of all windows has by chance, from which something happened there
CALM = 0.25  # of the misfit while F moves, below which what is left at rest is not the same thing
NOTHING = 0.1  # of the misfit at rest, below which nothing is left where F remembers nothing
LEAST = 2000  # readings that tell so
STEP_S = 0.02  # the window whose mean says where the reading rests
SELDOM = 0.1  # of the mean square speed at which what is left changes while F moves: at rest it stays as it is
SURE = 6.0  # standard deviations of noise, from which it changes
STEPS, MOVES = 20, 5  # from window to window, at rest and with a move between them, that tell so
LAGS = 5.0  # times the slowest lag, after which what F remembered has passed


def wandering(evidence: Evidence) -> Iterator[tuple[Correction, Array, dict[str, float], float]]:
    """Yield tables over the clock as fine as windows, with the square the data give each and its values.

    And one of single moments, zero everywhere else, with the log of among how many like it it was chosen. Nothing where
    the mismatch comes back with the stimulus or nothing was repeated.
    """
    if unrepeated(evidence.chain, evidence.observations) < MOSTLY:
        return
    place, name = where(evidence), free_name(evidence.chain)
    for window_s in (*WINDOWS_S, BURST_S):
        parts = [_windows(o, evidence, window_s) for o in evidence.observations]
        at, mean, squares = (np.concatenate([part[i] for part in parts]) for i in range(3))
        knots, looks = tuple(at.tolist()), 0.0
        correction = ClockMap(place, knots, name)
        if window_s == BURST_S:
            bursts = squares > BURST + 2.0 * log(squares.size)
            correction, mean, squares = Moments(place, knots, name), np.where(bursts, mean, 0.0), squares[bursts]
            looks = squares.size * (1.0 + log(at.size / max(squares.size, 1)))
        values = dict(zip((p.name for p in correction.parameters()), mean.tolist(), strict=True))
        yield correction, squares, values, looks


def where(evidence: Evidence) -> Place:
    """Return F for what is there only while F moves, or only while it remembers; sense for all else."""
    chain, remembers = evidence.chain, evidence.chain.stage_of(Play) is not None
    settled = round(LAGS * slowest_s(evidence) / evidence.sample_s)
    parts: list[list[Array]] = [[], [], []]
    for o in evidence.observations:
        beyond, rests = np.square(whitened(o, o.residual(chain))) - 1.0, resting(chain, o)
        forgets = forgetting(chain, o, settled) if remembers else np.zeros_like(rests)
        for part, there in zip(parts, (rests, ~rests, forgets), strict=True):
            part.append(beyond[there & o.use])
    rest, move, forgotten = (np.concatenate(part) for part in parts)
    if not rest.size or not move.size:
        return Place.SENSE
    if forgotten.size > LEAST and float(np.mean(forgotten)) < NOTHING * float(np.mean(rest)):
        return Place.F
    calm = float(np.mean(rest)) < CALM * float(np.mean(move))
    return Place.F if calm or stays_at_rest(evidence) else Place.SENSE


def stays_at_rest(evidence: Evidence) -> bool:
    """Return whether what is left is another after every move of F, and stays as it is while F rests.

    Windows in which F rests are compared with the next one, by how fast what is left changes from one to the other, the
    noise of both means taken off: side by side, or with a move between them. What drifts or leaps by itself does so at
    rest, too.
    """
    size = max(round(STEP_S / evidence.sample_s), 1)
    apart = [_steps(o, evidence, size) for o in evidence.observations]
    gap, squares = (np.concatenate([part[i] for part in apart]) for i in range(2))
    resting_on, moved = squares[gap == 1.0], squares[gap > 1.0]
    if resting_on.size < STEPS or moved.size < MOVES:
        return False
    noise = 2.0 / size / np.square(gap[gap > 1.0])
    seen = float(np.sum(moved)) > SURE * float(np.sqrt(2.0 * np.sum(np.square(noise))))
    return seen and float(np.mean(resting_on)) < SELDOM * float(np.mean(moved))


def _steps(observation: Observation, evidence: Evidence, size: int) -> tuple[Array, Array]:
    """Return how many windows a window at rest and the next such one are apart, and the square of the speed of change.

    Speeds in noises a window, the square less that of noise.
    """
    chain, many = evidence.chain, observation.trace.size // size
    shape, end = (many, size), many * size
    still = (resting(chain, observation) & observation.use)[:end].reshape(shape).all(axis=1)
    level = whitened(observation, observation.residual(chain))[:end].reshape(shape).mean(axis=1)
    gap = np.diff(np.flatnonzero(still)).astype(np.float64)
    return gap, (np.square(np.diff(level[still])) - 2.0 / size) / np.square(gap)


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
    white = whitened(observation, residual)
    level = np.bincount(number, white) / each
    middle = observation.trace.start_s + (np.arange(count.size) + 0.5) * size * evidence.sample_s
    kept = count > 0
    scatter = np.where(observation.use, np.square(white - level[number]), 0.0)
    noise2 = max(float(np.sum(scatter)) / max(float(np.sum(count - 1.0, where=kept)), 1.0), 1.0)
    squares = count * np.square(level) / noise2
    return np.asarray(middle[kept], dtype=np.float64), mean[kept], np.asarray(squares[kept], dtype=np.float64)
