"""A sensor that loses the sign, or a part of it."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values, memoryless

if TYPE_CHECKING:
    from identify.evidence import Evidence

LOST = Parameter("rectifying_sensor.lost", "1", scale=0.03)


@final
class RectifyingSensor(Effect):
    """A reading that turns up, by the share ``lost``, where the signal is negative: 1 is a full rectifier."""

    id = "rectifying_sensor"
    title = "sensor that loses the sign"
    equation = "y' = (1 - lost) y + lost abs(y)"
    sentence = (
        "The sensor does not tell negative from positive as it should: {} of the sign is lost, 1 being all of it. It "
        "reads a magnitude, or its negative half has another gain; shift its input by a known voltage, or replace it."
    )
    axis = "level of y"
    fingerprint = "sign lost: a corner at y = 0"
    places = (Place.SENSE,)
    elsewhere: ClassVar = {Place.F: "unequal_slopes"}
    declared = (LOST,)
    absent: ClassVar = {"lost": 0.0}
    confused_with = (
        Confusion("unequal_slopes", "an offset added at y: the corner of a rectifier stays at zero"),
        Confusion("adc_nonlinearity", "two amplitudes at one frequency: a corner bends in proportion, a square more"),
    )
    example: ClassVar = {"lost": 0.013}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the rectifier at work."""
        (lost,) = values
        return memoryless(lambda y: np.asarray(y + 2.0 * lost * np.maximum(-y, 0.0)), shape)

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the share that explains most; the problem is linear in it."""
        best = evidence.proportion(self, "lost", 1e-2)
        return [best] if best else []
