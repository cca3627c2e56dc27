"""A pure delay somewhere between generator and ADC."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.blocks import LinearBlock
from identify.chain import Chain
from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

DELAY = Parameter("dead_time.delay", "s", "log")


@final
class DeadTime(Effect):
    """y late by a fixed time; by convention in G2, since a delay moves freely along the chain (physics.md 1.1)."""

    id = "dead_time"
    title = "dead time"
    equation = "x'(t) = x(t - delay)"
    sentence = "Everything arrives {} late; reported in G2 by convention, a delay before F gives the same data."
    axis = "frequency"
    fingerprint = "phase proportional to frequency"
    quick = True
    linear = True
    places = (Place.G2,)
    declared = (DELAY,)
    absent: ClassVar = {"delay": 0.0}
    confused_with = (
        Confusion("rate_dependent_gap", "two amplitudes at one frequency: a delay does not depend on dv/dt"),
        Confusion("clock_skew", "one sine over a long run: a delay stays, a skew grows with time"),
        Confusion("resonance", "sines up to the resonance: a delay leaves the amplitude alone"),
        Confusion("source_pole", "sines at higher frequency: a delay leaves the amplitude alone"),
        Confusion("extra_pole", "sines at higher frequency: a delay leaves the amplitude alone"),
    )
    example: ClassVar = {"delay": 2.3e-4}

    def applicable(self, chain: Chain) -> bool:
        """Return whether no dead time is searched already."""
        return super().applicable(chain) and not _g2(chain).delays

    def put_in(self, chain: Chain, values: Mapping[str, float]) -> Chain:
        """Return ``chain`` with what G2 puts out late."""
        g2 = _g2(chain)
        late = replace(g2, delays=(*g2.delays, DELAY))
        return chain.with_replaced(g2, late, self.named(values)).crediting(self)

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Refuse: the effect lives inside G2."""
        raise NotImplementedError("put_in changes G2; there is no stage of its own")

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the delay, tried from a fiftieth of a sample to twenty samples, that explains most."""
        tried = [{"delay": float(d)} for d in evidence.sample_s * np.geomspace(0.02, 20.0, 8)]
        best = evidence.best(self, tried)
        return [best] if best else []


def _g2(chain: Chain) -> LinearBlock:
    """Return G2; ValueError where there is none."""
    found = next((s for s in chain.stages if isinstance(s, LinearBlock) and s.name == "G2"), None)
    if found is None:
        raise ValueError("the chain has no G2")
    return found
