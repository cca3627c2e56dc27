"""Borders that are no straight lines: the slope of F depends on the level."""

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

from identify.altered_play import Law
from identify.effects.effect import Confusion
from identify.effects.inside_play import InsidePlay
from identify.stage import Grid, Parameter, Place, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

K2 = Parameter("curved_border.k2", "1/V", scale=0.1)
K3 = Parameter("curved_border.k3", "1/V^2", scale=0.03)
SAME = "only larger levels, where the shapes part: a law right behind F and borders bent alike are the same data"
LAWS = {"square and cube": (K2, K3), "cube": (K3,), "square": (K2,)}
SMALL = {"k2": 1e-3, "k3": 3e-4}


@final
class CurvedBorder(InsidePlay):
    """Both borders bent alike, each counted from its own crossing of the v axis."""

    id = "curved_border"
    title = "bent borders"
    equation = "border L: w = S_L x + k2 x^2 + k3 x^3 with x = v - D_L; border U the same with S_U and D_U"
    sentence = (
        "The borders of the play are bent, so that its slope depends on the level: {}. The gain of F changes with the "
        "signal, as that of a weakly driven transistor, a loaded converter or a crooked lever does."
    )
    axis = "level of w"
    fingerprint = "slope depends on the level, on both borders; k2 gives even harmonics"
    places = (Place.F,)
    forms = ("square and cube", "cube", "square")
    declared = (K2, K3)
    absent: ClassVar = {"k2": 0.0, "k3": 0.0}
    confused_with = (
        Confusion("soft_saturation", SAME),
        Confusion("diode_clamp", SAME),
        Confusion(
            "adc_nonlinearity",
            "a faster sine of the same amplitude: a law at y does not see w but what G2 leaves of it",
        ),
        Confusion("unequal_slopes", "sines of two amplitudes: the ratio of two slopes is the same at both"),
    )
    example: ClassVar = {"k2": 0.11, "k3": -0.03}

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the coefficients the form has."""
        return LAWS[self.form]

    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law with its borders bent."""
        given = {p.name: value for p, value in zip(self.parameters(), values, strict=True)}
        return replace(law, bend=(given.get(K2.name, 0.0), given.get(K3.name, 0.0)))

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the coefficients that explain most; the answer is nearly linear in them."""
        names = [p.name.rpartition(".")[2] for p in self.parameters()]
        best = evidence.proportions(self, {name: SMALL[name] for name in names})
        return [best] if best else []
