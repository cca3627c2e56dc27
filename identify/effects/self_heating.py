"""A part that its own load warms, and with it the gain changes."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.blocks import run_linear
from identify.chain import Chain
from identify.discretise import stepper
from identify.effects.curved_border import CurvedBorder
from identify.effects.effect import Confusion, Effect
from identify.effects.inside_play import mean_slope
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from collections.abc import Sequence

    from identify.evidence import Evidence
    from identify.observe import Observation

K = Parameter("self_heating.k", "1/V^2", scale=1e-3)
TAU = Parameter("self_heating.tau", "s", "log")
SMALL = 1e-6  # 1/V^2: the change is looked at where it is proportional, well above rounding
TAUS = np.geomspace(30.0, 3e4, 6)  # samples
FASTEST_S = 1e-3  # in which the smallest parts warm: what follows its load sooner bends at once, and is no heat


@final
class SelfHeating(Effect):
    """A gain that follows the power of the recent past: a resistor, a diode or an amplifier that warms under load.

    Every run begins cold.
    """

    id = "self_heating"
    title = "gain that its load warms"
    equation = "s' = s (1 - k T), tau dT/dt + T = s^2"
    sentence = (
        "The gain changes with the load of the recent past: {}. A part warms: use one of more watts or a smaller "
        "temperature coefficient, or less voltage across it."
    )
    axis = "time on a plateau"
    fingerprint = "every high level creeps, and low ones after it are off, too"
    places = (Place.G1, Place.F)
    declared = (K, TAU)
    absent: ClassVar = {"k": 0.0, "tau": 1.0}
    confused_with = (
        Confusion("dielectric_absorption", "two step sizes: heat goes with the square of the level"),
        Confusion("plateau_droop", "a level held on a border: heat goes on there, a droop does not"),
        Confusion("gain_drift", "the same staircase once more after a pause: a drift goes on, heat has gone"),
        Confusion("curved_border", "two dwell times: a bent border is bent at once"),
    )
    example: ClassVar = {"k": 4e-3, "tau": 0.03}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the gain at work, cold; heat hardly bends what is held, so the shape stays."""
        k, tau = values
        if k == 0.0:
            return (lambda block: block.signal), shape
        warmth = run_linear(stepper((1.0,), (tau, 1.0), grid.step_s, "ramp"))

        def run(block: Block) -> Array:
            load = Block(np.square(block.signal), block.source, block.first, block.grid)
            return np.asarray(block.signal * (1.0 - k * warmth(load)))

        return run, shape

    def plausible(self, chain: Chain, observations: "Sequence[Observation]") -> bool:
        """Return whether a part can warm as slowly as that at least."""
        return chain.values[self.called(TAU)] >= FASTEST_S

    def plainer(self, chain: Chain) -> tuple[Effect, dict[str, float]] | None:
        """Return borders bent at once, which heat behind F comes to that neither lasts nor takes long to come."""
        law = CurvedBorder(Place.F, "cube")
        if self.place is not Place.F or not law.applicable(chain):
            return None
        return law, {law.parameters()[0].name: -chain.values[self.called(K)] * mean_slope(chain) ** 3}

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the time constant that explains most with the coefficient that suits it, taken as proportional."""
        small = [{"k": SMALL, "tau": float(count) * evidence.sample_s} for count in TAUS]
        best = evidence.best(self, [values for values in evidence.sized(self, "k", small) if values["k"]])
        return [best] if best else []
