"""Do the readings lie on a grid: the steps of the ADC?"""

from collections.abc import Sequence
from typing import ClassVar, final

import numpy as np

from identify.effects.adc_quantisation import AdcQuantisation
from identify.interval import Interval
from identify.noise import OFF_GRID, good, grid_step_v
from identify.readings.blemish import Blemish
from identify.trace import Trace

COARSE = 0.2  # of the noise: finer steps add less than a third of a per cent to its power, and are not worth a word


@final
class AdcSteps(Blemish):
    """Readings in whole numbers of one step, too fine against the noise to show in their mean."""

    id = AdcQuantisation.id
    title = AdcQuantisation.title
    equation = AdcQuantisation.equation
    sentence = AdcQuantisation.sentence
    axis = AdcQuantisation.axis
    fingerprint = AdcQuantisation.fingerprint
    declared: ClassVar = AdcQuantisation.declared[:1]
    confused_with: ClassVar = AdcQuantisation.confused_with


def adc_steps(traces: Sequence[Trace], noise_v: float) -> tuple[AdcSteps, ...]:
    """Return the step of the grid that all readings of all recordings lie on, where it is not small against the noise.

    Readings that lie on no grid would fall this near to one with a chance of one in ten each.
    """
    step = grid_step_v(traces)
    if step < COARSE * noise_v:
        return ()
    levels = [np.unique(trace.y[:][good(trace)]) for trace in traces]
    distinct, spanned = sum(each.size for each in levels), max(float(np.ptp(each)) for each in levels) / step
    known = OFF_GRID * step / max(spanned, 1.0)  # no reading lies further off the grid
    return (AdcSteps({"LSB": Interval(step, step - known, step + known)}, float(0.1 ** min(distinct, 300))),)
