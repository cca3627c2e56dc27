"""Does what wanders from repeat to repeat know where F stands?

Noise of the reading does not, nor does what comes in behind F. What wanders while w is held in the gap, and is next to
gone as soon as a border pushes w, has come in at F, or in front of it where it is so quick that G2 passes none of it
but what the gap has kept. Told from what repeats differ by, so that physics that comes back is in none of it.
"""

from collections.abc import Sequence

import numpy as np

from identify.blocks import Play
from identify.chain import Chain, signals
from identify.explain.contact import age, still
from identify.explain.wander import DRIFT_S, MOSTLY, compared, unrepeated
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array, Mask

SETTLED_S = 0.02  # after which what has been before has passed G2
FEW = 20  # windows, below which chance may keep what hangs together out of them
TENTH = 0.1  # of the power elsewhere: a place that has less has none
SURE = 5.0  # standard deviations of chance from which there is some


def knows_gap(chain: Chain, observations: Sequence[Observation]) -> bool:
    """Return whether what hangs together in the differences of repeats is only there where w is held in the gap.

    False where F has no gap, or where repeats are too few.
    """
    if chain.stage_of(Play) is None:
        return False
    windows = [_windows(chain, o) for o in observations]
    pushed, held = (np.concatenate([each[place] for each in windows], axis=1) for place in (0, 1))
    if min(pushed.shape[1], held.shape[1]) < FEW:
        return False
    least, most = (float(np.mean(power - alone)) for power, alone in (pushed, held))
    return most > SURE * _chance(held) and max(least, 0.0) + _chance(pushed) < TENTH * most


def ruled_out(chain: Chain, observations: Sequence[Observation]) -> tuple[Place, ...]:
    """Return the places at which a misfit, most of which does not come back, has not come in: those behind F."""
    in_gap = unrepeated(chain, observations) > MOSTLY and knows_gap(chain, observations)
    return (Place.G2, Place.SENSE) if in_gap else ()


def _windows(chain: Chain, observation: Observation) -> tuple[Array, Array]:
    """Return the powers of windows of what repeats differ by, V^2, while w is pushed and while it is held.

    Either has the shape (2, windows): of their means, and what single readings alone would make of that.
    """
    residual, size = observation.residual(chain), round(DRIFT_S * observation.trace.rate_hz)
    found: tuple[list[Array], list[Array]] = [np.zeros((2, 0))], [np.zeros((2, 0))]
    places = _pushed_and_held(chain, observation)
    for once, again, both in compared(observation, residual):
        differs = (residual[once] - residual[again]) / np.sqrt(2.0)
        for which, where in zip(found, places, strict=True):
            which.append(_powers(differs, where[once] & where[again] & both, size))
    return np.concatenate(found[0], axis=1), np.concatenate(found[1], axis=1)


def _pushed_and_held(chain: Chain, observation: Observation) -> tuple[Mask, Mask]:
    """Return where a border has pushed w for long enough, and where w has been held in the gap for as long."""
    trace = observation.trace
    held, settled = still(chain, signals(chain, trace), trace), round(SETTLED_S * trace.rate_hz)
    return np.asarray(age(~held) >= settled), np.asarray(age(held) >= settled)


def _powers(values: Array, where: Mask, size: int) -> Array:
    """Return the square of every window's mean, of windows all in one place, and its share of their variance, V^2."""
    ends = np.flatnonzero(np.diff(where.astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    begins = np.concatenate([np.arange(a, b - size + 1, size) for a, b in ends] or [np.zeros(0)]).astype(np.int64)
    windows = values[begins[:, None] + np.arange(size)]
    return np.stack((np.square(np.mean(windows, axis=1)), np.var(windows, axis=1) / max(size - 1, 1)))


def _chance(windows: Array) -> float:
    """Return by how much the mean power of windows of white noise scatters, V^2."""
    return float(np.sqrt(2.0 / windows.shape[1]) * np.mean(windows[1]))
