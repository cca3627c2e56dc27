"""How is a signal drawn, joined, altered and looked at that is too long to be in memory whole?

What is no longer than ``AT_ONCE`` samples is an array. What is longer is made again, stretch by stretch, whenever a
slice of it is asked for; so whoever walks along it needs memory for a stretch.
"""

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate

import numpy as np

from identify.trace import LONG, Array, Samples, Stored, blocks, frozen
from rig.spool import spooled

AT_ONCE = LONG  # samples: 8 MB


@dataclass(frozen=True)
class Drawing(Stored):
    """A signal of which ``at`` (start, stop) tells the samples [start, stop), V."""

    at: Callable[[int, int], Array]

    def read(self, start: int, stop: int) -> Array:
        """Return the samples [start, stop)."""
        return self.at(start, stop)


@dataclass(frozen=True)
class InTurn(Stored):
    """Signals that follow each other; ``ends`` are where each of them ends."""

    signals: tuple[Samples, ...]
    ends: tuple[int, ...]

    def read(self, start: int, stop: int) -> Array:
        """Return the samples [start, stop)."""
        found, at = [], start
        for index in range(bisect_right(self.ends, start), len(self.ends)):
            first = self.ends[index] - self.signals[index].size
            last = min(stop, self.ends[index])
            found.append(self.signals[index][at - first : last - first])
            at = last
            if at == stop:
                break
        return found[0] if len(found) == 1 else np.concatenate(found)


@dataclass(frozen=True)
class Altered(Stored):
    """A signal of which every sample is changed by itself."""

    signal: Samples
    change: Callable[[Array], Array]

    def read(self, start: int, stop: int) -> Array:
        """Return the samples [start, stop)."""
        return self.change(self.signal[start:stop])


def drawn(size: int, at: Callable[[int, int], Array]) -> Samples:
    """Return the signal whose samples [start, stop) ``at`` tells, at the same values for every way of cutting it."""
    return frozen(at(0, size)) if size <= AT_ONCE else Drawing(size, at)


def drawn_once(size: int, at: Callable[[int, int], Array]) -> Samples:
    """Return the same where telling takes long: what is long stands in a file. Raises FileError without room."""
    return frozen(spooled((at(start, stop)[None] for start, stop in blocks(0, size)), 1)[0])


def joined(signals: Sequence[Samples]) -> Samples:
    """Return signals one after the other."""
    ends = tuple(accumulate(signal.size for signal in signals))
    if ends[-1] <= AT_ONCE:
        return frozen(np.concatenate([signal[:] for signal in signals]))
    return InTurn(ends[-1], tuple(signals), ends)


def altered(signal: Samples, change: Callable[[Array], Array]) -> Samples:
    """Return a signal with every sample changed by itself."""
    return Altered(signal.size, signal, change) if isinstance(signal, Stored) else change(signal)


@dataclass(frozen=True)
class Extremes:
    """The lowest and the highest level of a signal, V, and where each was met last."""

    low_v: float
    low_at: int
    high_v: float
    high_at: int

    @property
    def peak_v(self) -> float:
        """Return the largest magnitude."""
        return max(-self.low_v, self.high_v)


def extremes(signal: Samples) -> Extremes:
    """Return the extremes of a signal, which is not empty."""
    found = [_extremes(signal[start:stop], start) for start, stop in blocks(0, signal.size)]
    low = min(found, key=lambda one: (one.low_v, -one.low_at))
    high = max(found, key=lambda one: (one.high_v, one.high_at))
    return Extremes(low.low_v, low.low_at, high.high_v, high.high_at)


def _extremes(values: Array, start: int) -> Extremes:
    back, last = values[::-1], start + values.size - 1
    low, high = int(np.argmin(back)), int(np.argmax(back))
    return Extremes(float(back[low]), last - low, float(back[high]), last - high)


def steepest(signal: Samples, before: float) -> float:
    """Return the largest difference of two neighbouring samples, the first of which follows the level ``before``."""
    return max(float(moves.max()) for moves in _moves(signal, before))


def first_steeper(signal: Samples, before: float, most: float) -> int:
    """Return the first sample that differs from the one before it by more than ``most``; their number without one."""
    at = 0
    for moves in _moves(signal, before):
        found = np.flatnonzero(moves > most)
        if found.size:
            return at + int(found[0])
        at += moves.size
    return at


def _moves(signal: Samples, before: float) -> Iterator[Array]:
    """Yield by how much every sample differs from the one before it, stretch by stretch."""
    for start, stop in blocks(0, signal.size):
        values = signal[start:stop]
        yield np.abs(np.diff(values, prepend=before))
        before = float(values[-1])


def alike(one: Samples, other: Samples) -> bool:
    """Return whether two signals have the same samples."""
    if one is other:
        return True
    stretches = blocks(0, one.size)
    return one.size == other.size and all(np.array_equal(one[a:b], other[a:b]) for a, b in stretches)
