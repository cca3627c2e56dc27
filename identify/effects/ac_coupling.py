"""A capacitor in front of the ADC: what stands still is forgotten."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.blocks import run_linear
from identify.discretise import stepper
from identify.effects.effect import Confusion, Effect
from identify.stage import Block, Grid, Held, Parameter, Place, Ramp, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

T = Parameter("ac_coupling.T", "s", "log")
SHORTEST_SAMPLES = 30
GRID = 7  # time constants tried


@final
class AcCoupling(Effect):
    """A high-pass of first order on the reading, settled before every run."""

    id = "ac_coupling"
    title = "AC coupling of the input"
    equation = "y' = s / (s + 1/T) y"
    sentence = (
        "The input of the ADC is AC coupled, or the sensor cannot hold a level: a level is forgotten with {}. Switch "
        "the input to DC, or use a larger coupling capacitor."
    )
    axis = "frequency"
    fingerprint = "plateaus decay to the mean, wherever they are and however they were reached"
    linear = True
    places = (Place.SENSE,)
    declared = (T,)
    absent: ClassVar = {"T": float("inf")}
    confused_with = (
        Confusion("plateau_droop", "a staircase that moves along a border only: a leak shows on plateaus alone"),
        Confusion("input_ac_coupling", "a sine too small to move F: in front of F a sag may cross the gap back"),
        Confusion("dielectric_absorption", "one long dwell: creep comes to rest at a level, AC coupling at zero"),
    )
    example: ClassVar = {"T": 11.0}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the high-pass at work, settled on the first level it sees."""
        (t,) = values
        if not np.isfinite(t):
            return (lambda block: block.signal), shape
        if isinstance(shape, Held):
            step = stepper((t, 0.0), (t, 1.0), grid.step_s, "held", shape.fraction)
        else:
            step = stepper((t, 0.0), (t, 1.0), grid.step_s, "ramp")
        high_pass, rest = run_linear(step), None

        def run(block: Block) -> Array:
            nonlocal rest
            rest = float(block.signal[0]) if rest is None else rest
            above = Block(block.signal - rest, block.source, block.first, block.grid)
            return high_pass(above)

        return run, Ramp()

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the time constant, tried from some samples to ten runs, that explains most; or a longer one.

        Where it is long against a run, the change is in proportion to 1/T.
        """
        tried = np.geomspace(SHORTEST_SAMPLES * evidence.sample_s, 10.0 * evidence.longest_s, GRID)
        best = evidence.best(self, [{"T": float(t)} for t in tried])
        scale = evidence.scaled(self, {"T": float(tried[-1])})
        return [best, *([{"T": float(tried[-1]) / scale}] if scale > 0.0 else [])] if best else []
