"""A stage that cannot move faster than so many volts a second."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify import kernels
from identify.effects.effect import Confusion, Effect
from identify.stage import Block, Grid, Parameter, Place, Ramp, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

RATE = Parameter("slew_limit.rate", "V/s", "log")
SHARES = (0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.97)  # of the fastest rate of w: a limit may only just be met


@final
class SlewLimit(Effect):
    """w followed at no more than a rate, the same up and down, by the amplifier that puts F out."""

    id = "slew_limit"
    title = "slew limit"
    equation = "w' follows w, |dw'/dt| <= rate"
    sentence = (
        "The output of F moves no faster than {}: an amplifier there runs into its slew rate; drive it with smaller or "
        "slower steps, or take a faster one or a smaller capacitor."
    )
    axis = "rate of w"
    fingerprint = "straight edges of fixed slope"
    quick = True
    places = (Place.F,)
    declared = (RATE,)
    absent: ClassVar = {"rate": float("inf")}
    confused_with = (
        Confusion("extra_pole", "steps of two sizes: a pole rounds both alike, a slew limit spares the small one"),
        Confusion("rate_dependent_gap", "sines of one frequency and rising amplitude: a limit begins at one rate"),
        Confusion("saturation", "a slow sine of the same amplitude: a rail is met there too, a slew limit is not"),
    )
    example: ClassVar = {"rate": 900.0}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running follower, at rest; what it follows by leaps it follows in straight lines."""
        most, level = values[0] * grid.step_s, 0.0

        def run(block: Block) -> Array:
            nonlocal level
            out = np.empty_like(block.signal)
            level = kernels.slewed(most, level, block.signal, out)
            return out

        return run, Ramp() if np.isfinite(most) else shape

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the limit, tried at shares of the fastest rate of w, that explains most."""
        top = evidence.rates(Place.F)[-1]
        best = evidence.best(self, [{"rate": share * top} for share in SHARES])
        return [best] if best else []
