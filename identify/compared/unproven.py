"""May values differ although the rig is the same: because the model lacks something that shows otherwise?

Where a model lacks physics, its values also hold what is lacking, and by how much depends on what was played and on
what exactly is lacking. Two recordings of one stimulus whose model lacks the same lean the same way; else a difference
of values is no proof of a change.
"""

import numpy as np

from identify.compared.together import Side
from identify.observe import Observation
from identify.trace import blocks

ALIKE = 0.2  # share by which what is lacking may differ, of its mean square, and still be the same


def unproven(sides: tuple[Side, Side], searched: bool) -> str:
    """Return why differing values prove no change of the rig, empty where they do.

    ``searched`` says that physics the model lacks was looked for.
    """
    same_stimulus = _same_stimulus(*sides)
    if not searched and not same_stimulus:
        return "other stimuli were played, and no physics was looked for that they might show otherwise"
    lacking = [side.wider > 1.0 for side in sides]
    if not any(lacking):
        return ""
    if not same_stimulus:
        return "the model does not follow them to the noise, and other stimuli show other parts of what it lacks"
    if not all(lacking) or not _lack_the_same(*sides):
        which = "either" if all(lacking) else "the later one" if lacking[1] else "the earlier one"
        return f"the model does not follow {which} to the noise, and its values lean on what it lacks there"
    return ""


def _lack_the_same(one: Side, other: Side) -> bool:
    """Return whether what the models leave beyond the noise is about the same."""
    excess = [side.chi2(side.fit.chain) * side.wider**2 / sum(o.count for o in side.observations) - 1.0
              for side in (one, other)]  # fmt: skip
    return abs(excess[1] - excess[0]) <= ALIKE * max(excess)


def _same_stimulus(one: Side, other: Side) -> bool:
    """Return whether the same was played on both sides."""
    pairs = len(one.observations) == len(other.observations)
    return pairs and all(map(_alike, one.observations, other.observations))


def _alike(first: Observation, second: Observation) -> bool:
    """Return whether both recordings are of one stimulus."""
    one, other = first.trace, second.trace
    if (one.size, one.rate_hz, one.intersample) != (other.size, other.rate_hz, other.intersample):
        return False
    return all(np.array_equal(one.u[a:b], other.u[a:b]) for a, b in blocks(0, one.size))
