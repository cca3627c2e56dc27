"""What does F hold from before a run, and from when on does it not matter any more?

A gap keeps the level that it was left at, for as long as nothing takes it along: a run that follows another seldom
begins at zero. The model does. From where both levels have been taken to one border they are the same.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import sqrt

import numpy as np

from identify import kernels
from identify.chain import signals
from identify.effects import chain_of
from identify.model import Backlash, Model
from identify.natural_units import shown
from identify.noise import good
from identify.stage import Place
from identify.trace import Array, Trace, beginning

SURE = 5.0  # standard errors by which the level it holds must be another than zero, and times the noise
NEAR = 3.0  # times the noise that the first reading is off their mean, at most
STEADY = 1.5  # times the noise that readings of a level scatter at most: where more, F may have moved already
WIDER = (1.2, 1.0)  # times the gap of the rig file in which the level is taken along, the first that does it


def held_v(trace: Trace, model: Model, noise_v: float) -> tuple[float, int]:
    """Return the reading of the level that F holds from before, V, and how many samples that matters for.

    Zero and 0 where readings begin as those of the model do, and where nothing takes the level along.
    """
    if not trace.from_rest or not isinstance(model.f, Backlash) or model.unknown or not model.g2.dc_gain:
        return 0.0, 0
    some = beginning(trace)
    chain = chain_of(model, some.intersample)
    v = signals(chain, some)[chain.index(Place.G1) - 1]
    f, gain = model.f, model.g2.dc_gain
    level_v = _begins_at(some, v, f, gain, noise_v)
    gaps = (_taken_along(v, level_v / gain, f, wider) for wider in WIDER)
    first = next((k for k in gaps if k is not None), None) if level_v else None
    return (level_v, first) if first is not None else (0.0, 0)


def told_held(traces: Sequence[Trace], model: Model, noise_v: float) -> tuple[str, ...]:
    """Return what is said of recordings in which F holds a level from before, a sentence each."""
    found = {trace.name: (trace, *held_v(trace, model, noise_v)) for trace in traces}
    return tuple(
        f"{name}: F begins at a level held from before, of {shown(level_v, 'V', 3)} in the readings: the first "
        f"{shown(samples / trace.rate_hz, 's', 2)}, up to where it is taken along, do not count"
        for name, (trace, level_v, samples) in found.items() if samples
    )  # fmt: skip


def _begins_at(trace: Trace, v: Array, f: Backlash, gain: float, noise_v: float) -> float:
    """Return the mean of the first readings, V, for as long as F rests and they scatter as noise does.

    Zero where it may be zero, and where the first of all is none of them: that is read before the source acts.
    """
    first_v = float(trace.y[:1][0])
    moved = [np.abs(gain * (_played(v, w, f) - w)) > noise_v for w in (0.0, first_v / gain)]
    count = max(int(np.argmax(moved[0] | moved[1])), 1)
    y = trace.y[:count][good(trace)[:count]]
    while y.size > 1 and float(np.std(y)) > STEADY * noise_v:
        y = y[: y.size // 2]
    level_v = float(np.mean(y)) if y.size else 0.0
    told = abs(level_v) > noise_v * max(SURE / sqrt(max(y.size, 1)), 1.0) and abs(first_v - level_v) < NEAR * noise_v
    return level_v if told else 0.0


def _taken_along(v: Array, level: float, f: Backlash, wider: float) -> int | None:
    """Return the first sample from which the play operator is the same from ``level`` as from zero; None where none is.
    """
    more = 0.5 * (wider - 1.0) * (f.d_l_v - f.d_u_v)
    wide = replace(f, d_l_v=f.d_l_v + more, d_u_v=f.d_u_v - more)
    same = np.flatnonzero(_played(v, 0.0, wide) == _played(v, level, wide))
    return int(same[0]) if same.size else None


def _played(v: Array, level: float, f: Backlash) -> Array:
    """Return w from a level on, V."""
    w = np.empty_like(v)
    kernels.play(f.s_l, f.d_l_v, f.s_u, f.d_u_v, level, v, w)
    return w
