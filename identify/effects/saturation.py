"""A hard rail: the output of F cannot pass a level."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values, memoryless
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

UPPER = Parameter("saturation.upper", "V")
LOWER = Parameter("saturation.lower", "V")
DEPTHS = np.geomspace(3e-4, 0.7, 24)  # of the range of w, cut off: a rail may only just be met


@final
class Saturation(Effect):
    """w limited to [lower, upper] behind the play operator; a clip and a play commute (physics.md 4)."""

    id = "saturation"
    title = "supply rails"
    equation = "w' = min(max(w, lower), upper)"
    sentence = "An amplifier in F runs into its supply rails: the level of w stops at {}."
    axis = "level of w"
    fingerprint = "flat at a fixed w, at any frequency"
    places = (Place.F,)
    elsewhere = (Place.SENSE,)
    forms = ("both", "upper", "lower")
    declared = (UPPER, LOWER)
    absent: ClassVar = {"upper": float("inf"), "lower": float("-inf")}
    confused_with = (
        Confusion(
            "adc_clipping",
            "a faster sine of the same amplitude: a rail at w is rounded by G2, a clipped reading stays flat",
        ),
        Confusion("soft_saturation", "a staircase with small steps just below the level"),
    )
    example: ClassVar = {"upper": 9.7, "lower": -10.4}

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the limits the form has."""
        return {"both": (UPPER, LOWER), "upper": (UPPER,), "lower": (LOWER,)}[self.form]

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the clip at work."""
        upper = values[0] if self.form != "lower" else float("inf")
        lower = values[-1] if self.form != "upper" else float("-inf")
        return memoryless(lambda w: np.clip(w, lower, upper), shape)

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the limits, tried at levels inside the range of w, that explain most; one side after the other."""
        low, high = evidence.range(Place.F)
        best: dict[str, float] = {}
        for name, end in (("upper", high), ("lower", low)):
            if self.form in ("both", name):
                levels = [(1.0 - depth) * end for depth in DEPTHS] if end else []
                options = [{**best, name: level} for level in levels]
                best = evidence.levels(Place.F).best(_clipped, options) or best
        return [best] if len(best) == len(self.parameters()) else []


def _clipped(w: Array, values: Mapping[str, float]) -> Array:
    """Return w between the limits there are."""
    return np.clip(w, values.get("lower", -np.inf), values.get("upper", np.inf))
