"""What of a mismatch that does not come back with the stimulus goes with the clock: all the time, or at single moments?

What is there while F rests, too, is added behind F; what only shows while F moves happens in F, and so does what is
gone once F has stood at a border for a while: there it remembers nothing. So does what is another after every move of
F, and stays as it is while F rests.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import log, sqrt

import numpy as np
from numpy.typing import NDArray

from identify.blocks import Play
from identify.chain import Chain
from identify.discretise import Matrix
from identify.effects.effect import Effect
from identify.evidence import Evidence
from identify.explain.contact import forgetting, resting
from identify.explain.corrections import free_name, slowest_s
from identify.explain.wander import MOSTLY, PROVEN, compared, left_beyond, unrepeated, whitened
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
COMES_BACK = 0.5  # of what is left in a window, from which a repeat that is off as far has it, too
CHANCE = 0.05  # that no burst of so many is where F rests
LAGS = 5.0  # times the slowest lag, after which what F remembered has passed

Table = OffsetOverClock | GainOverClock | LeadOverClock
Wandering = tuple[Correction, Array, dict[str, float], float]  # with squares, values, and looks as a suspect has them


def wandering(evidence: Evidence) -> Iterator[Wandering]:
    """Yield tables over the clock as fine as windows, with the square the data give each and its values.

    Of an offset, and of the gain and the delay of the reading; and one of single moments, zero everywhere else, with
    the log of among how many like it it was chosen: that alone where all together is no more than noise, no repeat has
    it, too, and nothing acts by chance. Nothing where the mismatch comes back with the stimulus or nothing was
    repeated.
    """
    name, left = free_name(evidence.chain), [_Left(o, evidence.chain, evidence.sample_s) for o in evidence.observations]
    differs = unrepeated(evidence.chain, evidence.observations) >= MOSTLY
    if not differs and (_by_chance(evidence.chain) or not _is_noise(evidence)):
        return
    at, mean, squares, kept = _all_windows(left, BURST_S, OffsetOverClock)
    bursts = squares > BURST + 2.0 * log(max(squares.size, 1))
    if differs:
        place = where(evidence)
        yield from _tables(left, place, name)
    elif np.any(bursts) and np.any(bursts := bursts & _of_all(_alone, left)[kept]):
        place = _where_at(_of_all(_rests, left)[kept], bursts)
    else:
        return
    found, mean = squares[bursts], np.where(bursts, mean, 0.0)
    looks = found.size * (1.0 + log(at.size / max(found.size, 1)))
    yield _table(Moments(place, tuple(at.tolist()), name), mean, found, looks)


def _tables(left: Sequence["_Left"], place: Place, name: str) -> Iterator[Wandering]:
    """Yield those of an offset that came in at a place, of the gain and of the delay of the reading."""
    kinds: list[tuple[type[Table], Place, float]] = [(OffsetOverClock, place, each) for each in WINDOWS_S]
    kinds += [(kind, Place.SENSE, each) for kind in (GainOverClock, LeadOverClock) for each in WINDOWS_S[1:]]
    for kind, there, window_s in kinds:
        at, mean, squares, _ = _all_windows(left, window_s, kind)
        yield _table(kind(there, tuple(at.tolist()), name), mean, squares)


def _table(correction: Correction, weights: Array, squares: Array, looks: float = 0.0) -> Wandering:
    """Return a table with its weights by name."""
    names = (p.name for p in correction.parameters())
    return correction, squares, dict(zip(names, weights.tolist(), strict=True)), looks


def _by_chance(chain: Chain) -> bool:
    """Return whether physics in a chain acts by chance, and makes moments that no repeat has, too."""
    return any(isinstance(physics, Effect) and physics.by_chance for physics in chain.added)


def _is_noise(evidence: Evidence) -> bool:
    """Return whether what is left of all runs together is no more than noise may leave."""
    count = sum(o.count for o in evidence.observations)
    return left_beyond(evidence.chain, evidence.observations) < PROVEN * sqrt(2.0 * count)


def _where_at(rests: Mask, bursts: Mask) -> Place:
    """Return F for so many bursts in windows in which it moves that chance would have put one where it ``rests``."""
    by_chance = float(np.mean(~rests)) ** int(np.count_nonzero(bursts))
    return Place.F if by_chance < CHANCE and not np.any(rests & bursts) else Place.SENSE


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
    chain: Chain
    sample_s: float

    @cached_property
    def residual(self) -> Array:
        """Return it."""
        return self.observation.residual(self.chain)

    @cached_property
    def beside(self) -> Matrix:
        """Return what is left, per noise, of the repeats before and after every sample, shape (2, N): NaN of none."""
        found = np.full((2, self.white.size), np.nan)
        for once, again, both in compared(self.observation, self.residual):
            found[0, again] = np.where(both, self.white[once], np.nan)
            found[1, once] = np.where(both, self.white[again], np.nan)
        return found

    @cached_property
    def white(self) -> Array:
        """Return it per noise and made white."""
        return whitened(self.observation, self.residual)

    @cached_property
    def answer(self) -> Array:
        """Return what the chain answers, V."""
        return np.asarray(self.observation.trace.y - self.residual)

    def size(self, window_s: float) -> int:
        """Return the samples of a window."""
        return max(round(window_s / self.sample_s), 1)

    def windows(self, window_s: float) -> NDArray[np.intp]:
        """Return the number of the window that every sample is in, shape (N,)."""
        return np.asarray(np.arange(self.observation.use.size) // self.size(window_s), dtype=np.intp)

    def shape(self, kind: type[Table]) -> Array:
        """Return what a weight of a table adds to the answer."""
        if kind is LeadOverClock:
            return np.gradient(self.answer) / self.sample_s
        return self.answer if kind is GainOverClock else np.ones(self.residual.size)


def _alone(left: _Left) -> Mask:
    """Return which windows have a repeat beside them that tells, and none that is off by as much as half of theirs."""
    own, *others = (np.bincount(left.windows(BURST_S), row) for row in (left.white, *left.beside))
    seen = np.any([np.isfinite(other) for other in others], axis=0)
    comes_back = np.any([np.abs(other) > COMES_BACK * np.abs(own) for other in others], axis=0)
    return np.asarray(seen & ~comes_back)


def _rests(left: _Left) -> Mask:
    """Return the windows in all of which F rests."""
    return np.asarray(np.bincount(left.windows(BURST_S), ~resting(left.chain, left.observation)) == 0)


def _of_all(tell: Callable[[_Left], Mask], left: Sequence[_Left]) -> Mask:
    """Return what is told of the windows of all runs, in a row."""
    return np.concatenate([tell(each) for each in left])


def _all_windows(left: Sequence[_Left], window_s: float, kind: type[Table]) -> tuple[Array, Array, Array, Mask]:
    """Return what ``_windows`` does of all runs, in a row."""
    parts = [_windows(one, window_s, kind) for one in left]
    at, mean, squares, kept = (np.concatenate(each) for each in zip(*parts, strict=True))
    return at, mean, squares, kept


def _windows(left: _Left, window_s: float, kind: type[Table]) -> tuple[Array, Array, Array, Mask]:
    """Return the middle of every window on the clock, the weight of a table there, and the square the data give it.

    And which of all windows these are.

    Where the signal hardly moves in one, nothing is told of a delay, nor of a gain where it is hardly there. The noise
    is that within the windows where it is larger than what was told of it. Noise that hangs together wanders by itself:
    what is weighed is made white.
    """
    use, shape = left.observation.use, left.shape(kind)
    number = left.windows(window_s)
    told = np.bincount(number, np.where(use, np.square(shape), 0.0))
    each = np.maximum(told, 1e-300)
    off = np.bincount(number, np.where(use, shape * left.residual, 0.0)) / each
    level = np.bincount(number, shape * left.white) / each
    middle = left.observation.trace.start_s + (np.arange(told.size) + 0.5) * left.size(window_s) * left.sample_s
    kept = told > FAINT * float(np.mean(told))
    scatter = np.where(use, np.square(left.white - shape * level[number]), 0.0)
    free = max(left.observation.count - int(np.sum(kept)), 1)
    noise2 = max(float(np.sum(scatter)) / free, 1.0)
    squares = told * np.square(level) / noise2
    return np.asarray(middle[kept], dtype=np.float64), off[kept], np.asarray(squares[kept], dtype=np.float64), kept
