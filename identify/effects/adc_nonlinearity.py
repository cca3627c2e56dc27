"""A bent scale of the ADC, or of the amplifier in front of it."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.effects.effect import Confusion, Effect, short
from identify.stage import Grid, Parameter, Place, Run, Shape, Values, memoryless

if TYPE_CHECKING:
    from identify.evidence import Evidence

K2 = Parameter("adc_nonlinearity.k2", "1/V", scale=1e-3)
K3 = Parameter("adc_nonlinearity.k3", "1/V^2", scale=1e-4)
LAWS = {"square and cube": (K2, K3), "square": (K2,), "cube": (K3,)}
SMALL = {"k2": 1e-4, "k3": 1e-5}  # at which the change is well above rounding


@final
class AdcNonlinearity(Effect):
    """A reading bent by its own level: the square is another gain on either side, the cube compression at both ends."""

    id = "adc_nonlinearity"
    title = "bent scale of the ADC"
    equation = "y' = y + k2 y^2 + k3 y^3"
    sentence = (
        "The scale of the reading is bent: {}. It is the ADC or the amplifier in front of it; calibrate it with a "
        "voltmeter at a few levels, or keep the reading small."
    )
    axis = "level of y"
    fingerprint = "depends on y only, at any frequency"
    places = (Place.SENSE,)
    elsewhere: ClassVar = {Place.F: "curved_border"}
    forms = tuple(LAWS)
    declared = (K2, K3)
    absent: ClassVar = {"k2": 0.0, "k3": 0.0}
    confused_with = (
        Confusion("curved_border", "a faster sine of the same amplitude: a border sees w, not what G2 leaves of it"),
        Confusion("soft_saturation", "a faster sine of the same amplitude: a law at w sees what G2 has not smoothed"),
        Confusion("source_nonlinearity", "a loopback cable from DAC to ADC played at two amplitudes"),
    )
    example: ClassVar = {"k2": 4.1e-4, "k3": 2.3e-5}

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the coefficients of the form."""
        return LAWS[self.form]

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the bend at work."""
        given = dict(zip(map(short, (p.name for p in self.parameters())), values, strict=True))
        k2, k3 = given.get("k2", 0.0), given.get("k3", 0.0)
        return memoryless(lambda y: np.asarray(y * (1.0 + y * (k2 + k3 * y))), shape)

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the coefficients that explain most; the problem is linear in them."""
        best = evidence.proportions(self, {short(p.name): SMALL[short(p.name)] for p in self.parameters()})
        return [best] if best else []
