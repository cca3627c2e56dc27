"""A soft limit: the output of F is compressed well before it stops."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify import diode
from identify.chain import Chain
from identify.effects.diode_clamp import KNEE as DIODE_KNEE
from identify.effects.diode_clamp import N_VT, DiodeClamp
from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values, memoryless
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

LEVEL = Parameter("soft_saturation.level", "V", "log")
KNEE = Parameter("soft_saturation.knee", "V", "log")
FARTHEST = 1e3  # times the range of w: the tanh of that misses a line by less than 1e-6 of it
KNEES = np.geomspace(0.1, 3.0, 20)  # of the range of w: where a diode conducts
WIDTHS = (0.01, 0.03, 0.1, 0.3)  # of the range of w: of its knee
SLOPES = (0.0, 0.3, 0.6, 0.85)  # that it leaves
SLOPE = Parameter("soft_saturation.slope", "V/V", scale=0.1, least=0.0, most=0.97)


@final
class SoftSaturation(Effect):
    """w compressed towards a level: as tanh, or as a diode whose knee has a width and leaves a slope behind it."""

    id = "soft_saturation"
    title = "soft compression"
    equation = (
        "tanh: w' = level tanh(w / level), on the sides named; diode (upper): w' = w - (1 - slope) knee "
        "(ln(1 + exp((w - level) / knee)) - ln(1 + exp(-level / knee))), lower: the same of -w"
    )
    sentence = "Something in F compresses large levels smoothly, as a diode or an overdriven stage does: {}."
    axis = "level of w"
    fingerprint = "compression before a level, the same at every frequency"
    places = (Place.F,)
    elsewhere: ClassVar = {Place.SENSE: "adc_nonlinearity"}
    forms = ("tanh both", "tanh upper", "tanh lower", "diode upper", "diode lower")
    declared = (LEVEL, KNEE, SLOPE)
    absent: ClassVar = {"level": 1e9, "knee": 1.0, "slope": 0.0}
    confused_with = (
        Confusion(
            "curved_border",
            "only larger levels, where the shapes part: a law right behind F and borders bent alike are the same data",
        ),
        Confusion("diode_clamp", "a staircase with small steps through the knee: a diode has n V_T at every level"),
        Confusion(
            "adc_nonlinearity",
            "a faster sine of the same amplitude: a law at y does not see w but what G2 leaves of it",
        ),
    )
    example: ClassVar = {"level": 16.0, "knee": 1.2, "slope": 0.2}

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters of the form's law."""
        return (LEVEL,) if self.form.startswith("tanh") else (LEVEL, KNEE, SLOPE)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the law at work on the sides the form names."""
        return memoryless(lambda w: self.law(w, *values), shape)

    def law(self, w: Array, level: float, knee: float = 1.0, slope: float = 0.0) -> Array:
        """Return the compressed level, V."""
        law, _, side = self.form.partition(" ")
        if side == "both":
            return _tanh(w, level)
        sign = 1.0 if side == "upper" else -1.0
        if law == "diode":
            return sign * _diode(sign * w, level, knee, slope)
        return np.where(sign * w > 0.0, _tanh(w, level), w)

    def plainer(self, chain: Chain) -> tuple[Effect, dict[str, float]] | None:
        """Return the diode that a compression with a knee is nearly."""
        law, _, side = self.form.partition(" ")
        if law != "diode":
            return None
        own = {DIODE_KNEE.name: LEVEL.name, N_VT.name: KNEE.name}
        return DiodeClamp(Place.F, side), {name: chain.values[mine] for name, mine in own.items()}

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the level, up to where it hardly bends, the knee and the slope that its map asks for."""
        low, high = evidence.range(Place.F)
        top = max(-low, high) if self.form.endswith("both") else high if self.form.endswith("upper") else -low
        if top <= 0.0:
            return []
        options = [{"level": top * share} for share in np.geomspace(0.1, FARTHEST, 45)]
        if self.form.startswith("diode"):
            options = [
                {"level": top * share, "knee": top * knee, "slope": slope}
                for share in KNEES for knee in WIDTHS for slope in SLOPES
            ]  # fmt: skip
        best = evidence.levels(Place.F).best(lambda w, values: self.law(w, **values), options)
        return [best] if best else []


def _tanh(w: Array, level: float) -> Array:
    """Return w compressed towards +-level."""
    return np.asarray(level * np.tanh(w / level))


def _diode(w: Array, level: float, knee: float, slope: float) -> Array:
    """Return w whose slope falls from one to ``slope`` around ``level``, within a few ``knee``; zero stays zero."""
    out = np.empty_like(w)
    diode.softened(level / knee, slope, w / knee, out)
    return knee * out
