"""Does what a model leaves of held-out runs lie where no run it was fitted to has ever been?

A law that acts beyond the levels of the runs to be fitted cannot be told from them. Held-out runs that go there show
it, and show nothing against what was found where both have been.
"""

from collections.abc import Sequence

import numpy as np

from identify.chain import Chain
from identify.explain.explanation import Range
from identify.explain.where import UNITS, coordinate
from identify.natural_units import shown
from identify.observe import Observation
from identify.trace import Array

STAGES = {"level of w": "F", "level of v": "F", "level of u": "source", "rate of v": "F"}  # whose input or output it is
MARGIN = 0.01  # of the range visited, within which a level counts as visited
MOST = 0.8  # share of what is left that must lie beyond, for it to be said
FEW = 0.5  # share of the samples that may do so


def unvisited(chain: Chain, train: Sequence[Observation], test: Sequence[Observation]) -> Range | None:
    """Return the stretch of a coordinate, beyond all that ``train`` visits, that holds most of what ``test`` leaves."""
    beyond = np.concatenate([np.square(o.used_residual(chain) / o.noise_v) - 1.0 for o in test])
    found = [r for axis in STAGES if (r := _outside(axis, chain, train, test, beyond)) is not None]
    best = max(found, key=lambda r: r.share, default=None)
    return best if best is not None and best.share >= MOST else None


def _outside(
    axis: str, chain: Chain, train: Sequence[Observation], test: Sequence[Observation], beyond: Array
) -> Range | None:
    """Return the stretch beyond that end of what was visited along an axis where more is left, and its share of it."""
    known, seen = (np.concatenate([coordinate(axis, chain, o)[o.use] for o in part]) for part in (train, test))
    low, high = float(np.min(known)), float(np.max(known))
    margin, total = MARGIN * (high - low), float(np.sum(beyond))
    ends = [(seen < low - margin, float(np.min(seen)), low), (seen > high + margin, high, float(np.max(seen)))]
    if total <= 0.0:
        return None
    held = [(float(np.sum(beyond[out])) / total, a, b) for out, a, b in ends if 0.0 < np.mean(out) < FEW]
    if not held:
        return None
    share, least, most = max(held)
    return Range(axis, least, most, UNITS.get(axis, "V"), share)


def stage_beyond(stretch: Range) -> str:
    """Return the stage on whose coordinate the stretch lies."""
    return STAGES[stretch.axis]


def told_beyond(stretch: Range) -> str:
    """Return what is said of a stretch that only held-out runs visit."""
    share, ends = 100.0 * min(stretch.share, 1.0), [shown(end, stretch.unit, 3) for end in (stretch.low, stretch.high)]
    return (
        f"{share:.0f} % of what is left of the held-out runs lies where no run that was fitted has been: "
        f"{stretch.axis} from {ends[0]} to {ends[1]}. What acts there cannot be told from these runs; fit runs that go "
        "there, too."
    )
