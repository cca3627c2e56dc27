"""Two slopes where the rig file promises one."""

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

from identify.altered_play import Law
from identify.chain import Chain
from identify.effects.effect import Confusion
from identify.effects.inside_play import InsidePlay
from identify.stage import Grid, Parameter, Place, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

RATIO = Parameter("unequal_slopes.ratio", "V/V", scale=0.1)
SMALL = 0.01


@final
class UnequalSlopes(InsidePlay):
    """The unloading border steeper or flatter than the loading one, of a play that was to have one slope.

    Only where the rig file gives ``S`` for both borders: where it gives S_L and S_U each is refitted, and their being
    unequal is no missing physics but what the plain model says.
    """

    id = "unequal_slopes"
    title = "unequal slopes"
    equation = "S_U = ratio S_L"
    sentence = (
        "The two borders of the play are not equally steep, S_U / S_L being {}: the halves of the circuit that take w "
        "up and down differ in gain; compare their resistors, or give the rig file S_L and S_U."
    )
    axis = "level of w"
    fingerprint = "even harmonics, mean depends on the amplitude of v"
    places = (Place.F,)
    declared = (RATIO,)
    absent: ClassVar = {"ratio": 1.0}
    confused_with = (
        Confusion("curved_border", "sines of two amplitudes: the ratio of two slopes is the same at both"),
        Confusion("rectifying_sensor", "a sine around another mean: a sensor's sign goes with y, a slope with the way"),
    )
    example: ClassVar = {"ratio": 1.06}

    def applicable(self, chain: Chain) -> bool:
        """Return whether the slopes are promised to be one."""
        return super().applicable(chain) and "F.S_U" in dict(chain.tied)

    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law with the unloading border's own slope."""
        return replace(law, s_u=law.s_u * values[0])

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the ratio that explains most; near one the problem is linear in it."""
        return [{"ratio": 1.0 + SMALL * evidence.scaled(self, {"ratio": 1.0 + SMALL})}]
