"""Do the readings lie on a grid: the steps of the ADC?"""

from collections.abc import Sequence
from typing import ClassVar, final

import numpy as np

from identify.effects.adc_quantisation import AdcQuantisation
from identify.interval import Interval
from identify.noise import OFF_GRID, good, grid_step_v
from identify.readings.blemish import Blemish
from identify.trace import Trace

COARSE = 0.05  # of the noise: finer steps add less than 0.02 % to its power, which a million readings hardly show


@final
class AdcSteps(Blemish):
    """Readings in whole numbers of one step, too fine against the noise to show in their mean."""

    id = AdcQuantisation.id
    title = AdcQuantisation.title
    equation = AdcQuantisation.equation
    sentence = (
        "The readings come in whole steps of the ADC: {}. Where that matters, choose a smaller range of the ADC or "
        "amplify ahead of it; or add noise of half a step and average."
    )
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
    adds = f"they add {100.0 * step**2 / (12.0 * noise_v**2):.2g} % to the power of the noise"
    return (AdcSteps({"LSB": Interval(step, step - known, step + known)}, float(0.1 ** min(distinct, 300)), adds),)
