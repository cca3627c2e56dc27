"""A hold that does not hold: on a plateau, w runs by itself."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify import kernels
from identify.blocks import Play
from identify.chain import Chain
from identify.effects.effect import Confusion, Effect
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

RATE = Parameter("plateau_droop.rate", "1/s", scale=0.1)
CURRENT = Parameter("plateau_droop.current", "V/s", scale=0.1)
LAWS = {"leak": (RATE,), "bias": (CURRENT,), "leak and bias": (RATE, CURRENT)}


@dataclass(frozen=True)
class DroopingPlay(Play):
    """The play operator whose held level obeys dw/dt = current - rate w until a border takes it along."""

    law: tuple[Parameter, ...] = (RATE, CURRENT)

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the borders, then rate and current."""
        return (*super().parameters(), *self.law)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running operator; the step of the held level is exact."""
        given = dict(zip([p.name for p in self.law], values[4:], strict=True))
        rate, current = given.get(RATE.name, 0.0), given.get(CURRENT.name, 0.0)
        keep = float(np.exp(-rate * grid.step_s))
        s_l, d_l, s_u, d_u = values[:4]
        climb = current * (grid.step_s if rate == 0.0 else -np.expm1(-rate * grid.step_s) / rate)
        w = 0.0

        def run(block: Block) -> Array:
            nonlocal w
            out = np.empty_like(block.signal)
            w = kernels.leaky_play(s_l, d_l, s_u, d_u, keep, -climb, w, block.signal, out)
            return out

        return run, shape


@final
class PlateauDroop(Effect):
    """Leak or bias current of the capacitor that holds w while the play is inside its gap."""

    id = "plateau_droop"
    title = "droop of the held level"
    equation = "on plateaus dw/dt = current - rate w"
    sentence = "The level F holds on a plateau runs by itself: {}. A leak pulls to zero, a bias current to one side."
    axis = "time on a plateau"
    fingerprint = "slope against time, on plateaus only"
    places = (Place.F,)
    forms = ("leak", "bias", "leak and bias")
    declared = (RATE, CURRENT)
    absent: ClassVar = {"rate": 0.0, "current": 0.0}
    confused_with = (
        Confusion("ac_coupling", "a staircase that moves along a border only: a leak shows on plateaus alone"),
        Confusion("dielectric_absorption", "a staircase with two dwell times"),
    )
    example: ClassVar = {"rate": 0.35, "current": 0.4}

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parameters of the form."""
        return LAWS[self.form]

    def applicable(self, chain: Chain) -> bool:
        """Return whether there is a gap in which to droop."""
        return super().applicable(chain) and chain.stage_of(Play) is not None

    def put_in(self, chain: Chain, values: Mapping[str, float]) -> Chain:
        """Return ``chain`` with its play operator drooping; ValueError when it has none."""
        play = chain.stage_of(Play)
        if play is None:
            raise ValueError("plateau_droop needs a backlash in F")
        drooping = DroopingPlay(play.start, law=self.parameters())
        return chain.with_replaced(play, drooping, self.named(values)).crediting(self)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Refuse: the effect lives inside the play operator."""
        raise NotImplementedError("put_in changes the play operator; there is no stage of its own")

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the rate and the current, of either sign, that explain most."""
        low, high = evidence.range(Place.F)
        rates = [float(r) for r in np.geomspace(1e-3, 30.0, 6)]
        best: dict[str, float] = {}
        for name, size in (("rate", 1.0), ("current", max(high, -low, 1e-3))):
            if any(p.name.endswith(name) for p in self.parameters()):
                signs = (1.0,) if name == "rate" else (1.0, -1.0)
                best = evidence.best(self, [{**best, name: sign * r * size} for r in rates for sign in signs]) or best
        return [{p.name.rpartition(".")[2]: best.get(p.name.rpartition(".")[2], 0.0) for p in self.parameters()}]
