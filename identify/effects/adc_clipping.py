"""The ADC's range ends: what lies beyond is read as its limit."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.effects.effect import Confusion
from identify.effects.limit import Limit
from identify.stage import Parameter, Place
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

UPPER = Parameter("adc_clipping.upper", "V")
LOWER = Parameter("adc_clipping.lower", "V")
DEPTHS = np.geomspace(2e-4, 0.5, 40)  # of the range of the answer, at which a limit is looked for
TRIED = 4  # levels on a side that are simulated, of all that the readings were compared with


@final
class AdcClipping(Limit):
    """The reading limited to [lower, upper]."""

    id = "adc_clipping"
    title = "range of the ADC"
    equation = "y' = min(max(y, lower), upper)"
    sentence = (
        "The reading stops at {}: the ADC, or the amplifier in front of it, has reached the end of its range. Choose a "
        "larger range, or divide the signal down; what lies beyond is lost."
    )
    axis = "level of y"
    fingerprint = "flat at a fixed y"
    places = (Place.SENSE,)
    elsewhere: ClassVar = {Place.F: "saturation"}
    shapeless = True
    declared = (UPPER, LOWER)
    confused_with = (
        Confusion(
            "saturation",
            "a faster sine of the same amplitude: a clipped reading stays flat, a rail at w is rounded by G2",
        ),
        Confusion("input_clipping", "a loopback cable from DAC to ADC: it shows which of the two ranges ends"),
    )
    example: ClassVar = {"upper": 9.1, "lower": -9.9}

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the limits that explain most, one side after the other.

        A limit acts on the answer alone: the levels worth a simulation are read off the residual.
        """
        best: dict[str, float] = {}
        for name, sign in (("upper", 1.0), ("lower", -1.0)):
            if self.form in ("both", name):
                levels = limits(*evidence.compared_v, sign)[:TRIED]
                best = evidence.best(self, [{**best, name: level} for level in levels]) or best
        return [best] if len(best) == len(self.parameters()) else []


def limits(answer_v: Array, residual_v: Array, sign: float) -> list[float]:
    """Return levels, V, at which readings may be cut off, above (sign 1) or below (-1), the likeliest first.

    With x the answer and r the residual beyond a level L, the sum of squares would fall by minus the sum of
    (x - L) (2 r + x - L) if the answer stopped there; the plain parameters are taken to stay.
    """
    order = np.argsort(-sign * answer_v)
    x, r = sign * answer_v[order], sign * residual_v[order]
    levels = x[0] - DEPTHS * (x[0] - x[-1])
    counts = np.searchsorted(-x, -levels)
    gains = [-float(np.sum((x[:n] - at) * (2.0 * r[:n] + x[:n] - at))) for at, n in zip(levels, counts, strict=True)]
    return [sign * float(levels[i]) for i in np.argsort(gains)[::-1]]
