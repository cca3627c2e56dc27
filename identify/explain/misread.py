"""Would nothing be missing had the recordings been read in another way: with u for y, or by another clock?

Columns that are exchanged and times in another unit leave nearly all of a recording, and physics is not what it takes.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.linalg import LinAlgError

from identify.explain.confirm import UNFINISHED
from identify.explain.hypothesis import Hypothesis
from identify.explain.plain import prepared
from identify.holdout import split
from identify.model import Model
from identify.trace import Trace

GROSSLY = 0.1  # of the rms of the readings, that the plain model leaves at least where they were misread
QUIET = 0.1  # of the rms of the readings, that their noise must not exceed: anything explains what is all noise
FASTER = {1e3: "1000 times as fast", 1e6: "a million times as fast", 1e-3: "1000 times as slow"}
SWAPPED = "with u for y and y for u nothing would be missing: look at the columns"
CLOCK = "with a clock {} nothing would be missing: look at the unit of the times, or of the rate"

Reading = Callable[[Trace], Trace]


def told_misread(model: Model, plain: Hypothesis) -> tuple[str, ...]:
    """Return how the recordings of a plain fit that leaves most of them may be meant, where the plain model tells so.
    """
    traces = [o.trace for o in plain.data]
    readings = np.concatenate([o.trace.y[:][o.use] for o in plain.data])
    left_v = np.sqrt(1.0 + plain.misfit) * plain.data[0].noise_v
    if not left_v > GROSSLY * float(np.std(readings)):
        return ()
    ways: list[tuple[str, Reading]] = [(SWAPPED, _swapped)]
    ways += [(CLOCK.format(told), partial(_faster, times)) for times, told in FASTER.items()]
    return next(((sentence,) for sentence, way in ways if _is_all(model, [way(trace) for trace in traces])), ())


def _is_all(model: Model, traces: Sequence[Trace]) -> bool:
    """Return whether the plain model leaves but noise of recordings."""
    try:
        data = split(model, traces)
        _, plain = prepared(model, data)
    except (ValueError, ArithmeticError, LinAlgError):  # such recordings cannot be used
        return False
    quiet = data.noise.rms_v < QUIET * min(float(np.std(o.trace.y[:][o.use])) for o in data.train)
    return quiet and 1.0 + plain.misfit <= UNFINISHED**2


def _swapped(trace: Trace) -> Trace:
    """Return a recording with the source for the readings."""
    return replace(trace, u=trace.y, y=trace.u)


def _faster(times: float, trace: Trace) -> Trace:
    """Return a recording by a clock so many times as fast."""
    return replace(trace, rate_hz=times * trace.rate_hz, start_s=trace.start_s / times)
