"""A gap where the rig file knows none: F lets go and takes hold again."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify import altered_kernels
from identify.blocks import Gain
from identify.chain import Chain
from identify.effects.effect import Confusion, Effect
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

S = Parameter("backlash.S", "V/V")
D_L = Parameter("backlash.D_L", "V")
D_U = Parameter("backlash.D_U", "V")
GAPS = (0.002, 0.015, 0.05, 0.12, 0.25, 0.4, 0.6)  # of the swing of v


@final
class Backlash(Effect):
    """The play operator in place of a straight line: one slope, a loading and an unloading border."""

    id = "backlash"
    title = "play in F"
    equation = "w = min(max(w, S (v - D_L)), S (v - D_U)) in place of gain v + offset"
    sentence = (
        "F has play: it lets go where v turns round and takes hold again a gap later, as worn gears, a loose coupling "
        "or two rectifiers on one capacitor do: {}. Give the rig file a backlash, or take the play out."
    )
    axis = "level of w"
    fingerprint = "loop that does not close up at low rate, width independent of rate"
    places = (Place.F,)
    declared = (S, D_L, D_U)
    absent: ClassVar = {"S": 1.0, "D_L": 0.0, "D_U": 0.0}  # of a gain of one; put_in takes the chain's own
    confused_with = (
        Confusion("extra_pole", "a sine at a tenth of the frequency: the loop of a pole closes, that of a gap stays"),
        Confusion("dead_time", "a sine at a tenth of the frequency: the loop of a delay closes, that of a gap stays"),
        Confusion("dielectric_absorption", "a staircase with two dwell times: a gap does not ask how long"),
    )
    example: ClassVar = {"S": 8.0, "D_L": 0.4, "D_U": -0.3}

    def applicable(self, chain: Chain) -> bool:
        """Return whether F is a straight line."""
        return super().applicable(chain) and chain.stage_of(Gain) is not None

    def put_in(self, chain: Chain, values: Mapping[str, float]) -> Chain:
        """Return ``chain`` with a play operator for its straight line; ValueError when F is none."""
        line = chain.stage_of(Gain)
        if line is None:
            raise ValueError("backlash takes the place of a straight line, and F is none")
        gain, offset_v = chain.of(line, "")
        middle_v = -offset_v / gain if gain else 0.0
        here = {"S": gain, "D_L": middle_v, "D_U": middle_v, **values}
        return chain.with_replaced(line, self, self.named(here)).crediting(self)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running operator, from w as close to 0 as the borders allow; a gap has no sign."""
        slope = values[0]
        ends = sorted(slope * d for d in values[1:])
        state = (0.0, 0.0)

        def run(block: Block) -> Array:
            nonlocal state
            line, out = slope * block.signal, np.empty_like(block.signal)
            state = altered_kernels.held_play(line - ends[1], line - ends[0], altered_kernels.STILL, state, out)
            return out

        return run, shape

    def upright(self, chain: Chain) -> Chain:
        """Return ``chain`` with the loading border to the right of the unloading one."""
        d_l, d_u = chain.values[D_L.name], chain.values[D_U.name]
        return chain if d_l >= d_u else chain.with_values({D_L.name: d_u, D_U.name: d_l})

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the gap that explains most: of those tried, and of the one that the smallest tried points to.

        A line through a loop whose corners are cut off by the gap is flatter than its borders. A small gap acts in
        proportion to its width.
        """
        line = evidence.chain.stage_of(Gain)
        if line is None:
            return []
        gain, offset_v = evidence.chain.of(line, "")
        low, high = evidence.range(Place.G1)
        middle_v = -offset_v / gain if gain else 0.0

        def at(share: float) -> dict[str, float]:
            half_v = 0.5 * share * (high - low)
            return {"S": gain / (1.0 - share), "D_L": middle_v + half_v, "D_U": middle_v - half_v}

        pointed = GAPS[0] * evidence.scaled(self, at(GAPS[0]))
        best = evidence.best(self, [at(share) for share in (*GAPS, min(max(pointed, 1e-9), GAPS[2]))])
        return [best] if best else []
