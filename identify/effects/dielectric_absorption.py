"""A capacitor that remembers where it stood: creep after every step."""

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Self, final

import numpy as np

from identify.altered_play import Law
from identify.blocks import run_linear
from identify.discretise import stepper
from identify.effects.effect import BESIDE, Confusion
from identify.effects.inside_play import InsidePlay
from identify.stage import Grid, Held, Parameter, Place, Run, Shape, Values, memoryless

if TYPE_CHECKING:
    from identify.evidence import Evidence

FRACTION = Parameter("dielectric_absorption.fraction", "V/V", scale=0.03, least=0.0, most=0.5)
TAU = Parameter("dielectric_absorption.tau", "s", "log")
TAUS = np.geomspace(10.0, 3e4, 8)  # samples
SMALL = 0.01  # fraction at which the change is looked at


@final
class DielectricAbsorption(InsidePlay):
    """A share that arrives late: everywhere behind F or G1, or only where the hold capacitor is left to itself.

    A hold capacitor C with C_a = fraction C behind a resistance, tau = R C_a, creeps on plateaus only: on a border the
    amplifier supplies what the dielectric takes.
    """

    id = "dielectric_absorption"
    title = "dielectric absorption"
    equation = (
        "every step: w' (or v') = (1 - fraction) w + fraction w / (1 + s tau); on plateaus: dw/dt = -fraction dq/dt, "
        "dq/dt = (w - q) / tau everywhere"
    )
    sentence = (
        "A capacitor creeps after every step, as its dielectric takes and gives back charge: {}. Use a "
        "polypropylene or C0G capacitor, or wait longer after each step."
    )
    axis = "time on a plateau"
    fingerprint = "creep after every step"
    places = (Place.F, Place.G1)
    forms = ("every step", "on plateaus")
    declared = (FRACTION, TAU)
    absent: ClassVar = {"fraction": 0.0, "tau": 1.0}
    confused_with = (
        Confusion("plateau_droop", "plateaus at one level reached from either side: a leak pulls both to zero"),
        Confusion("extra_pole", "a staircase with two dwell times: a slow pole of F or G2 is the same physics"),
        Confusion("ac_coupling", "a long hold: absorption ends at a share of the step, a coupling at zero"),
        Confusion("process_noise", "small steps inside the gap: a ratchet rests away from the borders"),
    )
    example: ClassVar = {"fraction": 0.06, "tau": 0.04}

    @classmethod
    def variants(cls) -> Iterator[Self]:
        """Yield both forms at F, and the one that needs no gap at G1."""
        yield from (effect for effect in super().variants() if effect.place == Place.F or effect.form == "every step")

    @property
    def inside(self) -> bool:
        """Return whether it creeps only where the play operator lets go."""
        return self.form == "on plateaus"

    @property
    def same_at(self) -> tuple[Place, ...]:
        """Return the places at which it gives the same data: what creeps after every step is a linear block."""
        return (self.place,) if self.inside else (self.place, *BESIDE[self.place])

    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law whose held level shares charge with the dielectric; the step is exact while it is held."""
        fraction, tau_s = values
        moved = -float(np.expm1(-(1.0 + fraction) * grid.step_s / tau_s)) / (1.0 + fraction)
        return replace(law, to_w=fraction * moved, to_q=moved)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the creep behind F at work; it hardly bends what is held, so the shape stays."""
        if self.inside:
            return super().begin(values, grid, shape)
        fraction, tau_s = values
        if fraction == 0.0:
            return memoryless(lambda w: w, shape)
        num, den = ((1.0 - fraction) * tau_s, 1.0), (tau_s, 1.0)
        if isinstance(shape, Held):
            return run_linear(stepper(num, den, grid.step_s, "held", shape.fraction)), shape
        return run_linear(stepper(num, den, grid.step_s, "ramp")), shape

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the time constant, tried from 10 samples up, that explains most with the fraction that suits it."""
        small = [{"fraction": SMALL, "tau": float(count) * evidence.sample_s} for count in TAUS]
        return [evidence.best_share(self, "fraction", small)]
