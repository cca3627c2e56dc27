"""When does F rest, and when does it stand at a border, so that it remembers nothing?"""

from collections.abc import Sequence

import numpy as np

from identify.blocks import Play
from identify.chain import Chain, signals
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array, Mask, Trace

STILL = 1e-3  # of the largest rate of w, below which it rests


def resting(chain: Chain, observation: Observation) -> Mask:
    """Return where the signal behind G2 hardly moves: F rests and its last move has passed."""
    level = signals(chain, observation.trace)[chain.index(Place.G2) - 1]
    rate = np.abs(np.diff(level, prepend=level[:1]))
    return np.asarray(rate < STILL * float(np.max(rate)), dtype=np.bool_)


def tap(chain: Chain, taps: Sequence[Array], signal: str) -> Array:
    """Return v, w, x or y; w is what F itself makes, before physics put behind it."""
    places = {"v": Place.G1, "x": Place.G2, "y": Place.SENSE}
    return taps[_tap_of_w(chain) if signal == "w" else chain.index(places[signal]) - 1]


def still(chain: Chain, taps: Sequence[Array], trace: Trace) -> Mask:
    """Return where w rests inside the gap, on neither border; without a gap, where the source holds its level."""
    if chain.stage_of(Play) is None:
        return np.asarray(np.diff(trace.u[:], prepend=0.0) == 0.0)
    v, w = (tap(chain, taps, signal) for signal in "vw")
    borders = [(chain.values[f"F.S_{side}"], chain.values[f"F.D_{side}"]) for side in ("L", "U")]
    reach = 1e-9 * max(float(np.max(np.abs(w))), 1e-12)
    away = [np.abs(w - slope * (v - crossing)) > reach for slope, crossing in borders]
    return np.logical_and(away[0], away[1])


def _tap_of_w(chain: Chain) -> int:
    """Return the index of the stage that makes w: F itself, before physics put behind it."""
    return min(i for i, stage in enumerate(chain.stages) if stage.place is Place.F)


def forgetting(chain: Chain, observation: Observation, settled: int) -> Mask:
    """Return where w has stood at a border for ``settled`` samples: what it remembered has passed."""
    return np.asarray(age(~held_in_gap(chain, observation)) >= settled)


def held_in_gap(chain: Chain, observation: Observation) -> Mask:
    """Return where w rests inside the gap of a chain as it is simulated, as ``still`` has it."""
    return still(chain, signals(chain, observation.trace), observation.trace)


def age(holds: Mask) -> Array:
    """Return for how many samples something has held at every sample, shape (N,)."""
    index = np.arange(holds.size)
    last = np.maximum.accumulate(np.where(holds, -1, index))
    return np.asarray(index - np.maximum(last, 0), dtype=np.float64)
