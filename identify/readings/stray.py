"""Which single readings are off by the more, the faster they move: taken at another moment than they should have been?

A trigger that comes by software is late now and then, a reading that was not ready is the one before it once more. At
rest nobody sees that; while the signal moves it throws single readings far out of the noise.
"""

from collections.abc import Sequence
from typing import ClassVar, final

import numpy as np

from identify.interval import Interval
from identify.readings.blemish import Blemish
from identify.readings.outliers import FarOut, Outliers, contradicted, moving, poisson_rate
from identify.stage import Parameter
from identify.trace import Array
from identify.unnamed.correction import UNNAMED


@final
class StrayReadings(Blemish):
    """Single readings that are off, the further the faster the readings move."""

    id = UNNAMED
    form = "stray readings"
    title = "single readings that were taken at another moment"
    equation = "y'(t) = y(t - off) in single readings"
    sentence = (
        "Single readings are off, the further the faster they move: {}. They were taken at another moment than they "
        "should have been, as behind a trigger that comes by software, or are an earlier one once more. They are left "
        "out of the fit."
    )
    axis = "rate of y"
    fingerprint = "isolated outliers where the readings move fast"
    declared: ClassVar = (Parameter("stray.rate", "1/s", "log"), Parameter("stray.off", "s", "log"))


def stray(seen: FarOut | None, proof: Sequence[Outliers]) -> tuple[tuple[StrayReadings, ...], float]:
    """Return the stray readings among those that lie far out, and the threshold in sd from which one is left out.

    That is infinite where there are none. ``seen`` are of the training recordings; nothing is reported where the
    held-out ones show far fewer than they should among those that move as fast. ``rate`` is of those that stand out: of
    those at rest nothing is seen.
    """
    if seen is None or not seen.by_motion:
        return (), float("inf")
    fast_v = float(np.median(seen.moves_v))
    share = np.count_nonzero(seen.moves_v >= fast_v) / moving(seen.runs, fast_v)
    if contradicted(proof, seen.threshold, share, fast_v):
        return (), float("inf")
    rate_hz = np.repeat([o.trace.rate_hz for o in seen.runs], [out.size for out in seen.out])
    speed, moves = seen.moves_v * rate_hz, seen.moves_v > 0.0
    off = _median(seen.sizes_v[moves] / speed[moves])
    values = {"rate": poisson_rate(speed.size, 1.0 / seen.span_s), "off": off}
    span = float(np.min(speed)), float(np.max(speed)), 1.0
    return (StrayReadings(values, seen.p_value, seen.where(speed.size, proof), span),), seen.threshold


def _median(values: Array) -> Interval:
    """Return the median of values and its 95 % interval, by what chance does to ranks."""
    ranks = 0.5 + np.array([0.0, -0.98, 0.98]) / np.sqrt(values.size)
    return Interval(*np.quantile(values, np.clip(ranks, 0.0, 1.0)).tolist())
