"""At which levels does a memoryless law jump or bend, where no smooth one explains enough?

Corners are taken one after the other, each where it explains most beside those before it (as in MARS: Friedman, Annals
of Statistics 19 (1991) 1), from an even grid of levels, and then moved to where they all together explain most.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import log

import numpy as np

from identify.discretise import Matrix
from identify.evidence import Evidence
from identify.explain.corrections import level_knots
from identify.explain.suspect import RANK, Suspect, suspect
from identify.fit import total_chi_squared
from identify.stage import Place
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.maps import BrokenMap, LevelMap, OuterMap

GRID = (16, 64)  # levels at which a corner may be, at least and at most
NUMBERS = 1 << 25  # of all columns together, at most: 256 MB
MOST_CORNERS = 4
FURTHER = 0.1  # share of what the corners before it leave, that one more has to explain
LIKE = 0.5  # share of the best worth, from which the place of a map of the level is tried
NEARLY = 0.9  # share of what corners elsewhere promise, from which those of a place are moved and fitted
DISGUISED = 5.0  # log of the odds that a law of v is one of F: bent borders do the same, and G1 is built to be linear
IDLE = 20.0  # of chi-squared: what a corner adds by chance, wherever it is
CLOSER, FINEST = 0.4, 1e-3  # of the distance of levels: ratio of the steps in which corners are moved, the last of them
ALONG = 0.125  # of how far a law reaches: a jump and a bend that come to zero closer than that are one corner, moved


def cornered(evidence: Evidence, ranked: Sequence[Suspect], noise: float) -> list[Suspect]:
    """Return laws with corners, one for every place at which a smooth map promises much and corners nearly the most."""
    most = max(s.worth(noise)[0] for s in ranked)
    maps = [s.correction for s in ranked if s.correction.form == LevelMap.form and s.worth(noise)[0] > LIKE * most]
    begun = [law for law in (_begun(evidence, like) for like in {c.place: c for c in maps}.values()) if law is not None]
    best = max((gain for _, gain in begun), default=0.0)
    return [_moved(evidence, law) for law, gain in begun if gain > NEARLY * best]


def again(evidence: Evidence, law: BrokenMap) -> Suspect:
    """Return a law whose corners are sought once more where they were and anew, on other evidence: the better one."""
    begun = _begun(evidence, law)
    laws = [law, *([begun[0]] if begun is not None else [])]
    return max((_moved(evidence, each) for each in laws), key=lambda found: found.gain)


def either_side(evidence: Evidence, found: Suspect) -> list[Suspect]:
    """Return a law with corners, and the same with those below zero acting on their other side.

    On a large mismatch first order does not say which it is.
    """
    law = found.correction
    kinds = [kind(law.place, law.knots, law.name) for kind in (BrokenMap, OuterMap) if type(law) is not kind]
    return [found, *(suspect(evidence, other) for other in kinds if min(law.knots) < 0.0)]


def slid(law: BrokenMap, values: Mapping[str, float]) -> tuple[BrokenMap, dict[str, float]] | None:
    """Return a fitted law with its corners where its lines meet, and its weights there; None where all meet already.

    A bend whose corner is off shows, to first order, as one with a jump: that is how far, all other values moving, too.
    """
    jumps, bends = law.split(tuple(values[p.name] for p in law.parameters()))
    knots = np.array(law.knots)
    off = -np.divide(jumps * law.outward, bends, out=np.zeros(knots.size), where=bends != 0.0)
    near = (np.abs(off) < ALONG * max(np.ptp(knots), np.max(np.abs(knots)))) & ((knots + off) * law.outward > 0.0)
    if not np.any(off[near]):
        return None
    there = np.where(near, knots + off, knots)
    order = np.argsort(there)
    moved = replace(law, knots=tuple(there[order].tolist()))
    weights = np.concatenate([np.where(near, 0.0, jumps)[order], bends[order]])
    return moved, dict(zip((p.name for p in moved.parameters()), weights.tolist(), strict=True))


def _begun(evidence: Evidence, like: Correction) -> tuple[BrokenMap, float] | None:
    """Return a law with corners on an even grid of levels and its promise, None where no corner explains anything."""
    size = int(np.clip(NUMBERS // (2 * evidence.residual.size), *GRID))
    grid = BrokenMap(like.place, level_knots(evidence, like.place, size)[1:-1], like.name)
    columns = _columns(evidence, grid)
    told = np.all(np.isfinite(columns), axis=1)
    matrix, right = evidence.normal_of(np.where(told[:, None], columns, 0.0))
    chosen = _chosen(matrix, right, evidence.left - evidence.residual.size)
    law = replace(grid, knots=tuple(grid.knots[i] for i in sorted(chosen)))
    return (law, _gain(matrix, right, chosen)) if chosen else None


def _chosen(matrix: Matrix, right: Array, left: float) -> list[int]:
    """Return the numbers of the corners, those that explain most of what is ``left`` of chi-squared first."""
    count = right.size // 2
    found: list[int] = []
    explained = 0.0
    for _ in range(MOST_CORNERS):
        gains = [_gain(matrix, right, [*found, i]) if i not in found else 0.0 for i in range(count)]
        best = int(np.argmax(gains))
        if gains[best] - explained < max(FURTHER * (left - explained), IDLE):
            break
        found, explained = [*found, best], gains[best]
    return found


def _gain(matrix: Matrix, right: Array, corners: Sequence[int]) -> float:
    """Return the fall of chi-squared that corners promise together; each has a jump and, so many further on, a bend."""
    at = [*corners, *(i + right.size // 2 for i in corners)]
    return float(right[at] @ np.linalg.pinv(matrix[np.ix_(at, at)], rcond=RANK, hermitian=True) @ right[at])


def _moved(evidence: Evidence, law: BrokenMap) -> Suspect:
    """Return a law whose corners are where they explain most, each moved while the others stay, without idle ones."""
    low, high = evidence.range(law.place)
    step = (high - low) / GRID[1]
    last = FINEST * step

    def columns(knot: float) -> Matrix:
        return _columns(evidence, replace(law, knots=(knot,)))

    parts = {knot: columns(knot) for knot in law.knots}
    gain = _together(evidence, parts)
    while step > last:
        for knot in tuple(parts):
            for there in (knot - step, knot + step):
                others = {k: part for k, part in parts.items() if k != knot}
                if there not in others:
                    tried = {**others, there: columns(there)}
                    better = _together(evidence, tried)
                    if better > gain:
                        parts, gain = tried, better
                        break
        step *= CLOSER
    for knot in tuple(parts):
        rest = {k: part for k, part in parts.items() if k != knot}
        if rest and gain - (without := _together(evidence, rest)) < IDLE:
            parts, gain = rest, without
    laws = [kind(law.place, tuple(sorted(parts)), law.name) for kind in (BrokenMap, OuterMap)]
    found = min((suspect(evidence, each) for each in laws), key=lambda one: _left(evidence, one))
    disguised = DISGUISED if law.place == Place.G1 else 0.0
    return replace(found, looks=disguised + len(parts) * log(GRID[1] / FINEST))


def _columns(evidence: Evidence, law: BrokenMap) -> Matrix:
    """Return the change of the answer by a unit of every jump and bend, in units of the noise."""
    chain, step = law.put_in(evidence.chain), evidence.observations[0].noise_v
    return evidence.changes([chain.with_values({p.name: step}) for p in law.parameters()], step)


def _left(evidence: Evidence, found: Suspect) -> float:
    """Return the chi-squared of what solves the linear problem: first order does not say which sides corners act on."""
    chain = found.correction.put_in(evidence.chain).with_values(found.values)
    return total_chi_squared(chain, evidence.observations)


def _together(evidence: Evidence, parts: Mapping[float, Matrix]) -> float:
    """Return the fall of chi-squared that jumps and bends promise together."""
    rows = np.concatenate(list(parts.values()))
    if not np.all(np.isfinite(rows)):
        return 0.0
    matrix, right = evidence.normal_of(rows)
    return float(right @ np.linalg.pinv(matrix, rcond=RANK, hermitian=True) @ right)
