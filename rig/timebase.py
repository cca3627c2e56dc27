"""Is a column of times one uniform clock, at which rate does it tick, and where does it not?

A clock that stops for some of its ticks and then goes on with the others has gaps: they may be filled with lost samples
when that is asked for. Times that stand still, run back or stray are told with their place, and nothing is resampled.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array, Samples, blocks
from rig.errors import FileError
from rig.units import show

JITTER = 0.05
"""How far a sample may lie from its place on the uniform clock, in sample periods."""
MOST_GAPS = 1_000_000
GAP = "gap"
Place = Callable[[int], str]


@dataclass(frozen=True)
class TimeBase:
    """A uniform clock: the time of its first sample and its rate."""

    start_s: float
    rate_hz: float


@dataclass(frozen=True)
class Gaps:
    """Where samples are missing: before each of ``rows``, ascending, ``missing`` ticks of the clock had no row."""

    rows: NDArray[np.int64]
    missing: NDArray[np.int64]


@dataclass(frozen=True)
class Amiss:
    """One kind of step a clock does not make: in words, the first row after one, how many there are."""

    words: str
    row: int
    count: int


def uniform(time_s: Samples, place: Place) -> TimeBase:
    """Return the uniform clock behind ``time_s`` (N,), N > 1; ``place`` names a row in messages.

    Raises FileError at the first row where time stands still, runs back, jumps, or strays from the clock, and says of
    each kind how often it occurs.
    """
    return clock(time_s, place, gaps=False)[0]


def clock(time_s: Samples, place: Place, *, gaps: bool) -> tuple[TimeBase, Gaps]:
    """Return the clock behind ``time_s`` and its gaps, of which there are none unless ``gaps`` allows them."""
    period = _period(time_s)
    found = _amiss(time_s, period)
    if not period > 0:
        raise _broken(time_s, place, found, "times in ascending order")
    if [kind for kind in found if kind.words != GAP or not gaps]:
        raise _broken(time_s, place, found, f"a row every {show(period, 's')}")
    holes = _gaps(time_s, period)
    if holes.missing.sum() > time_s.size:
        raise FileError("more rows are missing than there are", where=place(int(holes.rows[0])),
                        value=f"{holes.missing.sum()} of {holes.missing.sum() + time_s.size}",
                        allowed="at most half", do="import the stretches one by one with --rows")
    return _fitted(time_s, holes, place), holes


def _period(time_s: Samples) -> float:
    """Return the sample period of most rows, s: the mean of the steps near the median of all stretches' medians."""
    middle = float(np.median([np.median(step) for _, step in _steps(time_s)]))
    total, count = 0.0, 0
    for _, step in _steps(time_s):
        regular = step[np.abs(step - middle) <= 0.5 * abs(middle)]
        total, count = total + float(regular.sum()), count + regular.size
    return total / count if middle > 0 else middle


def _steps(time_s: Samples) -> Iterator[tuple[int, Array]]:
    """Yield the steps from row to row in stretches, each with the row it comes after."""
    for start, stop in blocks(0, time_s.size - 1):
        yield start, np.diff(time_s[start : stop + 1])


def _amiss(time_s: Samples, period: float) -> list[Amiss]:
    """Return what is amiss with the steps, by kind, the one first in the table first."""
    tests: dict[str, Callable[[Array], NDArray[np.bool_]]] = {
        "time that stands still": lambda step: step == 0.0,
        "step back": lambda step: step < 0.0,
        "step too short": lambda step: (step > 0.0) & (step < 0.5 * period),
        GAP: lambda step: step > 1.5 * max(period, 0.0),
    }
    rows, counts = dict.fromkeys(tests, 0), dict.fromkeys(tests, 0)
    for start, step in _steps(time_s):
        for words, test in tests.items():
            wrong = test(step)
            if wrong.any() and not counts[words]:
                rows[words] = start + int(np.argmax(wrong)) + 1
            counts[words] += int(np.count_nonzero(wrong))
    found = [Amiss(words, rows[words], counts[words]) for words in tests if counts[words]]
    return sorted(found, key=lambda kind: kind.row)


def _broken(time_s: Samples, place: Place, found: list[Amiss], allowed: str) -> FileError:
    """Return the refusal of a clock, at the first row of those ``found``."""
    row = found[0].row
    before, here = time_s[row - 1 : row + 1]
    all_told = ", ".join(f"{kind.count} x {kind.words} (first at {place(kind.row)})" for kind in found)
    lost = "have the rows missing as lost samples: --gaps lost; or " if [k.words for k in found] == [GAP] else ""
    return FileError(
        "the time base is broken", where=place(row), value=f"{here:.9g} s after {before:.9g} s; in all {all_told}",
        allowed=allowed, do=f"{lost}cut the table there with --rows, or give a rate in place of the time column",
    )  # fmt: skip


def _gaps(time_s: Samples, period: float) -> Gaps:
    """Return where ticks of the clock have no row, and how many; none stands still or runs back."""
    rows, missing, total = [], [], 0
    for start, step in _steps(time_s):
        at = np.flatnonzero(step > 1.5 * period)
        rows.append(start + at + 1)
        missing.append(np.rint(step[at] / period) - 1.0)
        total += at.size
        if total > MOST_GAPS:
            raise FileError("too many gaps in the time base", value=f"more than {MOST_GAPS}", do="import it in parts")
    return Gaps(np.concatenate(rows).astype(np.int64), np.minimum(np.concatenate(missing), 2.0**53).astype(np.int64))


def _fitted(time_s: Samples, gaps: Gaps, place: Place) -> TimeBase:
    """Return the clock through the first and the last row; raise FileError at the first row that strays from it."""
    start_s, last_s = float(time_s[:1][0]), float(time_s[time_s.size - 1 :][0])
    rate_hz = (time_s.size - 1 + int(gaps.missing.sum())) / (last_s - start_s)
    largest, count, first = 0.0, 0, 0
    for start, stop in blocks(0, time_s.size):
        astray = np.abs((time_s[start:stop] - start_s) * rate_hz - ticks(gaps, start, stop))
        wrong = astray > JITTER
        first = start + int(np.argmax(wrong)) if wrong.any() and not count else first
        largest, count = max(largest, float(astray.max())), count + int(np.count_nonzero(wrong))
    if count:
        raise _not_uniform(time_s, place, rate_hz, (first, count, largest))
    return TimeBase(start_s, _plain_rate(rate_hz, largest / time_s.size))


def ticks(gaps: Gaps, start: int, stop: int) -> NDArray[np.int64]:
    """Return at which tick of the clock each of the rows [start, stop) stands."""
    rows = np.arange(start, stop)
    before = np.concatenate([[0], np.cumsum(gaps.missing)])
    passed: NDArray[np.int64] = before[np.searchsorted(gaps.rows, rows, side="right")]
    return rows + passed


def _not_uniform(time_s: Samples, place: Place, rate_hz: float, astray: tuple[int, int, float]) -> FileError:
    """Return the refusal of a clock whose rows stray: the first of them, how many, and by how many periods at most."""
    row, count, largest = astray
    before, here = time_s[row - 1 : row + 1]
    told = f"{here:.9g} s after {before:.9g} s; {count} rows stray, by {largest:.3g} of a sample period at most"
    return FileError(
        "the time base is not uniform", where=place(row), value=told,
        allowed=f"within {JITTER:g} of a sample period of a uniform clock of {show(rate_hz, 'Hz')}",
        do="cut the table there with --rows, or give a rate in place of the time column",
    )  # fmt: skip


def _plain_rate(rate_hz: float, uncertainty: float) -> float:
    """Return the number of fewest digits that the times, rounded as they were written, cannot tell from the rate."""
    for digits in range(1, 16):
        plain = float(f"{rate_hz:.{digits}g}")
        if abs(plain / rate_hz - 1.0) <= max(uncertainty, 1e-12):
            return plain
    return rate_hz
