"""Are readings the one before them once more, to the last bit, as where the converter was not ready in time?

Noise makes two readings in a row the same no oftener than it lets them differ by one step of the ADC. Where they are
the same far oftener, and one such does not bring on the next as rest would, some are no readings of their own. No model
is needed to see that, and none is asked: they are left out.
"""

from collections.abc import Sequence
from typing import ClassVar, final

import numpy as np
from scipy.stats import binom, binomtest

from identify.interval import Interval
from identify.noise import good, grid_step_v
from identify.readings.blemish import Blemish
from identify.readings.mend import without
from identify.stage import Parameter
from identify.trace import Array, Mask, Trace
from identify.unnamed.correction import UNNAMED

COARSE = 0.5  # of the noise: wider steps of the ADC make readings the same by themselves
OFTENER = 2.0  # times as often as readings one step apart: noise alone has them nearly as often
BROUGHT_ON = 0.2  # by which the same once more may be likelier after such a one: at rest without noise all are
LEAST, MOST = 0.001, 0.7  # of all readings: more are those of a converter that is slower than its clock
CONVINCING = 1e-6  # chance of so many
RECUR = 0.9  # of all readings that differ from the one before: fewer distinct ones lie on a grid, if a rounded one


@final
class DoubledReadings(Blemish):
    """Readings that are the one before once more."""

    id = UNNAMED
    form = "doubled readings"
    title = "readings that are the one before once more"
    equation = "y'[k] = y'[k-1] in a share of the readings"
    sentence = (
        "Readings are the one before once more, to the last bit: {}. The converter had none ready when it was asked: "
        "read it out more slowly, or wait for its flag. They are left out of the fit."
    )
    axis = "clock time"
    fingerprint = "readings in a row that are the same to the last bit"
    alone = True
    declared: ClassVar = (Parameter("doubled.share", "1", "log"),)


def doubled(traces: Sequence[Trace], noise_v: float) -> tuple[tuple[Trace, ...], tuple[DoubledReadings, ...]]:
    """Return the recordings without readings that are the one before once more, and what tells of them.

    As they are where there are none. ``noise_v`` is the noise of a reading, V.
    """
    step_v = max(map(_step_v, traces), default=0.0)
    moves = [np.diff(trace.y[:]) for trace in traces]
    use = [good(trace)[1:] & good(trace)[:-1] for trace in traces]
    count = sum(int(np.count_nonzero(each)) for each in use)
    if step_v > COARSE * noise_v or not count:
        return tuple(traces), ()
    again = [(np.abs(move) <= 0.5 * step_v) & ok for move, ok in zip(moves, use, strict=True)]
    beside = sum(int(np.count_nonzero(_one_apart(move, step_v) & ok)) for move, ok in zip(moves, use, strict=True))
    same, followed, chance = sum(map(np.count_nonzero, again)), sum(map(_followed, again)), 0.5 * beside / count
    p_value = float(binom.sf(same - 1, count, OFTENER * chance))
    brought_on = followed / max(same, 1) > same / count + BROUGHT_ON
    if not LEAST * count < same < MOST * count or p_value > CONVINCING or brought_on:
        return tuple(traces), ()
    ends = binomtest(same, count).proportion_ci()
    share = Interval(*(max(each - chance, 0.0) for each in (same / count, float(ends.low), float(ends.high))))
    told = DoubledReadings({"share": share}, p_value, f"{same} of {count} readings")
    late = (np.flatnonzero(each) + 1 for each in again)
    return tuple(without(trace, at) for trace, at in zip(traces, late, strict=True)), (told,)


def _step_v(trace: Trace) -> float:
    """Return the step of the grid on which readings lie, V; 0 where they lie on none.

    Of a grid that a table gave with few digits it is the usual distance between readings.
    """
    exact = grid_step_v([trace])
    if exact:
        return exact
    readings = trace.y[:][good(trace)]
    distinct = np.unique(readings)
    recur = distinct.size < RECUR * (1 + np.count_nonzero(np.diff(readings)))
    return float(np.median(np.diff(distinct))) if recur and distinct.size > 1 else 0.0


def _one_apart(moves: Array, step_v: float) -> Mask:
    """Return which moves are by one step of the ADC."""
    return np.asarray((np.abs(moves) > 0.5 * step_v) & (np.abs(moves) <= 1.5 * step_v))


def _followed(again: Mask) -> int:
    """Return how many readings that are the one before once more are followed by another such."""
    return int(np.count_nonzero(again[1:] & again[:-1]))
