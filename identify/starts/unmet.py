"""From where does a fit start whose operator never meets a border that the rig may have met?

Where v stays between the borders, w rests, whatever their values: nothing says which way they are to be moved. A rig
file whose gap is a little wider than that of the rig is enough, where a run hardly leaves it.
"""

from collections.abc import Sequence

import numpy as np

from identify.blocks import Play
from identify.chain import Chain, signals
from identify.observe import Observation
from identify.stage import is_fixed

MET = 0.25  # of the range of v, by which a border that is drawn in is passed
LOADING, UNLOADING = "F.D_L", "F.D_U"


def drawn_in(chain: Chain, observations: Sequence[Observation], fixed: Sequence[str]) -> tuple[Chain, ...]:
    """Return the chain with the borders that w never meets moved to where v passes them: each alone, and both.

    None where there is no gap, where w is moved both ways, and where ``fixed`` keeps the border that it never meets.
    """
    play = chain.stage_of(Play)
    if play is None:
        return ()
    at = chain.stages.index(play)
    taps = [signals(chain, o.trace)[at - 1 : at + 1] for o in observations]
    low, high = min(float(np.min(v)) for v, _ in taps), max(float(np.max(v)) for v, _ in taps)
    moves = [np.diff(w, prepend=0.0) for _, w in taps]
    loaded, unloaded = any(np.any(move > 0.0) for move in moves), any(np.any(move < 0.0) for move in moves)
    if low >= high:
        return ()
    d_l, d_u = chain.values[LOADING], chain.values[UNLOADING]
    inside = MET * (high - low)
    found = []
    if not loaded and not is_fixed(LOADING, fixed):
        found.append({LOADING: high - inside + max(d_u - low, 0.0)})
    if not unloaded and not is_fixed(UNLOADING, fixed):
        found.append({UNLOADING: low + inside - max(high - d_l, 0.0)})
    if len(found) == 2:
        found.append({LOADING: high - inside, UNLOADING: low})
    return tuple(chain.with_values(values) for values in found)
