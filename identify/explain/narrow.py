"""Is the reading off over stretches of its level so narrow that no smooth law and no even grid of corners shows it?

A code that an ADC misreads, a dead zone about zero: few readings see it, all of one level. What is read follows the
level at once, so nothing need be simulated: readings in the order of their level, in blocks of equal number, are looked
through for runs of blocks that stand out of those around them.
"""

from math import log

import numpy as np
from scipy.stats import norm

from identify.evidence import Evidence
from identify.explain.corrections import free_name
from identify.stage import Place
from identify.trace import Array
from identify.unnamed.maps import BrokenMap

BLOCKS, LEAST = 4096, 20  # blocks at most, and readings in one at least
WIDEST = 128  # blocks of a stretch, at most: wider ones are for smooth laws
NARROW = 1.0 / 64.0  # of all levels: wider stretches a map or a grid of corners shows
STRETCHES = 4  # at most: a dead zone is two, one above and one below zero
TO_SD = 1.0 / float(norm.ppf(0.75))  # a median of sizes as a standard deviation: what else is missing scatters, too
STANDS_OUT = 40.0  # of chi-squared, beyond what the largest of all stretches has by chance


def narrow(evidence: Evidence) -> tuple[BrokenMap, float] | None:
    """Return a law of the reading with corners at the ends of narrow stretches, None where none stand out.

    Beside it the log of among how many like it it was chosen.
    """
    level, _ = evidence.compared_v
    size = max(level.size // BLOCKS, LEAST)
    order = np.argsort(level, kind="stable")[: level.size // size * size]
    if order.size // size < 4 * WIDEST:
        return None
    ends = np.append(level[order[::size]], level[order[-1]])
    sums = evidence.residual[order].reshape(-1, size).sum(axis=1) / np.sqrt(size)
    found = _stretches(sums, ends)
    knots = sorted({float(ends[i]) for pair in found for i in pair})
    if not knots:
        return None
    return BrokenMap(Place.SENSE, tuple(knots), free_name(evidence.chain)), len(knots) * log(sums.size)


def _stretches(sums: Array, ends: Array) -> list[tuple[int, int]]:
    """Return first and last end of stretches of blocks that stand out most of those beside them, one after another.

    ``sums`` are of variance one or, where more is missing than what is narrow, of any: what most blocks differ by.
    """
    left = sums / max(TO_SD * float(np.median(np.abs(np.diff(sums)))) / np.sqrt(2.0), 1.0)
    found, least = [], STANDS_OUT + 2.0 * log(sums.size * WIDEST)
    for _ in range(STRETCHES):
        gain, first, width, off = max(_best(left, ends, width) for width in range(1, WIDEST + 1))
        if gain < least:
            break
        found.append((first, first + width))
        left[first : first + width] -= off
    return found


def _best(sums: Array, ends: Array, width: int) -> tuple[float, int, int, float]:
    """Return what the best stretch of a width tells, in chi-squared, its first block, the width and how far it is off.

    Compared with as many blocks on either side; a level's share that is not narrow tells nothing.
    """
    total = np.concatenate(([0.0], np.cumsum(sums)))
    parts = total[width:] - total[:-width]
    off = parts[width:-width] - 0.5 * (parts[: -2 * width] + parts[2 * width :])
    narrow = ends[2 * width : -width] - ends[width : -2 * width] < NARROW * (ends[-1] - ends[0])
    gains = np.where(narrow, np.square(off) / (1.5 * width), 0.0)
    at = int(np.argmax(gains))
    return float(gains[at]), at + width, width, float(off[at]) / width
