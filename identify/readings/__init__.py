"""What changes the readings rather than the chain: what is it, where is it in the recordings, and how is it undone?

A chain turns a stimulus into an answer; noise, stray readings, lost readings and the ADC's steps come after it. They
are found from the readings and the residual by robust tests, undone (left out, put back in time), and reported.
"""

from identify.readings.blemish import Blemish
from identify.readings.coloured_noise import ColouredNoise
from identify.readings.grid import AdcSteps
from identify.readings.missing_samples import MissingSamples
from identify.readings.range_end import RangeEnd
from identify.readings.spikes import Spikes


def blemishes() -> dict[str, type[Blemish]]:
    """Return every kind of blemish by id."""
    return {kind.id: kind for kind in (AdcSteps, ColouredNoise, MissingSamples, RangeEnd, Spikes)}
