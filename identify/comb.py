"""How large are the steps of a source that rounds, if the residual is the error of that?

The error of rounding is a sawtooth over u, and the size of a step its period: nothing leads from a wrong period to the
right one, so all are compared. What is held long weighs most: the answers to small changes of those levels of u alone
are simulated once, and what rounding to any step would gain is then algebra.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain, grid_of, running
from identify.observe import Observation
from identify.stage import Block
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

COARSEST, FINEST = 16, 1 << 19  # steps in the range of u: 4 to 19 bits
MOST, RARE = 32, 0.04  # levels that are looked at, and the share of the commonest one's samples that each has at least
SMALL = 1e-4  # of the range of u: the change of a level that is passed on
ROOM = 10.0  # sizes compared for every tooth more in the range of the levels
LISTED = 3000  # sizes that promise most, of which no two are alike enough to be found more closely twice
NARROWED, BETWEEN = 60, 0.4  # sizes that are found more closely, and how many teeth they lie apart
ZOOMS, POINTS, CLOSER = 4, 41, 8.0
EDGE = 0.02  # share of the sizes that round alike, from an edge
AT_ONCE = 1 << 13  # sizes compared at once: bounds memory
SAME_V = 3e-10  # sizes so close round alike


def rounded(u: Array, lsb: float) -> Array:
    """Return u in whole steps; how many they are changes only with whole ``SAME_V`` of a step, their size with it."""
    return np.asarray(lsb * np.round(u / (SAME_V * np.round(lsb / SAME_V))))


def centred(lsb: float) -> float:
    """Return the size amid those that round alike."""
    return float(SAME_V * np.round(lsb / SAME_V))


@dataclass(frozen=True, eq=False)
class Comb:
    """Levels of u, V, and the fall of chi-squared as a quadratic form of errors e of them: 2 right e - e matrix e."""

    levels: Array
    matrix: NDArray[np.float64]
    right: Array

    @cached_property
    def folded(self) -> "Comb":
        """Return the same of levels above 0 V alone: a level and its opposite are rounded to opposites."""
        sizes, which = np.unique(np.abs(self.levels), return_inverse=True)
        fold = np.zeros((sizes.size, self.levels.size))
        fold[which, np.arange(self.levels.size)] = np.sign(self.levels)
        return Comb(sizes, fold @ self.matrix @ fold.T, fold @ self.right)

    @cached_property
    def most(self) -> float:
        """Return the fall of chi-squared that errors of any kind could bring."""
        return float(self.right @ np.linalg.lstsq(self.matrix, self.right)[0]) if self.levels.size else 0.0

    def gains(self, lsb: Array) -> Array:
        """Return the fall of chi-squared that rounding to each of some steps promises."""
        levels, matrix, right = self.folded.levels, self.folded.matrix, self.folded.right
        found = [np.empty(0)]
        for first in range(0, lsb.size, AT_ONCE):
            step = lsb[first : first + AT_ONCE]
            error = np.rint(levels[:, None] / step) * step - levels[:, None]
            found.append(np.einsum("ij,ij->j", error, 2.0 * right[:, None] - matrix @ error))
        return np.concatenate(found)

    def best(self, range_v: float, count: int) -> list[float]:
        """Return the steps, V, of 4 to 19 bits in the range of u that promise most, the best first."""
        reach = float(np.ptp(self.levels, axis=0)) if self.levels.size > 1 else 0.0
        if reach == 0.0:
            return []
        teeth = np.arange(COARSEST * reach / range_v, FINEST * reach / range_v, 1.0 / ROOM)
        lsb = reach / teeth
        gains = self.gains(lsb)
        first = np.argpartition(-gains, min(LISTED, lsb.size - 1))[:LISTED]
        likely = _apart(lsb[first[np.argsort(-gains[first])]], BETWEEN / reach, NARROWED)
        near = np.array([self._narrowed(step, 0.5 * step * step / reach) for step in likely])
        return _apart(near[np.argsort(-self.gains(near))], 0.01 / reach, count)

    def _narrowed(self, lsb: float, half: float) -> float:
        """Return the step within ``half`` of ``lsb`` that promises most, found by trying ever closer ones."""
        for _ in range(ZOOMS):
            tried = lsb + half * np.linspace(-1.0, 1.0, POINTS)
            lsb, half = float(tried[int(np.argmax(self.gains(tried)))]), half / CLOSER
        return lsb

    def alike(self, lsb: float) -> tuple[float, float]:
        """Return the smallest and the largest step near ``lsb`` that round every level to as many steps."""
        codes = np.round(self.levels / lsb)
        below, above = (self.levels / (codes + side * np.sign(self.levels)) for side in (0.5, -0.5))
        return float(np.nanmax(below)), float(np.nanmin(np.where(codes != 0.0, above, np.nan)))

    def inside(self, lsb: float) -> float:
        """Return ``lsb``, or where it is at the edge of those that round alike, the next that is not.

        The most is often promised right at an edge, and the next size to that rounds a level to another step.
        """
        least, most = self.alike(lsb)
        room = EDGE * (most - least)
        return float(np.clip(lsb, least + room, most - room))


def _apart(order: Array, closest: float, count: int) -> list[float]:
    """Return the first steps of a list whose inverses lie apart, 1/V."""
    kept: list[float] = []
    for lsb in order.tolist():
        if len(kept) == count:
            break
        if all(abs(1.0 / lsb - 1.0 / other) > closest for other in kept):
            kept.append(lsb)
    return kept


def comb(evidence: "Evidence") -> Comb:
    """Return what the residual asks of the levels of u that are held longest; of none where that is a single one."""
    sources = [o.source[0 : o.trace.size * o.substeps : o.substeps] for o in evidence.observations]
    levels = _held(np.concatenate(sources))
    height = SMALL * float(np.ptp(levels)) if levels.size else 0.0
    levels = levels if height > 0.0 else levels[:0]
    rows = np.concatenate(
        [_answers(evidence.chain, o, u, levels, height) for o, u in zip(evidence.observations, sources, strict=True)],
        axis=1,
    )
    return Comb(levels, *evidence.normal_of(rows))


def _held(u: Array) -> Array:
    """Return the levels that occur most often, V, ascending; 0 V is none of them, it is rounded to itself."""
    levels, counts = np.unique(u[u != 0.0], return_counts=True)
    often = np.argsort(-counts)[:MOST]
    return np.sort(levels[often[counts[often] > RARE * np.max(counts, initial=0)]])


def _answers(chain: Chain, observation: Observation, u: Array, levels: Array, height: float) -> NDArray[np.float64]:
    """Return how the answer of one run changes with every level, 1/V in units of the noise, where samples count."""
    rest = _passed_on(chain, observation, u)
    rows = np.zeros((levels.size, observation.count))
    for i, level in enumerate(levels):
        here = u == level
        if np.any(here):
            change = _passed_on(chain, observation, u + height * here) - rest
            rows[i] = change[observation.use] / (height * observation.noise_v)
    return rows


def _passed_on(chain: Chain, observation: Observation, u: Array) -> Array:
    """Return the answer of a chain to a source voltage at the sample instants, V."""
    grid = grid_of(observation.trace)
    return running(chain, grid)(Block(u, u, 0, grid))
