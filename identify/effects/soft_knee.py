"""Contact that is not made at one point: the take-up is rounded."""

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

from identify.altered_play import Law
from identify.effects.effect import Confusion
from identify.effects.inside_play import InsidePlay, gap_v
from identify.stage import Grid, Parameter, Place, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

WIDTH = Parameter("soft_knee.width", "V", "log")
TRIED = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0)  # of the gap


@final
class SoftKnee(InsidePlay):
    """Contact made evenly over a stretch of v: many plays side by side whose crossings D_L, D_U are spread over it.

    After a turn w follows a parabola until all of them have taken hold. It stays where v stays, at every rate.
    """

    id = "soft_knee"
    title = "rounded take-up"
    equation = "w = mean of the plays with D_L + d and D_U - d, d even from -width / 2 to width / 2"
    sentence = (
        "F does not take hold at one point but gradually over {} of v: a soft contact, teeth that meet one after the "
        "other, or diodes that begin to conduct before they fully do."
    )
    axis = "level of w"
    fingerprint = "rounded take-up at contact, at any rate"
    quick = True
    places = (Place.F,)
    declared = (WIDTH,)
    absent: ClassVar = {"width": 0.0}
    confused_with = (
        Confusion("gain_drift", "a repeat later in time: a knee is the same then, a drifting gain is not"),
        Confusion("second_play", "nested minor loops that turn between two gaps: a knee rounds all alike"),
        Confusion("plateau_tilt", "a staircase with small steps inside the gap: a tilt moves in the middle of it, too"),
        Confusion("rate_dependent_gap", "a sine at a tenth of the frequency: a knee is as round there"),
    )
    example: ClassVar = {"width": 0.6}

    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law whose contact is spread."""
        return replace(law, spread_v=values[0])

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the width, tried from a thousandth of the gap up, that explains most."""
        wide_v = gap_v(evidence.chain)
        best = evidence.best(self, [{"width": share * wide_v} for share in TRIED] if wide_v else [])
        return [best] if best else []
