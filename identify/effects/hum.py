"""The mains: lines at 50 or 60 Hz and odd harmonics, phase free of the stimulus."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify import kernels
from identify.chain import Chain
from identify.effects.effect import Confusion, Effect
from identify.mains import mains_lines
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

MAINS_HZ = (50.0, 60.0)
HARMONICS = (1, 3, 5)
FREQUENCY = Parameter("hum.frequency", "Hz", scale=0.01)
AMPLITUDES = (
    Parameter("hum.amplitude", "V", scale=0.1),
    Parameter("hum.third", "V", scale=0.1),
    Parameter("hum.fifth", "V", scale=0.1),
)
SHAPE = (Parameter("hum.third_phase", "rad"), Parameter("hum.fifth_phase", "rad"))
PHASE = Parameter("hum.phase", "rad", local=True)


@final
class Hum(Effect):
    """Mains lines added to v (where the gap rectifies them) or to the reading.

    The waveform is the same in every run; where in its period a run starts is the run's own.
    """

    id = "hum"
    title = "mains hum"
    equation = "s' = s + sum over n = 1, 3, 5 of a_n sin(n (2 pi f t + phase) + phase_n), phase free in every run"
    sentence = "The mains is picked up: {}."
    axis = "mains lines"
    fingerprint = "a line whose phase is free of the stimulus; at v the gap rectifies it"
    places = (Place.SENSE, Place.G1)
    declared = (FREQUENCY, *AMPLITUDES, *SHAPE, PHASE)
    absent: ClassVar = {
        "frequency": 50.0, "amplitude": 0.0, "third": 0.0, "fifth": 0.0,
        "third_phase": 0.0, "fifth_phase": 0.0,
        "phase": 0.0,
    }  # fmt: skip
    confused_with = (Confusion("feedthrough", "a stimulus that is no multiple of the mains frequency"),)
    example: ClassVar = {"frequency": 50.02, "amplitude": 0.03, "third": 0.012, "fifth": 0.006}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the addition at work; time runs from the start of the run, so that phases belong to it."""
        frequency, amplitudes, angles, phase = values[0], values[1:4], (0.0, *values[4:6]), values[6]

        def run(block: Block) -> Array:
            if not any(amplitudes):
                return block.signal
            out = block.signal.copy()
            turn = 2.0 * np.pi * frequency * grid.step_s
            kernels.waveform(turn * block.first + phase, turn, HARMONICS, amplitudes, angles, out)
            return out

        return run, shape

    def upright(self, chain: Chain) -> Chain:
        """Return ``chain`` with no amplitude below zero: a line upside down is one half a turn away."""
        values = dict(chain.values)
        for name in ("amplitude", "third", "fifth"):
            if values[f"hum.{name}"] < 0.0:
                values[f"hum.{name}"] *= -1.0
                turned = {"amplitude": ("phase", "third_phase", "fifth_phase")}.get(name, (f"{name}_phase",))
                for key in values:
                    if key.partition("[")[0] in {f"hum.{angle}" for angle in turned}:
                        values[key] += np.pi
        return chain.with_values(values) if values != chain.values else chain

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the lines of the residual; at v they stand where the plain path would have passed them on."""
        return [mains_lines(evidence, self, f, HARMONICS) for f in MAINS_HZ]
