"""The generator itself is slow: a low-pass before everything else."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.blocks import run_filter
from identify.chain import Chain
from identify.effects.effect import Confusion, Effect
from identify.lags import as_drawn
from identify.stage import Grid, Parameter, Place, Run, Shape, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

TAU = Parameter("source_pole.tau", "s", "log")


@final
class SourcePole(Effect):
    """A first-order lag of the source: a reconstruction filter, an output amplifier, a cable into a resistor.

    It runs right behind G1, with which it commutes: a lag of a held level is neither held nor straight between
    instants, a lag of what leaves G1 is.
    """

    id = "source_pole"
    title = "pole of the source"
    equation = "u' = u / (1 + s tau)"
    sentence = (
        "The generator's output follows its commands only slowly: {}. A reconstruction filter or a cable's capacitance "
        "does that; measure u at the input of the circuit, or put the pole into G1."
    )
    axis = "frequency"
    fingerprint = "rounding of every edge"
    quick = True
    linear = True
    places = (Place.SOURCE,)
    declared = (TAU,)
    absent: ClassVar = {"tau": 0.0}
    confused_with = (
        Confusion(
            "extra_pole", "nothing played through the rig: a loopback cable from DAC to ADC shows the source alone",
            exact=True, there=Place.G1,
        ),
        Confusion("extra_pole", "two amplitudes at one frequency: behind F a pole meets harmonics", there=Place.G2),
        Confusion("dead_time", "sines at higher frequency: a delay leaves the amplitude alone"),
        Confusion("resonance", "steps watched at a higher sample rate: a pole alone does not overshoot"),
    )
    example: ClassVar = {"tau": 0.9e-3}

    @property
    def shows_at(self) -> Place:
        """Return G1: it runs behind it."""
        return Place.G1

    def put_in(self, chain: Chain, values: Mapping[str, float]) -> Chain:
        """Return ``chain`` with this lag right behind G1."""
        return chain.with_stage_behind("G1", replace(self, place=Place.G1), self.named(values)).crediting(self)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running lag."""
        den = (values[0], 1.0) if values[0] > 0.0 else (1.0,)
        return run_filter((1.0,), den, grid, shape)

    def upright(self, chain: Chain) -> Chain:
        """Return ``chain`` with the lag that is not drawn, and G1, with which it commutes, as the rig file has it."""
        return as_drawn(chain, Place.G1, TAU.name)

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the time constant, tried from a sample to a thousand, or a small one, that explains most."""
        return self.timed(evidence, "tau", np.geomspace(1.0, 1e3, 5).tolist())
