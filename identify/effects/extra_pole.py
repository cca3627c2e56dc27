"""One more low-pass that the drawing does not show."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.blocks import run_filter
from identify.chain import Chain
from identify.effects.effect import Confusion, Effect
from identify.lags import as_drawn
from identify.stage import Grid, Parameter, Place, Run, Shape, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

TAU = Parameter("extra_pole.tau", "s", "log")


@final
class ExtraPole(Effect):
    """A first-order lag beside G1 or beside G2: a filter capacitor, a slow amplifier."""

    id = "extra_pole"
    title = "one more pole"
    equation = "v' = v / (1 + s tau) behind G1, or x' = x / (1 + s tau) behind G2"
    sentence = "There is one more low-pass than drawn: {}."
    axis = "frequency"
    fingerprint = "slower edges, phase growing with frequency"
    quick = True
    linear = True
    places = (Place.G1, Place.G2)
    declared = (TAU,)
    absent: ClassVar = {"tau": 0.0}
    confused_with = (
        Confusion(
            "source_pole", "nothing played through the rig: a loopback cable from DAC to ADC shows the source alone",
            exact=True, here=Place.G1,
        ),
        Confusion("source_pole", "two amplitudes at one frequency: behind F a pole meets harmonics", here=Place.G2),
        Confusion("resonance", "steps watched at a higher sample rate: a pole alone does not overshoot"),
        Confusion("dead_time", "sines at higher frequency: a delay leaves the amplitude alone"),
        Confusion("rate_dependent_gap", "two amplitudes at one frequency"),
    )
    example: ClassVar = {"tau": 1.1e-3}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running lag."""
        den = (values[0], 1.0) if values[0] > 0.0 else (1.0,)
        return run_filter((1.0,), den, grid, shape)

    def upright(self, chain: Chain) -> Chain:
        """Return ``chain`` with the lag that is not drawn, and the block beside it as the rig file has it."""
        return as_drawn(chain, self.place, self.called(TAU))

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the time constant, tried from a tenth of a sample to 3,000, that explains most."""
        return self.timed(evidence, "tau", np.geomspace(0.1, 3e3, 8).tolist())
