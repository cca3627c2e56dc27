"""Where on its own coordinate does an effect act, and how large is the mismatch along it?"""

from collections.abc import Sequence

import numpy as np

from identify.chain import Chain, signals
from identify.explain.contact import age, still, tap
from identify.explain.explanation import Profile, Range
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array
from identify.unnamed.turned import SINCE_TURN, turn_age

BINS = 24
MOST = 0.95  # share of an effect's energy that the stretch reported must hold
SPECTRAL = ("frequency", "mains lines")
FAINT = 0.2  # of its largest value: where a change below the noise everywhere counts as seen
LEAST = 0.05  # share of the energy below which a side of a level axis is not mentioned
UNITS = {"frequency": "Hz", "clock time": "s", "time in a run": "s", "time on a plateau": "s", "mains lines": "Hz"}
UNITS |= {f"{SINCE_TURN} of {signal}": "s" for signal in "uvwxy"}
UNITS |= {f"rate of {signal}": "V/s" for signal in "uvwxy"}


def coordinate(axis: str, chain: Chain, observation: Observation) -> Array:
    """Return the coordinate of every sample along an axis of time or level, shape (N,)."""
    trace = observation.trace
    if axis == "clock time":
        return trace.clock_s
    if axis == "time in a run":
        return np.arange(trace.size) / trace.rate_hz
    taps = signals(chain, trace)
    if axis == "time on a plateau":
        return age(still(chain, taps, trace)) / trace.rate_hz
    if axis.startswith(SINCE_TURN):
        return turn_age(trace.u[:] if axis.endswith("u") else tap(chain, taps, axis[-1])) / trace.rate_hz
    level = trace.u[:] if axis.endswith("u") else tap(chain, taps, axis[-1])
    return np.diff(level, prepend=level[:1]) * trace.rate_hz if axis.startswith("rate of") else level


def acting(
    axis: str, place: Place, chain: Chain, without: Chain, observations: Sequence[Observation]
) -> tuple[Range, ...]:
    """Return the stretches of ``axis`` on which two chains' signals at ``place`` differ by more than the noise.

    Along frequency it is the band that holds most of the difference. Along a level the two signs are looked at
    separately: a rail above and a rail below are two places.
    """
    changes = [np.where(o.use, _behind(place, chain, o) - _behind(place, without, o), 0.0) for o in observations]
    if axis in SPECTRAL:
        low, high, share = _narrowest(*_spectrum(changes, observations))
        return (Range(axis, low, high, UNITS[axis], share),)
    where = np.concatenate([coordinate(axis, chain, o) for o in observations])
    size = np.concatenate([np.abs(c) / o.noise_v for c, o in zip(changes, observations, strict=True)])
    sides = [where < 0.0, where >= 0.0] if axis.startswith("level") else [np.ones(where.size, dtype=bool)]
    found = [_visible(axis, where, size, side) for side in sides if side.any()]
    return tuple(r for r in found if r.share > LEAST) or tuple(found)


def _visible(axis: str, where: Array, size: Array, side: np.ndarray) -> Range:
    """Return the stretch of one side of an axis over which a change exceeds the noise, and its share of the energy."""
    seen = side & (size > min(1.0, FAINT * float(np.max(size))))
    total = float(np.sum(np.square(size)))
    if not seen.any():
        return Range(axis, float(np.min(where[side])), float(np.max(where[side])), UNITS.get(axis, "V"), 0.0)
    share = float(np.sum(np.square(size[seen]))) / total
    return Range(axis, float(np.min(where[seen])), float(np.max(where[seen])), UNITS.get(axis, "V"), share)


def _behind(place: Place, chain: Chain, observation: Observation) -> Array:
    """Return the signal behind all stages of a place, V, shape (N,)."""
    return signals(chain, observation.trace)[chain.index(place) - 1]


def _spectrum(changes: Sequence[Array], observations: Sequence[Observation]) -> tuple[Array, Array]:
    """Return frequencies and the power of a signal at them, all runs together."""
    grids = [np.fft.rfftfreq(c.size, 1.0 / o.trace.rate_hz) for c, o in zip(changes, observations, strict=True)]
    powers = [np.abs(np.fft.rfft(c)) ** 2 / c.size for c in changes]
    return np.concatenate(grids), np.concatenate(powers)


def _narrowest(grid: Array, power: Array) -> tuple[float, float, float]:
    """Return the narrowest stretch of a coordinate that holds ``MOST`` of the power, and its share."""
    total = float(np.sum(power))
    if total <= 0.0:
        return float(np.min(grid)), float(np.max(grid)), 0.0
    order = np.argsort(grid, kind="stable")
    edges = grid[order]
    heaped = np.concatenate(([0.0], np.cumsum(power[order]))) / total
    starts = np.unique(np.searchsorted(heaped, np.linspace(0.0, 1.0 - MOST, 200), side="right") - 1)
    stops = np.minimum(np.searchsorted(heaped, heaped[starts] + MOST), edges.size)
    best = int(np.argmin(edges[stops - 1] - edges[np.minimum(starts, edges.size - 1)]))
    start, stop = int(starts[best]), int(stops[best])
    return float(edges[start]), float(edges[stop - 1]), float(heaped[stop] - heaped[start])


def profile(axis: str, before: Chain, after: Chain, observations: Sequence[Observation]) -> Profile | None:
    """Return the residual of two chains along an axis of time or level; None along other axes."""
    if axis in (*SPECTRAL, "branch"):
        return None
    where = np.concatenate([coordinate(axis, after, o)[o.use] for o in observations])
    old = np.concatenate([o.used_residual(before) for o in observations])
    new = np.concatenate([o.used_residual(after) for o in observations])
    edges = np.linspace(float(np.min(where)), float(np.max(where)) + 1e-12, BINS + 1)
    number = np.clip(np.digitize(where, edges) - 1, 0, BINS - 1)
    count = np.maximum(np.bincount(number, minlength=BINS), 1)
    rms = [np.sqrt(np.bincount(number, np.square(r), BINS) / count) for r in (old, new)]
    return Profile(axis, UNITS.get(axis, "V"), edges, rms[0], rms[1])

