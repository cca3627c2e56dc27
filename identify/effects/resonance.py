"""A block rings, or is slower than drawn by two poles at once."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.blocks import run_filter
from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

W_N = Parameter("resonance.w_n", "rad/s", "log")
ZETA = Parameter("resonance.zeta", "1", "log")
DAMPINGS = (0.1, 0.4, 1.0)
FREQUENCIES = 5  # tried from a tenth of the sample rate downwards
SPREAD = 400.0  # highest over lowest of them


@final
class Resonance(Effect):
    """A second-order low-pass beside G1 or beside G2: a capacitive load, a cable's inductance, a peaking amplifier."""

    id = "resonance"
    title = "resonance"
    equation = "v' = v w_n^2 / (s^2 + 2 zeta w_n s + w_n^2) behind G1, or the same of x behind G2"
    sentence = (
        "The path rings: {}. An amplifier with a capacitive load or too little phase margin does that; damp it with a "
        "resistor at its output, or raise the order of the block."
    )
    axis = "frequency"
    fingerprint = "at G1 the gap seems to shrink with the step's size; at G2 edges ring"
    places = (Place.G1, Place.G2)
    declared = (W_N, ZETA)
    absent: ClassVar = {"w_n": float("inf"), "zeta": 1.0}
    confused_with = (
        Confusion("extra_pole", "steps watched at a higher sample rate: a pole alone does not overshoot"),
        Confusion("dead_time", "sines up to the resonance: a delay leaves the amplitude alone"),
        Confusion("process_noise", "two hold times: noise lets the level creep on, ringing ends", here=Place.G1),
    )
    example: ClassVar = {"w_n": 900.0, "zeta": 0.3}

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running filter."""
        w_n, zeta = values
        den = ((1.0 / w_n) ** 2, 2.0 * zeta / w_n, 1.0) if np.isfinite(w_n) else (1.0,)
        return run_filter((1.0,), den, grid, shape)

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the frequency and then the damping that explain most."""
        top = 0.1 * 2.0 * np.pi / evidence.sample_s
        frequencies = [float(w) for w in np.geomspace(top / SPREAD, top, FREQUENCIES)]
        best = evidence.best(self, [{"w_n": w, "zeta": DAMPINGS[1]} for w in frequencies])
        best = evidence.best(self, [{**best, "zeta": zeta} for zeta in DAMPINGS]) if best else {}
        return [best] if best else []
