"""A diode across the signal: behind F the level stops softly at the diode's own voltage."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify import diode
from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values, memoryless
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

N_VT = Parameter("diode_clamp.n_vt", "V", "log", label="n V_T")
KNEE = Parameter("diode_clamp.knee", "V", "log")
SLOPE = Parameter("diode_clamp.slope", "V/V", scale=0.1, least=0.0, most=0.97)
SAME = "only larger levels, where the shapes part: a law right behind F and borders bent alike are the same data"
KNEES = np.geomspace(0.02, 3.0, 36)  # of the range of w on the side of the diode: only its first current may be seen
SOFTNESS = np.geomspace(0.003, 0.5, 14)  # n V_T over the knee: 26 mV in 0.6 V, or a diode hardly more than bent
SLOPES = (0.03, 0.1, 0.3)
SHARPEST = 5e-4  # n V_T over the knee that the law approaches as n V_T falls: a rail, reached without losing all slope


@final
class DiodeClamp(Effect):
    """w loaded by a shunt diode through the resistance R it comes from; Shockley's law, solved for the level.

    At the knee the diode conducts as well as R does: R I_s = n_vt exp(-knee / n_vt). A resistor in series with the
    diode leaves a slope beyond it: its share of the two, which then stand for R together.
    """

    id = "diode_clamp"
    title = "diode across the signal"
    equation = (
        "w' = (1 - slope) x + slope w, where x + R I_s (exp(x / n_vt) - 1) = w and R I_s = n_vt exp(-knee / n_vt); "
        "slope 0 without a resistor in series; lower: the same of -w; both: a diode of either polarity"
    )
    sentence = (
        "A diode in F, a protection diode to a rail or a clamp to ground, conducts at large levels and stops w softly: "
        "{}. One across the capacitor of G2, or a varistor, does nearly the same where G2 is quick. Remove it, or keep "
        "w well below the knee."
    )
    axis = "level of w"
    fingerprint = "exponential knee of fixed voltage, one small slope beyond it"
    places = (Place.F,)
    elsewhere: ClassVar = {Place.SENSE: "adc_nonlinearity"}
    forms = ("upper", "lower", "both", "upper, resistor", "lower, resistor", "both, resistor")
    declared = (KNEE, N_VT, SLOPE)
    absent: ClassVar = {"knee": 1e9, "n_vt": 1e6, "slope": 0.0}
    confused_with = (
        Confusion("soft_saturation", "a staircase with small steps through the knee: a diode has n V_T at every level"),
        Confusion("saturation", "a staircase with small steps through the knee: a rail has no width"),
        Confusion("curved_border", SAME),
        Confusion(
            "adc_nonlinearity",
            "a faster sine of the same amplitude: a law at y does not see w but what G2 leaves of it",
        ),
    )
    example: ClassVar = {"knee": 9.0, "n_vt": 0.9, "slope": 0.1}

    @property
    def side(self) -> str:
        """Return the side of w at which the diode conducts."""
        return self.form.partition(",")[0]

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the diode's numbers, and the slope that a resistor in series leaves."""
        return self.declared if self.form.endswith("resistor") else (KNEE, N_VT)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the diode at work on the sides the form names."""
        return memoryless(lambda w: self.law(w, *values), shape)

    def law(self, w: Array, knee: float, n_vt: float, slope: float = 0.0) -> Array:
        """Return the level behind the diode, V."""
        x, sharpest = np.empty_like(w), SHARPEST * knee
        n_vt += sharpest * np.exp(-n_vt / sharpest)
        diode.clamped(knee / n_vt, self.side != "lower", self.side != "upper", w / n_vt, x)
        return np.asarray((1.0 - slope) * n_vt * x + slope * w)

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the knee and the softness that the map of the level asks for, and then the slope."""
        low, high = evidence.range(Place.F)
        top = {"upper": high, "lower": -low}.get(self.side, max(high, -low))
        options = [{"knee": top * at, "n_vt": top * at * soft} for at in KNEES for soft in SOFTNESS if top > 0.0]
        levels = evidence.levels(Place.F)
        best = levels.best(lambda w, values: self.law(w, **values), options)
        if best and SLOPE in self.parameters():  # it makes all of the change smaller
            best = levels.best(lambda w, values: self.law(w, **values), [{**best, "slope": slope} for slope in SLOPES])
        return [best] if best else []
