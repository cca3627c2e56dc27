"""What do the settled levels of a staircase say about F, before any dynamics are fitted (paper section 4)?

A point is a dwell: its level of u, the mean of its settled readings, and the branch of F it ends on. A point that
moved with its step ends on a border; one that did not move rests on a plateau, or on a rail when the readings stop
while the level goes on. Only points on a border tell where the border is (physics.md 1.5).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.identification import Branch, StairPoint
from identify.interval import Interval
from identify.noise import good, settled_dwells
from identify.observe import Observation
from identify.trace import Array, blocks

ENOUGH = 5  # settled readings a dwell must have
STILL = 0.03  # share of a free step below which a point counts as not moved
LEAST_POINTS = 2


@dataclass(frozen=True)
class Border:
    """A line w = slope (v - crossing_v) through points of one branch, in the scale of the readings."""

    slope: float
    crossing_v: float


def staircase(observation: Observation, settle_s: float, gain_before: float = 1.0) -> tuple[StairPoint, ...]:
    """Return the points of every settled dwell of one run; empty when there are fewer than four.

    ``gain_before`` is G1(0): with a negative one v falls, and unloads F, where u rises.
    """
    levels, means, errors = _dwells(observation, round(settle_s * observation.trace.rate_hz))
    if levels.size < 4:
        return ()
    branches = classified(np.sign(gain_before) * levels, means, errors)
    spreads = [Interval(float(m), float(m - 1.96 * e), float(m + 1.96 * e)) for m, e in zip(means, errors, strict=True)]
    run = observation.trace.name
    return tuple(StairPoint(run, float(u), m, b) for u, m, b in zip(levels, spreads, branches, strict=True))


def _dwells(observation: Observation, settle: int) -> tuple[Array, Array, Array]:
    """Return level, mean reading and its standard error of every dwell with enough settled readings."""
    rows = []
    for start, stop in settled_dwells(observation.trace.u, settle):
        total, count = _summed(observation, start, stop)
        if count >= ENOUGH:
            level = float(observation.trace.u[start : start + 1][0])
            rows.append((level, total / count, observation.noise_v * observation.colour.slow / np.sqrt(count)))
    table = np.array(rows).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def _summed(observation: Observation, start: int, stop: int) -> tuple[float, int]:
    """Return sum and number of the readings of [start, stop) that were received and count."""
    total, count, ok = 0.0, 0, good(observation.trace)
    for a, b in blocks(start, stop):
        y = observation.trace.y[a:b][ok[a:b] & observation.use[a:b]]
        total, count = total + float(np.sum(y)), count + y.size
    return total, count


def classified(levels: Array, means: Array, errors: Array) -> list[Branch]:
    """Return the branch each point ends on, ``levels`` counted in the sense of v; at rest at 0 before the first."""
    steps = np.diff(levels, prepend=0.0)
    moves = np.diff(means, prepend=0.0)
    doubt = 5.0 * np.sqrt(np.square(errors) + np.square(np.concatenate(([0.0], errors[:-1]))))
    free = float(np.quantile(np.abs(moves) / np.maximum(np.abs(steps), 1e-12), 0.9))
    moved = np.abs(moves) > np.maximum(doubt, STILL * free * np.abs(steps))
    rails = _rails(steps, moves, means, moved, doubt)
    found: list[Branch] = []
    for step, mean, move, error in zip(steps, means, moved, doubt, strict=True):
        if any(abs(mean - rail) <= error + STILL * abs(rail) for rail in rails):
            found.append("saturated")
        else:
            found.append(("loading" if step > 0.0 else "unloading") if move else "plateau")
    return found


def _rails(steps: Array, moves: Array, means: Array, moved: Array, doubt: Array) -> list[float]:
    """Return the readings at which motion stopped while the level went on the same way."""
    found = []
    for k in range(1, steps.size):
        onward = moved[k - 1] and steps[k] * steps[k - 1] > 0.0
        if onward and abs(moves[k]) <= doubt[k]:
            found.append(float(means[k]))
    return found


def border(points: Sequence[StairPoint], branch: Branch) -> Border | None:
    """Return the weighted line through the points of one branch; None when fewer than two levels were met."""
    chosen = [p for p in points if p.branch == branch]
    if len({p.level_v for p in chosen}) < LEAST_POINTS:
        return None
    levels = np.array([p.level_v for p in chosen])
    means = np.array([p.mean_v.value for p in chosen])
    weights = np.array([1.0 / max(p.mean_v.high - p.mean_v.low, 1e-12) for p in chosen])
    slope, offset = np.polyfit(levels, means, 1, w=weights)
    return Border(float(slope), float(-offset / slope)) if slope != 0.0 else None


def borders(points: Sequence[StairPoint], gain_before: float, gain_behind: float) -> dict[str, float]:
    """Return F.S_L, F.D_L, F.S_U, F.D_U that the points give, by full name; empty unless both borders were met.

    ``gain_before`` and ``gain_behind`` are G1(0) and G2(0): v = gain_before u, x = gain_behind w once settled.
    """
    lower, upper = border(points, "loading"), border(points, "unloading")
    if lower is None or upper is None:
        return {}
    scale = 1.0 / (gain_before * gain_behind)
    found = {
        "F.S_L": lower.slope * scale, "F.D_L": lower.crossing_v * gain_before,
        "F.S_U": upper.slope * scale, "F.D_U": upper.crossing_v * gain_before,
    }  # fmt: skip
    rising = min(found["F.S_L"], found["F.S_U"]) > 0.0
    return found if rising and found["F.D_L"] >= found["F.D_U"] else {}
