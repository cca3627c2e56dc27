"""Do readings pile up at one value: the end of the ADC's range, with the noise in front of it?

Noise spreads the readings of any level over many values. Where the ADC stops, or the amplifier that drives it, it stops
the noise too: the extreme value of all recordings is read again and again, oftener than what lies just inside it. No
model is needed to see that, and none is asked: readings so near the end that it cuts their noise are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from scipy.ndimage import maximum_filter1d, median_filter, minimum_filter1d
from scipy.stats import binom

from identify.effects.adc_clipping import AdcClipping
from identify.interval import Interval
from identify.noise import good, grid_step_v
from identify.readings.blemish import Blemish
from identify.readings.mend import without
from identify.readings.outliers import Samples
from identify.trace import Array, Mask, Trace

LEAST = 25  # readings at the end, at least
COARSE = 0.5  # of the noise: wider steps of the ADC hold the readings of a level together by themselves
INSIDE = 0.25  # of the noise, or two steps: what lies so near the end would be read as often as the end itself
ALIKE = 0.3  # share of readings that repeat the one before, elsewhere: more is no noise
REACH = 3.0  # sd from the end within which it cuts the noise of a level
LEVEL = 3  # readings whose median is the level
BESIDE = 9  # readings of which none may come so near: of those on the way there, the noise would choose which count
AROUND, FAR = 500, 8.0  # readings before and after those, of which all within so many sd count as near: the noise of a
# level a little below would choose the highest of it
GAP = 51  # readings: shorter gaps between those left out are left out, too
EXACT = 1e-9  # of the range of readings: apart no further, they are the same


@final
class RangeEnd(Blemish):
    """Readings that stop at one value or at two, their noise with them."""

    id = AdcClipping.id
    title = AdcClipping.title
    equation = AdcClipping.equation
    sentence = AdcClipping.sentence
    axis = AdcClipping.axis
    fingerprint = AdcClipping.fingerprint
    declared: ClassVar = AdcClipping.declared
    confused_with: ClassVar = AdcClipping.confused_with
    alone = True


@dataclass(frozen=True)
class _End:
    """One end of the range: its value, whether it is the upper one, and by how much two equal readings may differ."""

    value_v: float
    sign: float
    same_v: float

    def at(self, y: Array) -> Mask:
        """Return which readings stand at the end."""
        return np.asarray(self.sign * (self.value_v - y) <= self.same_v)


def range_ends(traces: Sequence[Trace], noise_v: float) -> tuple[tuple[Trace, ...], tuple[RangeEnd, ...]]:
    """Return the recordings without what the ends of the ADC's range cut, and these ends; as they are where none do."""
    readings = [trace.y[:][good(trace)] for trace in traces]
    every = np.concatenate(readings)
    step = grid_step_v(traces)
    same_v = max(0.5 * step, EXACT * float(np.ptp(every))) if every.size else np.inf
    if 2.0 * same_v > COARSE * noise_v:
        return tuple(traces), ()
    inside_v = max(INSIDE * noise_v, 2.5 * step)
    extremes = {
        name: _End(sign * float(np.max(sign * every)), sign, same_v) for name, sign in (("upper", 1.0), ("lower", -1.0))
    }  # fmt: skip
    chances = {name: _chance(end, every, inside_v) for name, end in extremes.items()}
    found = {name: (extremes[name], chance) for name, chance in chances.items() if chance is not None}
    ends = tuple(extremes.values())
    if not found or _repeating(ends, readings) > ALIKE or _copied(ends, readings) > ALIKE:
        return tuple(traces), ()
    met = [end for end, _ in found.values()]
    count = sum(int(np.count_nonzero(end.at(every))) for end in met)
    values = {name: Interval(e.value_v, e.value_v - same_v, e.value_v + same_v) for name, (e, _) in found.items()}
    told = RangeEnd(values, max(p for _, p in found.values()), f"{count} readings stand there")
    return tuple(without(trace, _cut(trace, met, noise_v)) for trace in traces), (told,)


def _chance(end: _End, y: Array, inside_v: float) -> float | None:
    """Return how likely as many readings would stand at an end that is none, None where it is none.

    The density of readings falls towards their extreme: a stretch just inside holds as many as one as wide at the end,
    or more. What is called an end has to hold more than the whole of a wider stretch.
    """
    at = int(np.count_nonzero(end.at(y)))
    near = int(np.count_nonzero(end.sign * (end.value_v - y) <= inside_v)) - at
    share = 2.0 * end.same_v / (2.0 * end.same_v + inside_v)
    return float(binom.sf(at - 1, at + near, share)) if at >= LEAST and at > near else None


def _repeating(ends: Sequence[_End], readings: Sequence[Array]) -> float:
    """Return the share of readings away from the ends that repeat the one before."""
    same, count = 0, 0
    for y in readings:
        away = ~np.any([end.at(y[:-1]) for end in ends], axis=0)
        same += int(np.count_nonzero(away & (np.abs(np.diff(y)) <= ends[0].same_v)))
        count += int(np.count_nonzero(away))
    return same / max(count, 1)


def _copied(ends: Sequence[_End], readings: Sequence[Array]) -> float:
    """Return the share of times at an end before which the reading was what it was the time before.

    Without noise a period is the one before to the last digit, and its highest reading is read again and again.
    """
    same, count = 0, 0
    for y in readings:
        for end in ends:
            at = end.at(y)
            before = y[:-1][at[1:] & ~at[:-1]]
            same += int(np.count_nonzero(np.abs(np.diff(before)) <= end.same_v))
            count += max(before.size - 1, 0)
    return same / max(count, 1)


def _cut(trace: Trace, ends: Sequence[_End], noise_v: float) -> Samples:
    """Return the readings whose noise an end cuts, and those beside them that it would have chosen, as numbers."""
    y = trace.y[:]
    level = median_filter(y, LEVEL, mode="nearest")
    every = np.zeros(y.size, dtype=np.bool_)
    for end in ends:
        away_sd = end.sign * (end.value_v - level) / noise_v
        near = end.at(y) | (minimum_filter1d(away_sd, BESIDE, mode="nearest") < REACH)
        near |= _around(near) & (away_sd < FAR)
        every |= near | (_between(near) & (away_sd < 2.0 * FAR))
    return np.flatnonzero(every)


def _around(near: Mask) -> Mask:
    """Return what has one of ``near`` not far from it."""
    return np.asarray(maximum_filter1d(near, 2 * AROUND + 1, mode="constant"))


def _between(near: Mask) -> Mask:
    """Return ``near`` without its short gaps: on the way down from there the noise chooses what is near."""
    return np.asarray(minimum_filter1d(maximum_filter1d(near, GAP, mode="nearest"), GAP, mode="nearest"))
