"""What must a rig with a backlash have gone through, at least, to be as it was when an excerpt began?

Linear blocks forget; a backlash does not, but of its past it keeps the last extremes that no later one went beyond,
and nothing else [Mayergoyz, Mathematical Models of Hysteresis, 1991, section 1.2: the wiping-out property]. Played with
some time around each of these extremes, and then the stretch right before the excerpt, the rig stands as it stood.
"""

from identify.blocks import TOLERANCE_FACTOR
from identify.excerpts.cells import Cells

EXTREMES = 12  # at most
APPROACH = 2  # settling times in front of an extreme: what is left there of the splice stays in the backlash
VISIBLE = 1e-3  # of the range of u: smaller turns leave nothing in the backlash


def before(cells: Cells, start: int, settle: int) -> list[tuple[int, int]]:
    """Return the stretches before ``start`` that leave the rig as the whole past does, in order.

    ``settle`` is in how many samples its nominal linear blocks settle; the real ones may be slower.
    """
    if start == 0:
        return []
    around = [(max(at - APPROACH * settle, 0), min(at + settle, start)) for at in _extremes(cells, start)]
    return joined([*around, (max(start - round(TOLERANCE_FACTOR * settle), 0), start)])


def length(stretches: list[tuple[int, int]]) -> int:
    """Return how many samples stretches have in all."""
    return sum(stop - start for start, stop in stretches)


def joined(stretches: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Return stretches in order, those that touch made one."""
    found: list[tuple[int, int]] = []
    for start, stop in sorted(stretches):
        if found and start <= found[-1][1]:
            found[-1] = (found[-1][0], max(found[-1][1], stop))
        else:
            found.append((start, stop))
    return found


def _extremes(cells: Cells, stop: int) -> list[int]:
    """Return the places of the extremes of u before ``stop`` that none later goes beyond, the first two the widest."""
    high, low = (cells.last_extreme(0, stop, upper=upper) for upper in (True, False))
    first, second = sorted((high, low))
    places, levels = [first[0], second[0]], [first[1], second[1]]
    while len(places) < EXTREMES and places[-1] + 1 < stop:
        at, level = cells.last_extreme(places[-1] + 1, stop, upper=levels[-1] < levels[-2])
        if abs(level - levels[-1]) < VISIBLE * cells.range_v:
            break
        places.append(at)
        levels.append(level)
    return places
