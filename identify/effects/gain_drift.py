"""The scale of the reading moves with the clock."""

from typing import TYPE_CHECKING, ClassVar, final

from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

RATE = Parameter("gain_drift.rate", "1/s", scale=1e-3)


@final
class GainDrift(Effect):
    """A reading that grows or shrinks in proportion to itself: a reference or a gain resistor warming up."""

    id = "gain_drift"
    title = "drift of the scale"
    equation = "y' = y (1 + rate t), t on the clock of the recordings"
    sentence = (
        "The scale of the reading moves with the clock: {}. A reference or a gain resistor warms up; let the bench "
        "warm up first, or calibrate between runs."
    )
    axis = "clock time"
    fingerprint = "multiplicative, grows with clock time"
    places = (Place.SENSE,)
    declared = (RATE,)
    absent: ClassVar = {"rate": 0.0}
    confused_with = (
        Confusion("offset_drift", "a repeat later in time, at two levels: a drifting scale moves the higher one more"),
        Confusion("soft_knee", "the same run again later in time: a knee does not move with the clock"),
    )
    example: ClassVar = {"rate": 2.3e-3}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the growing scale at work."""
        (rate,) = values
        return (lambda block: block.signal * (1.0 + rate * block.time_s())), shape

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the rate that explains most; the problem is linear in it."""
        best = evidence.proportion(self, "rate", 1e-4)
        return [best] if best else []
