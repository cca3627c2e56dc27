"""Where has F been: how far did v swing, and over which stretch of each border did it move?"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from identify.bent.curved import CurvedPlay
from identify.blocks import Play
from identify.chain import Chain, advance, grid_of
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array

TOUCH = 1e-9  # distance from a border, relative to the span of w, that is nothing but rounding


@dataclass(frozen=True)
class Range:
    """The least and the largest value met, V; empty (low above high) when none was."""

    low: float = float("inf")
    high: float = float("-inf")

    @property
    def empty(self) -> bool:
        """Return whether nothing was met."""
        return self.low > self.high

    def with_values(self, values: Array) -> "Range":
        """Return the range widened by more values."""
        if values.size == 0:
            return self
        return Range(min(self.low, float(np.min(values))), max(self.high, float(np.max(values))))


@dataclass(frozen=True)
class Visits:
    """The ranges of v and w, V, and of v while on the loading and on the unloading border."""

    v: Range = Range()
    w: Range = Range()
    loading: Range = Range()
    unloading: Range = Range()

    @property
    def moved(self) -> bool:
        """Return whether w ever left its first level."""
        return self.w.high > self.w.low


def visits(chain: Chain, observations: Sequence[Observation]) -> Visits:
    """Return where a chain with a play was during all observations; ValueError for one without."""
    found = Visits()
    for observation in observations:
        found = _visited(chain, observation, found)
    return found


def _borders(chain: Chain) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
    """Return w on the loading and on the unloading border, V, by v; ValueError for a chain without a play."""
    play, curved = chain.stage_of(Play), chain.stage_of(CurvedPlay)
    if curved is not None:
        low, high = curved.borders(chain.of(curved, ""))
        return low.at, high.at
    if play is None:
        raise ValueError("a rig without backlash has no borders to visit")
    s_l, d_l, s_u, d_u = chain.of(play, "")[:4]  # a leak adds values of its own
    return lambda v: s_l * (v - d_l), lambda v: s_u * (v - d_u)


def _visited(chain: Chain, observation: Observation, found: Visits) -> Visits:
    """Return the visits widened by one run, walked chunk by chunk."""
    grid = grid_of(observation.trace, observation.substeps)
    loading, unloading = _borders(chain)
    runs = chain.begin(grid)[: chain.index(Place.G1) + 1]
    for piece in observation.pieces():
        v = piece.entering
        for stage in runs[:-1]:
            v = advance(stage, v)
        w = runs[-1](v)
        near = TOUCH * max(float(np.max(np.abs(w))), 1e-3)
        found = Visits(
            found.v.with_values(v.signal), found.w.with_values(w),
            found.loading.with_values(v.signal[w <= loading(v.signal) + near]),
            found.unloading.with_values(v.signal[w >= unloading(v.signal) - near]),
        )  # fmt: skip
    return found
