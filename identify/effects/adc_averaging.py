"""The converter reads no instant, but the mean of a stretch of time that ends there."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.effects.effect import Confusion, Effect
from identify.stage import Block, Grid, Held, Parameter, Place, Run, Shape, Values, memoryless
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

LENGTH = Parameter("adc_averaging.length", "s", "log")


@final
class AdcAveraging(Effect):
    """A converter that integrates, a decimating filter of equal weights, the averaging of a scope or of firmware.

    To first order it is a delay of half its length, to third a resonance of damping sqrt(3) / 2 at 2 sqrt(3) / length.
    """

    id = "adc_averaging"
    title = "averaging of the ADC"
    equation = "y'(t) = 1 / length x integral of y over the last length"
    sentence = (
        "A reading is the mean of the last {}, not the level of an instant. Switch its averaging off or "
        "shorten it, or read no faster than it takes."
    )
    axis = "frequency"
    fingerprint = "edges become ramps of a fixed length; sines vanish whose period fits into it"
    quick = True
    linear = True
    places = (Place.SENSE,)
    declared = (LENGTH,)
    absent: ClassVar = {"length": 0.0}
    confused_with = (
        Confusion("dead_time", "sines at higher frequency: a delay leaves the amplitude alone"),
        Confusion("extra_pole", "sines whose period fits into the length: a mean loses them, a pole does not"),
        Confusion("resonance", "sines whose period fits into the length: a mean loses them, a resonance does not"),
        Confusion("source_pole", "sines whose period fits into the length: a mean loses them, a pole does not"),
    )
    example: ClassVar = {"length": 2.7e-3}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running mean."""
        (length,) = values
        if not length > 0.0:
            return memoryless(lambda y: y, shape)
        return running_mean(length / grid.step_s, isinstance(shape, Held)), shape

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the length, tried from a sample to a thousand, or a small one, that explains most."""
        return self.timed(evidence, "length", np.geomspace(1.0, 1e3, 7).tolist())


def running_mean(steps: float, held: bool) -> Run:
    """Return the mean of a signal over the last ``steps`` of a grid, before the start as it is there.

    Between instants the signal is straight, or ``held`` at the value that it has at the end of each step.
    """
    whole = int(steps)
    rest = steps - whole
    past = np.zeros(0)

    def run(block: Block) -> Array:
        nonlocal past
        known = past if past.size else np.full(whole + 1, block.signal[0])
        y = np.concatenate((known, block.signal))
        past = y[-(whole + 1) :].copy()
        last, before = y[1 : y.size - whole], y[: y.size - whole - 1]  # where the mean begins, and the instant before
        sums = np.cumsum(y)
        out = sums[whole + 1 :] - sums[1 : y.size - whole]
        if held:
            out += rest * last
        else:  # by trapezoids, and a part of one
            out += 0.5 * (last - y[whole + 1 :]) + rest * (last - 0.5 * rest * (last - before))
        return np.asarray(out / steps)

    return run
