"""How do recordings become small enough to try many rigs on them?"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from identify.colour import WHITE
from identify.observe import Observation
from identify.trace import Array, Trace

TRIED = 1 << 22  # samples of a run, at most; more of them sharpen a minimum and hardly lead to another one
COARSE = 2  # instants to a sample where minima are looked for: a delay needs more than one
ENOUGH = 30_000  # samples to try a rig on, all runs together
LONGEST = 200_000  # samples thinned: what comes after is left out
POINTS = 24  # samples left of the fastest swing of u


def thinned(observations: Sequence[Observation]) -> tuple[Observation, ...]:
    """Return the observations with every k-th sample, u averaged in between, and ends cut off very long runs."""
    most = LONGEST // len(observations)
    cut = [_first(o, most) for o in observations]
    factor = max(sum(o.trace.size for o in cut) // ENOUGH, 1)
    return tuple(_thinned(o, max(min(factor, _swing(o.trace.u[:]) // POINTS), 1)) for o in cut)


def _first(observation: Observation, most: int) -> Observation:
    """Return the first samples of a run."""
    trace = observation.trace
    if trace.size <= most:
        return observation
    valid = None if trace.valid is None else trace.valid[:most]
    short = replace(trace, u=trace.u[:most], y=trace.y[:most], steps=(), valid=valid)
    return replace(observation, trace=short, use=observation.use[:most])


def _swing(u: Array) -> int:
    """Return the samples of the fastest full swing of u, about: its range over its steepest typical slope."""
    moves = np.abs(np.diff(u))
    moving = moves[moves > 1e-6 * np.max(moves, initial=0.0)]
    if moving.size < 0.05 * u.size:  # a staircase: levels last long
        return int(POINTS * u.size // max(moving.size, 1))
    return int(np.pi * np.ptp(u) / max(float(np.quantile(moving, 0.9)), 1e-300))


def _thinned(observation: Observation, factor: int) -> Observation:
    """Return every ``factor``-th sample."""
    if factor == 1:
        return observation
    trace = observation.trace
    size = trace.size // factor * factor
    held = np.asarray(trace.u[:size]).reshape(-1, factor).mean(axis=1)
    u = held if trace.intersample == "held" else trace.u[:size:factor]
    short = Trace(trace.name, trace.rate_hz / factor, u, trace.y[:size:factor], trace.intersample, trace.start_s)
    short = replace(short, from_rest=trace.from_rest, device=trace.device)
    return replace(observation, trace=short, use=observation.use[:size:factor], colour=WHITE)
