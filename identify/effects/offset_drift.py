"""The zero of the reading moves with the clock."""

from typing import TYPE_CHECKING, ClassVar, final

from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

RATE = Parameter("offset_drift.rate", "V/s", scale=1e-2)


@final
class OffsetDrift(Effect):
    """A ramp added to the reading, zero at clock zero: warming up, a leaking integrator behind G2."""

    id = "offset_drift"
    title = "drift of the zero"
    equation = "y' = y + rate t, t on the clock of the recordings"
    sentence = "The zero of the reading moves with the clock: {}."
    axis = "clock time"
    fingerprint = "additive, grows with clock time"
    places = (Place.SENSE,)
    declared = (RATE,)
    absent: ClassVar = {"rate": 0.0}
    confused_with = (
        Confusion("gain_drift", "a repeat later in time, at two levels: a drifting zero moves both alike"),
        Confusion("plateau_droop", "a repeat later in time: a droop starts anew on every plateau"),
    )
    example: ClassVar = {"rate": 0.011}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the ramp at work."""
        (rate,) = values
        return (lambda block: block.signal + rate * block.time_s()), shape

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the rate that explains most; the problem is linear in it."""
        best = evidence.proportion(self, "rate", 1e-3)
        return [best] if best else []
