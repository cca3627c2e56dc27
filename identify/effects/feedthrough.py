"""The stimulus reaches the ADC past the circuit."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.blocks import run_linear
from identify.discretise import stepper
from identify.effects.effect import Confusion, Effect
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

K = Parameter("feedthrough.k", "V/V", scale=0.01)
TAU = Parameter("feedthrough.tau", "s", "log", within=10.0)  # without end it would be the level of u
CAPACITIVE = "capacitive"
TAUS = np.geomspace(1.0, 3e3, 8)  # samples
SIMULATED = 2  # of these, that promise most


@final
class Feedthrough(Effect):
    """A share of the generator's voltage added to the reading: crosstalk, a shared ground.

    Through a capacitance into a resistance only its changes pass, and die away in ``tau``.
    """

    id = "feedthrough"
    title = "feedthrough of the stimulus"
    equation = "y' = y + k u, or through a capacitance y' = y + k e, tau (de/dt - du/dt) = -e"
    sentence = (
        "A share of the generator's voltage reaches the ADC past the circuit: {}. Lead wires and grounds of the two "
        "apart; where a tau is told it comes through the capacitance between wires: screen one of them."
    )
    axis = "level of u"
    fingerprint = "motion during plateaus; a stuck-state sine isolates it"
    quick = True
    places = (Place.SENSE,)
    forms = ("", CAPACITIVE)
    declared = (K, TAU)
    absent: ClassVar = {"k": 0.0, "tau": 1.0}
    confused_with = (
        Confusion(
            "plateau_tilt",
            "a sine too small to move F at a high frequency: a bypass of F alone is filtered by G1 and G2",
        ),
    )
    example: ClassVar = {"k": 0.012, "tau": 3e-3}

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the share, and the time constant of a capacitance."""
        return self.own((K, TAU) if self.form == CAPACITIVE else (K,))

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the addition at work; the reading sees the voltage just before its instant."""
        k, *tau = values
        if not tau:
            return (lambda block: block.signal + k * block.source), shape
        passing = run_linear(stepper((tau[0], 0.0), (tau[0], 1.0), grid.step_s, "held"))

        def run(block: Block) -> Array:
            return np.asarray(block.signal + k * passing(block.holding(block.source)))

        return run, shape

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the share that explains most; the problem is linear in it, not in the time constant."""
        if self.form != CAPACITIVE:
            best = evidence.proportion(self, "k", 1e-2)
            return [best] if best else []
        taus = [{"tau": float(count) * evidence.sample_s} for count in TAUS]
        found = [(tau, *evidence.proportions_beside(self, tau, {"k": 1e-2}, ["k"])) for tau in taus]
        likely = sorted((one for one in found if one[1]), key=lambda one: -one[2])[:SIMULATED]
        best = evidence.best(self, [{**tau, **values} for tau, values, _ in likely])
        return [best] if best else []
