"""Is a column of times one uniform clock, and at which rate does it tick?"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array
from rig.errors import FileError

JITTER = 0.05
"""How far a sample may lie from its place on the uniform clock, in sample periods."""


@dataclass(frozen=True)
class TimeBase:
    """A uniform clock: the time of its first sample and its rate."""

    start_s: float
    rate_hz: float


def uniform(time_s: Array, place: Callable[[int], str]) -> TimeBase:
    """Return the uniform clock behind ``time_s`` (N,), N > 1; ``place`` names a row in messages.

    Raises FileError at the row where time stands still, runs back, jumps, or strays from the clock.
    """
    steps = np.diff(time_s)
    period = float(np.median(steps))
    _refuse(~(np.abs(steps - period) <= 0.5 * abs(period)) | (steps <= 0), "the time base is broken", time_s, place,
            f"a row every {period:.6g} s" if period > 0 else "times in ascending order")
    rate = (time_s.size - 1) / float(time_s[-1] - time_s[0])
    astray = np.abs((time_s - time_s[0]) * rate - np.arange(time_s.size))
    _refuse(astray[1:] > JITTER, "the time base is not uniform", time_s, place,
            f"within {JITTER:g} of a sample period of a uniform clock of {rate:.6g} Hz")
    return TimeBase(float(time_s[0]), _plain_rate(rate, float(astray.max()) / time_s.size))


def _refuse(bad: NDArray[np.bool_], what: str, time_s: Array, place: Callable[[int], str], allowed: str) -> None:
    """Raise FileError at the row after the first True of ``bad``."""
    if bad.any():
        row = int(np.argmax(bad)) + 1
        raise FileError(what, where=place(row), value=f"{time_s[row]:.9g} s after {time_s[row - 1]:.9g} s",
                        allowed=allowed, do="cut the table there, or give a rate in place of the time column")


def _plain_rate(rate_hz: float, uncertainty: float) -> float:
    """Return the number of fewest digits that the times, rounded as they were written, cannot tell from the rate."""
    for digits in range(1, 16):
        plain = float(f"{rate_hz:.{digits}g}")
        if abs(plain / rate_hz - 1.0) <= max(uncertainty, 1e-12):
            return plain
    return rate_hz
