"""What does a picture hold against the recordings: a chain under the name and look it has in every picture?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.chain import Chain
from identify.observe import Observation, rms
from identify.page.drawing import Look
from identify.trace import Array

DRAWN = 1 << 21  # samples of a run, at most: drawing needs all of them in memory
SHORTEST, LONGEST, SHARE = 300, 1500, 0.05  # samples of the stretch that is looked at closely; its share of a run


@dataclass(frozen=True)
class Answer:
    """A chain under the name and look it has in every picture, beside the runs it is held against."""

    label: str
    look: Look
    chain: Chain
    observations: tuple[Observation, ...]

    @cached_property
    def misfits(self) -> tuple[Array, ...]:
        """Return recording less model of every run, V, also where a sample does not count."""
        return tuple(o.residual(self.chain) for o in self.observations)

    @cached_property
    def residuals(self) -> tuple[Array, ...]:
        """Return the residual of every run, V; NaN where a sample does not count."""
        return tuple(np.where(o.use, e, np.nan) for o, e in zip(self.observations, self.misfits, strict=True))

    def left(self, row: int) -> float:
        """Return the rms of a run's residual, V; 0 where no sample counts."""
        e = self.residuals[row]
        return rms(e[np.isfinite(e)])

    @property
    def name(self) -> str:
        """Return the label in one word where there is one, for where there is little room."""
        return self.label.removesuffix(" model")


def beginnings(observations: Sequence[Observation]) -> tuple[Observation, ...]:
    """Return of every run what is drawn of it."""
    return tuple(o.until(DRAWN) for o in observations)


def cut(observations: Sequence[Observation]) -> str:
    """Return a sentence that says how much of long runs is drawn, nothing where all of them is."""
    return f" A long run is drawn up to sample {DRAWN}." if any(o.trace.size == DRAWN for o in observations) else ""


def worst(residual: Array) -> slice:
    """Return the stretch in which a residual is largest, samples."""
    size = _stretch(residual.size)
    energy = np.concatenate(([0.0], np.cumsum(np.square(np.nan_to_num(residual)))))
    first = int(np.argmax(energy[size:] - energy[:-size]))
    return slice(first, first + size)


def liveliest(observation: Observation) -> tuple[slice, float]:
    """Return the stretch in which the readings that count swing most, samples, and by how much they do, V."""
    size = _stretch(observation.trace.size)
    y = np.where(observation.use, observation.trace.y[:], np.nan)
    firsts = range(0, y.size - size + 1, max(size // 4, 1))
    swing = [np.fmax.reduce(y[a : a + size]) - np.fmin.reduce(y[a : a + size]) for a in firsts]
    at = int(np.argmax(np.nan_to_num(swing)))
    return slice(firsts[at], firsts[at] + size), float(np.nan_to_num(swing[at]))


def _stretch(samples: int) -> int:
    """Return how many samples of a run are looked at closely."""
    return min(samples, int(np.clip(SHARE * samples, SHORTEST, LONGEST)))
