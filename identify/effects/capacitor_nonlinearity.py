"""A capacitor of a filter that is not the same at every voltage."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify import charging
from identify.effects.effect import Confusion, Effect
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

K = Parameter("capacitor_nonlinearity.k", "1/V^2", scale=1e-3)
TAU = Parameter("capacitor_nonlinearity.tau", "s", "log")
SMALL = 1e-5  # 1/V^2: the change is looked at where it is proportional, well above rounding
TAUS = np.geomspace(0.3, 3e3, 9)  # samples


@final
class CapacitorNonlinearity(Effect):
    """A capacitor C (1 - k s^2) in a first-order low-pass of G1 or G2: a class-2 ceramic, k > 0, a junction.

    ``tau`` tells which: it is the time constant that the capacitor makes at small levels.
    """

    id = "capacitor_nonlinearity"
    title = "capacitor that depends on its voltage"
    equation = "C (1 - k s'^2) in a low-pass of tau: tau (1 - k s'^2) ds'/dt + s' = tau ds/dt + s"
    sentence = (
        "A capacitor of a filter is smaller or larger at higher voltage: {}. The one that makes this time constant is "
        "a class-2 ceramic or a junction: use C0G or film."
    )
    axis = "level of v"
    fingerprint = "edges faster or slower at high levels; at rest no level is wrong"
    places = (Place.G1, Place.G2)
    declared = (K, TAU)
    absent: ClassVar = {"k": 0.0, "tau": 1.0}
    confused_with = (
        Confusion("source_nonlinearity", "a staircase watched until it rests: a bent source is wrong there, too"),
        Confusion("curved_border", "a staircase watched until it rests: a capacitor shows on the way only"),
        Confusion("adc_nonlinearity", "a staircase watched until it rests: a bent scale is wrong there, too"),
        Confusion("slew_limit", "two amplitudes at one frequency: slewing sets in above a rate, this grows evenly"),
        Confusion("extra_pole", "two amplitudes at one frequency: a pole does the same to both"),
    )
    example: ClassVar = {"k": 0.02, "tau": 4e-3}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running filter, without charge."""
        k, tau = values[0], values[1] / grid.step_s
        state = (0.0, 0.0)

        def run(block: Block) -> Array:
            nonlocal state
            if k == 0.0:
                return block.signal
            out = np.empty_like(block.signal)
            state = charging.charged(k, tau, state, block.signal, out)
            return out

        return run, shape

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the time constant that explains most with the law that suits it, taken as proportional."""
        small = [{"k": SMALL, "tau": float(count) * evidence.sample_s} for count in TAUS]
        sized = [{**values, "k": SMALL * evidence.scaled(self, values)} for values in small]
        best = evidence.best(self, [values for values in sized if values["k"]])
        return [best] if best else []
