"""Which samples make up a staircase, a sine, a triangle: levels in V, counts in samples, pure arithmetic.

Sample k of a periodic stimulus is taken at its ``turns[k]``, the number of periods passed since the first sample.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Points = tuple[Array, Array]

WHOLE = 1e-9
"""How far a number of periods or samples may be from a whole one, relative, and still count as whole."""


def is_whole(number: float) -> bool:
    """Return whether ``number`` is a positive integer but for rounding."""
    return round(number) >= 1 and abs(number - round(number)) <= WHOLE * number


def turns(samples: int, frequency_hz: float, rate_hz: float, start: int = 0, stop: int | None = None) -> Array:
    """Return the periods passed at the samples [start, stop) of ``samples``, modulo 1 where they fit exactly.

    When ``samples`` samples are a whole number of periods the result repeats to the last bit from one run to the next.
    """
    periods, at = samples * frequency_hz / rate_hz, np.arange(start, samples if stop is None else stop, dtype=np.int64)
    if is_whole(periods):
        return np.asarray(at * round(periods) % samples / samples, dtype=np.float64)
    return np.asarray(at * (frequency_hz / rate_hz), dtype=np.float64)


def staircase(levels_v: Sequence[float], dwell: int, start: int = 0, stop: int | None = None) -> Array:
    """Return the samples [start, stop) of each level held for ``dwell`` samples, levels * dwell in all."""
    at = np.arange(start, len(levels_v) * dwell if stop is None else stop, dtype=np.int64)
    return np.asarray(np.asarray(levels_v, dtype=np.float64)[at // dwell])


def sine(amplitude_v: float, at: Array, phase_rad: float = 0.0, offset_v: float = 0.0) -> Array:
    """Return offset + amplitude * cos(2 pi turns + phase) at the turns ``at``, as in eq. (20)."""
    return np.asarray(offset_v + amplitude_v * np.cos(2.0 * np.pi * at + phase_rad), dtype=np.float64)


def triangle(amplitude_v: float, at: Array, offset_v: float = 0.0) -> Array:
    """Return a triangle that starts at ``offset_v`` going up, at the turns ``at``."""
    return np.asarray(offset_v + amplitude_v * (4.0 * np.abs((at - 0.25) % 1.0 - 0.5) - 1.0), dtype=np.float64)


def schroeder_phases(lines: int) -> Array:
    """Return the phases in rad that keep the peak of ``lines`` equal lines low: -pi n (n + 1) / N."""
    n = np.arange(lines)
    return np.asarray(-np.pi * n * (n + 1) / lines, dtype=np.float64)


def minor_loops(amplitudes_v: Sequence[float], slope_v_per_s: float, loops: int, offset_v: float = 0.0) -> Points:
    """Return corner times (s) and levels (V) of triangles of each amplitude in turn, all at one slope.

    Rising first; ``loops`` triangles of an amplitude before the next. One slope keeps effects of rate out of the loops.
    """
    corners = [corner * amplitude for amplitude in amplitudes_v for _ in range(loops) for corner in (1.0, -1.0)]
    levels = offset_v + np.asarray([0.0, *corners, 0.0])
    times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(levels)) / slope_v_per_s)])
    return times, np.asarray(levels, dtype=np.float64)


def table(
    points: Points, samples: int, rate_hz: float, *, straight: bool, start: int = 0, stop: int | None = None,
) -> Array:  # fmt: skip
    """Return the samples [start, stop) of a table of (times in s, levels in V) on a grid of ``samples`` samples.

    Between the points the level is held, or goes in a ``straight`` line; times ascend and the first is 0.
    """
    times, levels = points
    at = np.arange(start, samples if stop is None else stop) / rate_hz
    if straight:
        return np.asarray(np.interp(at, times, levels), dtype=np.float64)
    slack = WHOLE / rate_hz
    return np.asarray(levels[np.searchsorted(times, at + slack, side="right") - 1], dtype=np.float64)


def along(points: Points, rate_hz: float, *, straight: bool) -> Callable[[int, int], Array]:
    """Return what tells the samples [start, stop) of a table."""
    return lambda start, stop: table(points, stop, rate_hz, straight=straight, start=start, stop=stop)
