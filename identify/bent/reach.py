"""Which points of a rig file's bent borders do the recordings reach, and what becomes of the others?

A spline through points that no run comes near is nothing but the shape of its formula there, and its far points bend it
where there are data. So borders are cut to the stretch that was ridden: they get points at its ends and go on straight.
"""

from collections.abc import Sequence

import numpy as np

from identify.bent.bend import centre_of, with_curves
from identify.bent.border import of_points
from identify.bent.curved import SIDES, CurvedPlay
from identify.fit import Fit, fit
from identify.identifiability.visits import Range, visits
from identify.model import CurvedBacklash, Points
from identify.observe import Observation
from identify.stage import is_fixed

MARGIN = 0.02  # of the stretch: a point so little beyond its end is as good as on it


def within_reach(found: Fit, observations: Sequence[Observation], fixed: Sequence[str]) -> Fit:
    """Return a fit whose bent borders have no point beyond what a run rode; itself where that is so already.

    Borders held in the rig file stay, and so does one that was never ridden: nothing is known of it.
    """
    stage = found.chain.stage_of(CurvedPlay)
    if stage is None:
        return found
    f, where = stage.backlash(found.chain.of(stage, "")), visits(found.chain, observations)
    loading, unloading = (
        points if is_fixed(f"F.{side}.level", fixed) or not ridden.low < ridden.high else cut(points, ridden)
        for side, points, ridden in zip(
            SIDES, (f.loading, f.unloading), (where.loading, where.unloading), strict=True
        )
    )
    if (loading, unloading) == (f.loading, f.unloading):
        return found
    chain = with_curves(found.chain, stage, CurvedPlay(CurvedBacklash(loading, unloading)))
    centre = {name: v for name, v in centre_of(found, chain).items() if not name.startswith("F.")}
    return fit(chain, observations, centre, fixed)


def cut(points: Points, ridden: Range) -> Points:
    """Return the points of a border cut to a stretch, new ones at the ends where old ones lay beyond; else the same."""
    low_v, high_v = ridden.low, ridden.high
    margin = MARGIN * (high_v - low_v)
    if points[0][0] >= low_v - margin and points[-1][0] <= high_v + margin:
        return points
    kept = [v for v, _ in points if low_v + margin < v < high_v - margin]
    first = low_v if points[0][0] < low_v - margin else points[0][0]
    last = high_v if points[-1][0] > high_v + margin else points[-1][0]
    at = np.unique([first, *kept, last])
    return tuple(zip(at.tolist(), of_points(points).at(at).tolist(), strict=True))
