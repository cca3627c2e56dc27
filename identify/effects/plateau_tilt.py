"""A way past the play: v reaches w also where F lets go."""

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

from identify.altered_play import Law
from identify.effects.effect import Confusion
from identify.effects.inside_play import InsidePlay
from identify.stage import Grid, Parameter, Place, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

K = Parameter("plateau_tilt.k", "V/V", scale=0.1)


@final
class PlateauTilt(InsidePlay):
    """A share of v added to w, on plateaus as on borders, where it is but part of the slope."""

    id = "plateau_tilt"
    title = "tilted plateaus"
    equation = "w' = w + k v"
    sentence = (
        "Some of v passes by the gap, so that plateaus are tilted: {}. The blocked diodes leak or couple through their "
        "capacitance, or a resistor bridges them; a stiff gear train has a spring beside it."
    )
    axis = "level of w"
    fingerprint = "slope against v on plateaus"
    places = (Place.F,)
    declared = (K,)
    absent: ClassVar = {"k": 0.0}
    confused_with = (
        Confusion("feedthrough", "a stuck sine at a high frequency: what passes F alone is filtered by G1 and G2"),
        Confusion("second_play", "a staircase with small steps inside the gap: a tilt moves at the first of them"),
        Confusion("soft_knee", "a staircase with small steps inside the gap: a tilt moves in the middle of it, too"),
        Confusion("plateau_droop", "a staircase with two dwell times: a droop goes on with time, a tilt with v"),
    )
    example: ClassVar = {"k": 0.05}

    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law with a way past its operators."""
        return replace(law, bypass=law.bypass + values[0])

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the share that explains most; the problem is linear in it."""
        best = evidence.proportion(self, "k", 1e-2)
        return [best] if best else []
