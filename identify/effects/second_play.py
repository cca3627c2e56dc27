"""A second gap beside the first: take-up in two stages."""

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

from identify.altered_play import Law
from identify.blocks import Play
from identify.chain import Chain
from identify.effects.effect import Confusion, Effect
from identify.effects.inside_play import InsidePlay, gap_v, mean_slope
from identify.effects.plateau_tilt import PlateauTilt
from identify.stage import Grid, Parameter, Place, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

GAP = Parameter("second_play.gap", "V", "log")
WEIGHT = Parameter("second_play.weight", "V/V", scale=0.1)
TIMES = (0.3, 0.65, 1.3, 1.8)  # the first gap
HARDLY = 0.1  # of the first gap: a second one below this is looked at without
SMALL = 0.03  # weight at which the change is looked at


@final
class SecondPlay(InsidePlay):
    """Part of w taken along by a second play operator around the same middle, with a gap of its own."""

    id = "second_play"
    title = "second gap"
    equation = "w' = (1 - weight) w + weight times w of a gap D_L - D_U = gap with the same middle and slopes"
    sentence = (
        "Part of F has another gap than the rest: {}; w is taken along in two stages, as by two coupled parts with "
        "play of their own or two diode pairs of different drop."
    )
    axis = "level of w"
    fingerprint = "two-stage take-up, minor loops"
    places = (Place.F,)
    declared = (GAP, WEIGHT)
    absent: ClassVar = {"gap": 1.0, "weight": 0.0}
    confused_with = (
        Confusion("soft_knee", "nested minor loops that turn between the two gaps: a knee rounds all alike"),
        Confusion("plateau_tilt", "a staircase with small steps inside the gap: a tilt moves at the first of them"),
        Confusion("dielectric_absorption", "a staircase with two dwell times: a second gap does not ask how long"),
    )
    example: ClassVar = {"gap": 3.6, "weight": 0.12}

    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law with a second operator beside the first."""
        return replace(law, second=(values[0], values[1]))

    def plainer(self, chain: Chain) -> tuple[Effect, dict[str, float]] | None:
        """Return the share of v that passes by, where the second gap is hardly one."""
        if chain.values[GAP.name] > HARDLY * gap_v(chain):
            return None
        return PlateauTilt(Place.F), {PlateauTilt.declared[0].name: mean_slope(chain) * chain.values[WEIGHT.name]}

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the gap, tried below and above the first, that explains most with the weight that suits it."""
        play = evidence.chain.stage_of(Play)
        if play is None:
            return []
        d_l, d_u = (evidence.chain.values[f"F.D_{side}"] for side in "LU")
        small = [{"gap": times * abs(d_l - d_u), "weight": SMALL} for times in TIMES]
        return [evidence.best_share(self, "weight", small)]
