"""The converter reads no instant, but the mean of a stretch of time that ends there."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.effects.effect import Confusion, Effect
from identify.stage import Block, Grid, Held, Parameter, Place, Ramp, Run, Shape, Values, memoryless
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

LENGTH = Parameter("adc_averaging.length", "s", "log")
LONGEST = 1 << 20  # instants: longer than any run that a converter would average as a whole


@final
class AdcAveraging(Effect):
    """A converter that integrates, a decimating filter of equal weights, the averaging of a scope or of firmware.

    To first order it is a delay of half its length, to third a resonance of damping sqrt(3) / 2 at 2 sqrt(3) / length.
    """

    id = "adc_averaging"
    title = "averaging of the ADC"
    equation = "y'(t) = 1 / length x integral of y over the last length"
    sentence = (
        "A reading is the mean of the last {}, not the level of an instant. Switch the averaging off, shorten it, or "
        "read no faster than it takes."
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
        """Return the running mean: straight between instants, also of what is held."""
        (length,) = values
        if not length > 0.0:
            return memoryless(lambda y: y, shape)
        return running_mean(length / grid.step_s, shape.fraction if isinstance(shape, Held) else None), Ramp()

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the length, tried from a sample to a thousand, or a small one, that explains most."""
        return self.timed(evidence, "length", np.geomspace(1.0, 1e3, 7).tolist())


def running_mean(steps: float, late: float | None) -> Run:
    """Return the mean of a signal over the last ``steps`` of a grid, before the start as it is there.

    Between instants the signal is straight, or held where its changes are ``late`` by a share of a step.
    """
    whole = int(min(steps, LONGEST))
    rest = min(steps - whole, 1.0)
    first, past = 0.0, np.zeros(0)

    def run(block: Block) -> Array:
        nonlocal first, past
        if not past.size:
            first, past = float(block.signal[0]), np.zeros(whole + 1)
        y = np.concatenate((past, block.signal - first))
        past = y[-(whole + 1) :].copy()
        # now, where the mean begins, and the instant before that
        now, last, before = y[whole + 1 :], y[1 : y.size - whole], y[: y.size - whole - 1]
        sums = np.cumsum(y)
        out = sums[whole + 1 :] - sums[1 : y.size - whole] + rest * last
        if late is None:  # by trapezoids
            out -= 0.5 * (now - last) + 0.5 * rest**2 * (last - before)
        else:
            out -= late * (now - last) + max(rest + late - 1.0, 0.0) * (last - before)
        return np.asarray(first + out / steps)

    return run
