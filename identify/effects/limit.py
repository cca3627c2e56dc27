"""What do all limits of a level have in common, wherever they stand: at the source, behind F, at the ADC?"""

from dataclasses import dataclass
from math import isfinite
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from identify.chain import Chain
from identify.effects.effect import Effect
from identify.stage import Grid, Parameter, Run, Shape, Values, memoryless

if TYPE_CHECKING:
    from identify.evidence import Evidence

REACHED = np.geomspace(1e-5, 0.02, 8)  # of the range of the level, cut off by a limit that was not there


@dataclass(frozen=True)
class Limit(Effect):
    """A level limited to [lower, upper]; a form may have one of the two limits. Declared are upper and lower."""

    forms: ClassVar[tuple[str, ...]] = ("both", "upper", "lower")
    absent: ClassVar = {"upper": float("inf"), "lower": float("-inf")}

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the limits the form has."""
        upper, lower = self.declared
        return {"both": (upper, lower), "upper": (upper,), "lower": (lower,)}[self.form]

    def completed(self, chain: Chain, evidence: "Evidence") -> Chain:
        """Return ``chain`` with a limit that is missing where it explains most: one beyond the level shows no slope."""
        low, high = evidence.range(self.place)
        upper, lower = self.declared
        at = {upper.name: high - REACHED * (high - low), lower.name: low + REACHED * (high - low)}
        for name in (p.name for p in self.parameters() if not isfinite(chain.values[p.name])):
            options = [chain.with_values({name: level}) for level in at[name].tolist()]
            chain = min(options, key=lambda option: evidence.left_by(evidence.residual - evidence.change(option)))
        return chain

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the limit at work."""
        upper = values[0] if self.form != "lower" else float("inf")
        lower = values[-1] if self.form != "upper" else float("-inf")
        return memoryless(lambda level: np.clip(level, lower, upper), shape)
