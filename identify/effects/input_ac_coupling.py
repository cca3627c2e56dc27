"""A capacitor in series with the input: what is held does not stay."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.blocks import run_filter
from identify.chain import Chain
from identify.effects.effect import Confusion, Effect
from identify.stage import Block, Grid, Parameter, Place, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

T = Parameter("input_ac_coupling.T", "s", "log")
LONG = 1e3  # times the longest run: the sag is small and in proportion to 1 / T


@final
class InputAcCoupling(Effect):
    """A high-pass of the source: during a hold v sags to zero, and once it has crossed the gap w follows.

    It runs right behind G1, with which it commutes, where signals do not jump.
    """

    id = "input_ac_coupling"
    title = "AC coupling of the input"
    equation = "u' = u s / (s + 1/T)"
    sentence = (
        "The input is AC-coupled, held levels decay: {}. A series capacitor, or a generator set to AC, does that; "
        "bridge it or switch the input to DC."
    )
    axis = "frequency"
    fingerprint = "v sags during a hold and may cross the gap back"
    linear = True
    places = (Place.SOURCE,)
    declared = (T,)
    absent: ClassVar = {"T": float("inf")}
    confused_with = (
        Confusion("ac_coupling", "a hold on a plateau: a sag before the gap does not show until it has crossed it"),
        Confusion("plateau_droop", "a hold on a border: a held level droops only where no border holds it"),
        Confusion("dielectric_absorption", "a hold ten times as long: creep ends, a series capacitor goes on to zero"),
    )
    example: ClassVar = {"T": 3.0}

    @property
    def shows_at(self) -> Place:
        """Return G1: it runs behind it."""
        return Place.G1

    def put_in(self, chain: Chain, values: Mapping[str, float]) -> Chain:
        """Return ``chain`` with this high-pass right behind G1."""
        return chain.with_stage_behind("G1", replace(self, place=Place.G1), self.named(values)).crediting(self)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running high-pass: the signal less its slow part."""
        (t,) = values
        if not np.isfinite(t):
            return (lambda block: block.signal), shape
        slow, _ = run_filter((1.0,), (t, 1.0), grid, shape)

        def run(block: Block) -> Array:
            return np.asarray(block.signal - slow(block))

        return run, shape

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the time constant, tried from ten samples to ten runs, that explains most.

        A long one acts in proportion to 1 / T: its best size is known from one trial.
        """
        size = LONG * evidence.longest_s
        found = evidence.proportion(self, "T", size).get("T", 0.0)  # size times what the sag must be multiplied by
        tried = [size * size / found] if found > 0.0 else []
        tried += [float(t) for t in np.geomspace(10.0 * evidence.sample_s, evidence.longest_s, 5)]
        best = evidence.best(self, [{"T": t} for t in tried])
        return [best] if best else []
