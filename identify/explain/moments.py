"""What of a mismatch that does not come back with the stimulus goes with the clock: all the time, or at single moments?

What is there while F rests, too, is added behind F; what only shows while F moves happens in F, and so does what is
gone once F has stood at a border for a while: there it remembers nothing. So does what is another after every move of
F, and stays as it is while F rests.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from math import log

import numpy as np

from identify.blocks import Play
from identify.evidence import Evidence
from identify.explain.contact import forgetting, resting
from identify.explain.corrections import free_name, slowest_s
from identify.explain.wander import MOSTLY, unrepeated, whitened
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array, Mask
from identify.unnamed.correction import Correction
from identify.unnamed.timed import GainOverClock, LeadOverClock, Moments, OffsetOverClock

WINDOWS_S = (0.004, 0.02, 0.1, 0.5)
FAINT = 0.01  # of what windows tell on average, below which one tells nothing
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

Table = OffsetOverClock | GainOverClock | LeadOverClock


def wandering(evidence: Evidence) -> Iterator[tuple[Correction, Array, dict[str, float], float]]:
    """Yield tables over the clock as fine as windows, with the square the data give each and its values.

    Of an offset, and of the gain and the delay of the reading; and one of single moments, zero everywhere else, with
    the log of among how many like it it was chosen. Nothing where the mismatch comes back with the stimulus or nothing
    was repeated.
    """
    if unrepeated(evidence.chain, evidence.observations) < MOSTLY:
        return
    place, name = where(evidence), free_name(evidence.chain)
    tables: list[tuple[type[Table], Place, float]] = [(OffsetOverClock, place, each) for each in (*WINDOWS_S, BURST_S)]
    tables += [(kind, Place.SENSE, each) for kind in (GainOverClock, LeadOverClock) for each in WINDOWS_S[1:]]
    left = [_Left(o, o.residual(evidence.chain), evidence.sample_s) for o in evidence.observations]
    for kind, there, window_s in tables:
        parts = [_windows(each, window_s, kind) for each in left]
        at, mean, squares = (np.concatenate([part[i] for part in parts]) for i in range(3))
        knots, looks = tuple(at.tolist()), 0.0
        correction: Correction = kind(there, knots, name)
        if window_s == BURST_S:
            bursts = squares > BURST + 2.0 * log(squares.size)
            correction, mean, squares = Moments(place, knots, name), np.where(bursts, mean, 0.0), squares[bursts]
            looks = squares.size * (1.0 + log(at.size / max(squares.size, 1)))
        values = dict(zip((p.name for p in correction.parameters()), mean.tolist(), strict=True))
        yield correction, squares, values, looks


def where(evidence: Evidence) -> Place:
    """Return F for what is there only while F moves, or only while it remembers, or changes only as it moves.

    Sense for all else.
    """
    chain, remembers = evidence.chain, evidence.chain.stage_of(Play) is not None
    settled, window = (max(round(s / evidence.sample_s), 1) for s in (LAGS * slowest_s(evidence), STEP_S))
    parts, steps = list[list[Array]]([[], [], []]), list[tuple[Array, Array]]()
    for o in evidence.observations:
        white, rests = whitened(o, o.residual(chain)), resting(chain, o)
        forgets = forgetting(chain, o, settled) if remembers else np.zeros_like(rests)
        for part, there in zip(parts, (rests, ~rests, forgets), strict=True):
            part.append(np.square(white[there & o.use]) - 1.0)
        steps.append(_steps(white, rests & o.use, window))
    rest, move, forgotten = (np.concatenate(part) for part in parts)
    if not rest.size or not move.size:
        return Place.SENSE
    if forgotten.size > LEAST and float(np.mean(forgotten)) < NOTHING * float(np.mean(rest)):
        return Place.F
    calm = float(np.mean(rest)) < CALM * float(np.mean(move))
    apart, change = (np.concatenate(each) for each in zip(*steps, strict=True))
    return Place.F if calm or (remembers and _stays(apart, change, 2.0 / window)) else Place.SENSE


def _steps(white: Array, rests: Mask, window: int) -> tuple[Array, Array]:
    """Return how many windows each that F rests in is before the next such one, and the change of the mean between."""
    size = white.size // window * window
    still = rests[:size].reshape(-1, window).all(axis=1)
    level = white[:size].reshape(-1, window).mean(axis=1)[still]
    return np.diff(np.flatnonzero(still)).astype(np.float64), np.diff(level)


def _stays(apart: Array, change: Array, noise: float) -> bool:
    """Return whether what is left is another after every move of F, and stays as it is while F rests.

    From ``_steps`` and the variance that noise gives a change. Windows side by side are compared with those that have a
    move between them, by how fast what is left changes: what drifts or leaps by itself does so at rest, too.
    """
    by_noise, moved = noise / np.square(apart), apart > 1.0
    speeds = np.square(change / apart) - by_noise
    if np.count_nonzero(~moved) < STEPS or np.count_nonzero(moved) < MOVES:
        return False
    seen = float(np.sum(speeds[moved])) > SURE * float(np.sqrt(2.0 * np.sum(np.square(by_noise[moved]))))
    return seen and float(np.mean(speeds[~moved])) < SELDOM * float(np.mean(speeds[moved]))


@dataclass(frozen=True, eq=False)
class _Left:
    """What a chain leaves of one run, V, shape (N,)."""

    observation: Observation
    residual: Array
    sample_s: float

    @cached_property
    def white(self) -> Array:
        """Return it per noise and made white."""
        return whitened(self.observation, self.residual)

    @cached_property
    def answer(self) -> Array:
        """Return what the chain answers, V."""
        return np.asarray(self.observation.trace.y - self.residual)

    def shape(self, kind: type[Table]) -> Array:
        """Return what a weight of a table adds to the answer."""
        if kind is LeadOverClock:
            return np.gradient(self.answer) / self.sample_s
        return self.answer if kind is GainOverClock else np.ones(self.residual.size)


def _windows(left: _Left, window_s: float, kind: type[Table]) -> tuple[Array, Array, Array]:
    """Return the middle of every window on the clock, the weight of a table there, and the square the data give it.

    Where the signal hardly moves in one, nothing is told of a delay, nor of a gain where it is hardly there. The noise
    is that within the windows where it is larger than what was told of it. Noise that hangs together wanders by itself:
    what is weighed is made white.
    """
    use, shape = left.observation.use, left.shape(kind)
    size = max(round(window_s / left.sample_s), 1)
    number = np.arange(use.size) // size
    told = np.bincount(number, np.where(use, np.square(shape), 0.0))
    each = np.maximum(told, 1e-300)
    off = np.bincount(number, np.where(use, shape * left.residual, 0.0)) / each
    level = np.bincount(number, shape * left.white) / each
    middle = left.observation.trace.start_s + (np.arange(told.size) + 0.5) * size * left.sample_s
    kept = told > FAINT * float(np.mean(told))
    scatter = np.where(use, np.square(left.white - shape * level[number]), 0.0)
    free = max(left.observation.count - int(np.sum(kept)), 1)
    noise2 = max(float(np.sum(scatter)) / free, 1.0)
    squares = told * np.square(level) / noise2
    return np.asarray(middle[kept], dtype=np.float64), off[kept], np.asarray(squares[kept], dtype=np.float64)
