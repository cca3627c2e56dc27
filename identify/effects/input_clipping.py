"""The generator cannot reach the levels it is told to."""

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values, memoryless

if TYPE_CHECKING:
    from identify.evidence import Evidence

UPPER = Parameter("input_clipping.upper", "V")
LOWER = Parameter("input_clipping.lower", "V")
DEPTHS = (2e-3, 1e-2, 4e-2, 0.12, 0.3, 0.55)  # of the range of u, cut off: few samples may be touched, or most
CLOSER = (0.5, 1.8)  # times the best of those


@final
class InputClipping(Effect):
    """u limited to [lower, upper]: the range of the DAC, the rails of the amplifier behind it."""

    id = "input_clipping"
    title = "clipping of the source"
    equation = "u' = min(max(u, lower), upper)"
    sentence = (
        "The generator does not reach the levels asked for: u stops at {}. Keep the protocol within the range of the "
        "DAC and of the amplifier behind it."
    )
    axis = "level of u"
    fingerprint = "nothing changes above a level of u"
    places = (Place.SOURCE,)
    forms = ("both", "upper", "lower")
    declared = (UPPER, LOWER)
    absent: ClassVar = {"upper": float("inf"), "lower": float("-inf")}
    confused_with = (
        Confusion("saturation", "a slow and a fast sine of the same u: what reaches rails at w, G1 lets pass or not"),
        Confusion("source_nonlinearity", "a staircase of small steps up to the top: a clip leaves low levels alone"),
        Confusion("adc_clipping", "a fast sine of the same u: a clipped reading is flat, a clipped source is rounded"),
    )  # fmt: skip
    example: ClassVar = {"upper": 2.7, "lower": -2.6}

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the limits the form has."""
        return {"both": (UPPER, LOWER), "upper": (UPPER,), "lower": (LOWER,)}[self.form]

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the clip at work."""
        upper = values[0] if self.form != "lower" else float("inf")
        lower = values[-1] if self.form != "upper" else float("-inf")
        return memoryless(lambda u: np.clip(u, lower, upper), shape)

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the limits, tried at levels inside the range of u, that explain most; each side on its own."""
        low, high = evidence.range(Place.SOURCE)
        best: dict[str, float] = {}
        for name, end in (("upper", high), ("lower", low)):
            if self.form in ("both", name):
                best |= self._side(evidence, name, end)
        return [best] if len(best) == len(self.parameters()) else []

    def _side(self, evidence: "Evidence", name: str, end: float) -> dict[str, float]:
        """Return the limit of one side that explains most; what both forms ask is computed once."""
        if end == 0.0:
            return {}
        alone = replace(self, form=name)
        best = evidence.best(alone, [{name: (1.0 - depth) * end} for depth in DEPTHS])
        depth = 1.0 - best[name] / end if best else 0.0
        closer = [{name: (1.0 - share * depth) * end} for share in CLOSER]
        return evidence.best(alone, [best, *closer]) if best else {}
