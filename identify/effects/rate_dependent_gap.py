"""A gap that is wider the faster it is crossed."""

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

from identify.altered_play import Law
from identify.effects.effect import Confusion
from identify.effects.inside_play import InsidePlay
from identify.stage import Grid, Parameter, Place, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

TRIED = (0.25, 1.0, 4.0, 16.0)  # samples
K = Parameter("rate_dependent_gap.k", "s", "log")


@final
class RateDependentGap(InsidePlay):
    """Contact on either border made later by a time's worth of the speed of v."""

    id = "rate_dependent_gap"
    title = "gap that widens with speed"
    equation = "D_L' = D_L + k |dv/dt|, D_U' = D_U - k |dv/dt|"
    sentence = (
        "The gap widens with the speed of v, by {} of it on either side: the amplifier that was blocked has to leave "
        "its rail before it takes w along; keep it out of saturation or take a faster one."
    )
    axis = "rate of w"
    fingerprint = "later contact when faster; nearly a delay"
    quick = True
    places = (Place.F,)
    declared = (K,)
    absent: ClassVar = {"k": 0.0}
    confused_with = (
        Confusion("dead_time", "two amplitudes at one frequency, and a sine of rising amplitude: a delay stays"),
        Confusion("extra_pole", "two amplitudes at one frequency: a pole does not ask how fast v is"),
        Confusion("slew_limit", "sines of one frequency and rising amplitude: a slew limit begins at one rate"),
    )
    example: ClassVar = {"k": 1.5e-4}

    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law whose borders speed pushes apart."""
        return replace(law, late_s=law.late_s + values[0])

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the time that explains most: of those tried, and of the one to which the smallest change points.

        Nearly a delay, it moves what the plain model has fitted far, and small changes may point the wrong way.
        """
        return self.timed(evidence, "k", TRIED)
