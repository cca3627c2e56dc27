"""A hold that does not hold: on a plateau, w runs by itself."""

from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.altered_play import Law
from identify.effects.effect import Confusion
from identify.effects.inside_play import InsidePlay
from identify.stage import Grid, Parameter, Place, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

RATE = Parameter("plateau_droop.rate", "1/s", scale=0.1)
CURRENT = Parameter("plateau_droop.current", "V/s", scale=0.1)
TARGET = Parameter("plateau_droop.target", "V/V", scale=0.1)
UNEVENLY = "unevenly across"
RATES = tuple(float(rate) for rate in np.geomspace(1e-3, 30.0, 6))  # 1/s
SMALL = 1e-4  # 1/s: what it does is in proportion to it
LAWS = {
    "leak": (RATE,), "bias": (CURRENT,), "leak and bias": (RATE, CURRENT), "across": (RATE,), UNEVENLY: (RATE, TARGET),
}  # fmt: skip


@final
class PlateauDroop(InsidePlay):
    """Leak or bias current of the capacitor that holds w while the play is inside its gap.

    A leak to ground pulls w to zero; one ``across`` the blocked diodes pulls it to where v alone would have it: by the
    mean of the slopes, or, where one diode leaks more than the other, by ``target`` times that.
    """

    id = "plateau_droop"
    title = "droop of the held level"
    equation = "on plateaus dw/dt = current - rate w; across: dw/dt = rate (target S v - w)"
    sentence = (
        "The level F holds on a plateau runs by itself: {}. A leak pulls to zero, a bias current to one side, a leak "
        "across the blocked diodes to where v alone would have it, or to target times that."
    )
    axis = "time on a plateau"
    fingerprint = "slope against time, on plateaus only"
    places = (Place.F,)
    forms = ("leak", "bias", "leak and bias", "across", UNEVENLY)
    declared = (RATE, CURRENT, TARGET)
    absent: ClassVar = {"rate": 0.0, "current": 0.0, "target": 1.0}
    confused_with = (
        Confusion("ac_coupling", "a staircase that moves along a border only: a leak shows on plateaus alone"),
        Confusion("dielectric_absorption", "a staircase with two dwell times"),
    )
    example: ClassVar = {"rate": 0.35, "current": 0.4, "target": 1.2}

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters of the form."""
        return LAWS[self.form]

    def altered(self, law: Law, values: Values, grid: Grid) -> Law:
        """Return the law whose held level runs; the step is exact."""
        given = dict(zip([p.name for p in self.parameters()], values, strict=True))
        rate, current = given.get(RATE.name, 0.0), given.get(CURRENT.name, 0.0)
        keep = float(np.exp(-rate * grid.step_s))
        held_s = grid.step_s if rate == 0.0 else -float(np.expm1(-rate * grid.step_s)) / rate
        target = given.get(TARGET.name, 1.0)
        across = target * (1.0 - keep) if self.form in ("across", UNEVENLY) else 0.0
        return replace(
            law, keep=law.keep * keep, climb=keep * law.climb + current * held_s, across=keep * law.across + across
        )

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the rate and the current, of either sign, that explain most; the uneven form is one more complete."""
        if self.form == UNEVENLY:
            return []
        low, high = evidence.range(Place.F)
        best: dict[str, float] = {}
        for name, size in (("rate", 1.0), ("current", max(high, -low, 1e-3))):
            if any(p.name.endswith(name) for p in self.parameters()):
                best = self._further(evidence, best, name, size)
        return [{p.name.rpartition(".")[2]: best.get(p.name.rpartition(".")[2], 0.0) for p in self.parameters()}]

    def _further(self, evidence: "Evidence", best: dict[str, float], name: str, size: float) -> dict[str, float]:
        """Return ``best`` with one more value: of a grid of its size, or a small one that acts in proportion to it."""
        signs = (1.0,) if name == "rate" else (1.0, -1.0)
        options = [{**best, name: sign * rate * size} for rate in RATES for sign in signs]
        small = {} if best else evidence.proportion(self, name, SMALL * size)
        holds = bool(small) and (name == "current" or small[name] > 0.0)
        return evidence.best(self, [*options, small if holds else {**best, name: 0.0}]) or best
