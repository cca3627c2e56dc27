"""What would the paper's own experiment be on this rig: the staircase of Fig. 13 and the sine of Fig. 27 (section 7)?

On the paper's rig and within its limits it is theirs: levels to 3 V and -3.5 V in steps of 0.5 V, held for 0.24 s,
and 100 periods of 10 V at 50 Hz. On another rig the levels are scaled with the gap, times with the slowest pole; the
sine is the largest allowed, and slower where it would leave the gap stuck. Rails are met as they are: the paper's
levels know of none.
"""

from dataclasses import replace

import numpy as np

from identify.model import Model
from identify.planning.candidates import Candidate, Room, Stairs, Tone, gap_of
from identify.planning.gap import fastest_hz
from identify.planning.information import Information

LEVELS_V = (*np.arange(-3.0, 3.1, 0.5).tolist(), *np.arange(2.5, -3.6, -0.5).tolist())
HALF_GAP_V, LARGEST_V, LOUDEST = 1.25, 3.5, 10.0
DWELL = 12.0  # slowest time constants to a dwell: settled to 0.1 %, and 100 ms of the paper's rig to average over
PERIODS = 100


def fig13(model: Model, room: Room) -> tuple[Candidate, ...]:
    """Return the walk and the sine; no sine where none moves the gap."""
    slowest = min((float(abs(p)) for b in (model.g1, model.g2) for p in np.roots(b.den)), default=50.0)
    size = min(_size(model), room.limit_v / LARGEST_V)
    walk = Stairs(tuple(size * v for v in LEVELS_V), DWELL / slowest, True)
    frequency = _frequency_hz(model, room, slowest)
    return (walk, Tone(frequency, min(LOUDEST * size, room.limit_v), 0.0, PERIODS)) if frequency else (walk,)


def _size(model: Model) -> float:
    """Return the scale of the levels: 1 unless the gap is quite another."""
    gap = gap_of(model)
    if gap is None:
        return 1.0
    ratio = 1.0 / (gap.excess(0.0, 1.0, -1.0) * abs(model.g1.dc_gain)) / HALF_GAP_V
    return 1.0 if 0.5 < ratio < 2.0 else ratio


def _frequency_hz(model: Model, room: Room, slowest: float) -> float:
    """Return the frequency of the sine: 50 Hz where the slowest pole is at 50 rad/s; 0 where none moves the gap."""
    frequency, gap = float(f"{slowest:.2g}"), gap_of(model)
    if gap is None:
        return frequency
    amplitude_v = min(LOUDEST * _size(model), room.limit_v)
    return min(frequency, float(f"{0.9 * (fastest_hz(gap, model.g1, amplitude_v, 10.0 * slowest) or 0.0):.2g}"))


def scaled(told: Information, time_s: float) -> Information:
    """Return the information of the same steps played over and over, or in part, for another time."""
    factor = time_s / sum(told.times_s)
    return replace(told, matrices=told.matrices * factor, times_s=tuple(factor * t for t in told.times_s))
