"""What does F hold from before a run, and from when on does it not matter any more?

A gap keeps the level that it was left at, for as long as nothing takes it along: a run that follows another seldom
begins at zero. The model does. From where both levels have been taken to one border they are the same.
"""

from collections.abc import Iterable, Sequence
from itertools import chain as chained
from math import sqrt

import numpy as np

from identify import kernels
from identify.chain import tapped
from identify.effects import chain_of
from identify.model import Backlash, Model
from identify.natural_units import shown
from identify.noise import good
from identify.stage import Place
from identify.trace import Array, Trace

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
    chain = chain_of(model, trace.intersample)
    at = chain.index(Place.G1) - 1
    f, gain = model.f, model.g2.dc_gain
    moves = (taps[at] for taps in tapped(chain, trace))
    first = next(moves, np.empty(0))
    level_v = _begins_at(trace, first, f, gain, noise_v)
    until = _taken_along(chained([first], moves), level_v / gain, f) if level_v else None
    return (level_v, until) if until is not None else (0.0, 0)


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


def _taken_along(moves: Iterable[Array], level: float, f: Backlash) -> int | None:
    """Return the sample from which the play operator is the same from ``level`` as from zero; None where none is.

    In a gap as wide as it may be or, where nothing takes the level along in that, in that of the rig file.
    """
    gaps, first = [f.widened(times) for times in WIDER], 0
    levels = [(0.0, level) for _ in gaps]
    until: dict[int, int] = {}
    for v in moves:
        for i, gap in enumerate(gaps):
            fresh, held = (_played(v, w, gap) for w in levels[i])
            levels[i] = float(fresh[-1]), float(held[-1])
            same = np.flatnonzero(fresh == held)
            if same.size:
                until.setdefault(i, first + int(same[0]))
        if 0 in until:
            break
        first += v.size
    return until[min(until)] if until else None


def _played(v: Array, level: float, f: Backlash) -> Array:
    """Return w from a level on, V."""
    w = np.empty_like(v)
    kernels.play(f.s_l, f.d_l_v, f.s_u, f.d_u_v, level, v, w)
    return w
