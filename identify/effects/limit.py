"""What do all limits of a level have in common, wherever they stand: at the source, behind F, at the ADC?"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from identify.effects.effect import Effect
from identify.stage import Grid, Parameter, Run, Shape, Values, memoryless


@dataclass(frozen=True)
class Limit(Effect):
    """A level limited to [lower, upper]; a form may have one of the two limits. Declared are upper and lower."""

    forms: ClassVar[tuple[str, ...]] = ("both", "upper", "lower")
    absent: ClassVar = {"upper": float("inf"), "lower": float("-inf")}

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the limits the form has."""
        upper, lower = self.declared
        return {"both": (upper, lower), "upper": (upper,), "lower": (lower,)}[self.form]

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the limit at work."""
        upper = values[0] if self.form != "lower" else float("inf")
        lower = values[-1] if self.form != "upper" else float("-inf")
        return memoryless(lambda level: np.clip(level, lower, upper), shape)
