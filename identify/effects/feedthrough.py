"""The stimulus reaches the ADC past the circuit."""

from typing import TYPE_CHECKING, ClassVar, final

from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

K = Parameter("feedthrough.k", "V/V", scale=0.01)


@final
class Feedthrough(Effect):
    """A share of the generator's voltage added to the reading: crosstalk, a shared ground."""

    id = "feedthrough"
    title = "feedthrough of the stimulus"
    equation = "y' = y + k u"
    sentence = "A share of the generator's voltage reaches the ADC past the circuit: {}."
    axis = "level of u"
    fingerprint = "motion during plateaus; a stuck-state sine isolates it"
    quick = True
    places = (Place.SENSE,)
    declared = (K,)
    absent: ClassVar = {"k": 0.0}
    confused_with = (
        Confusion(
            "plateau_tilt",
            "a sine too small to move F at a high frequency: a bypass of F alone is filtered by G1 and G2",
        ),
    )
    example: ClassVar = {"k": 0.012}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the addition at work; the reading sees the voltage just before its instant."""
        (k,) = values
        return (lambda block: block.signal + k * block.source), shape

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the share that explains most; the problem is linear in it."""
        best = evidence.proportion(self, "k", 1e-2)
        return [best] if best else []
