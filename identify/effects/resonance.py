"""A block rings."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.blocks import run_filter
from identify.chain import Chain
from identify.effects.effect import Confusion, Effect
from identify.stage import Grid, Parameter, Place, Run, Shape, Values

if TYPE_CHECKING:
    from identify.evidence import Evidence

W_N = Parameter("resonance.w_n", "rad/s", "log")
ZETA = Parameter("resonance.zeta", "1", scale=0.3, least=0.01, most=1.0)
"""Above 1 it is two lags and rings no more; below 0.01, a Q of 50, it would be a line that no circuit here rings on."""
DAMPINGS = (0.1, 0.4, 1.0)
FREQUENCIES, TOP, SPREAD = 6, 0.3, 1000.0  # tried from a share of the sample rate down to a thousandth of that
CLOSER = (0.6, 1.6)  # times the best of those
PEAKS = 0.75  # damping beyond which no gain rises: 1 / sqrt(2), and what noise makes of that
FAR = 30.0  # times the sample rate: there a resonance is a lag of 2 zeta / w_n and no more


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
    quick = True
    linear = True
    places = (Place.G1, Place.G2)
    declared = (W_N, ZETA)
    absent: ClassVar = {"w_n": float("inf"), "zeta": 1.0}
    confused_with = (
        Confusion("extra_pole", "steps watched at a higher sample rate: a pole alone does not overshoot"),
        Confusion("dead_time", "sines up to the resonance: a delay leaves the amplitude alone"),
        Confusion("process_noise", "two hold times: noise lets the level creep on, ringing ends", here=Place.G1),
    )
    example: ClassVar = {"w_n": 900.0, "zeta": 0.3}

    def ordinary(self, chain: Chain) -> bool:
        """Return whether its gain rises nowhere: so do an average over some readings, two lags, a delay with a lag."""
        return chain.values[self.called(ZETA)] > PEAKS

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running filter."""
        w_n, zeta = values
        den = ((1.0 / w_n) ** 2, 2.0 * zeta / w_n, 1.0) if np.isfinite(w_n) else (1.0,)
        return run_filter((1.0,), den, grid, shape)

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the frequency, then the damping, then the frequency again that explain most; or a lag that does."""
        rate = 2.0 * np.pi / evidence.sample_s
        tried = [{"w_n": float(w), "zeta": DAMPINGS[1]} for w in np.geomspace(TOP / SPREAD, TOP, FREQUENCIES) * rate]
        lag = evidence.scaled(self, {"w_n": FAR * rate, "zeta": DAMPINGS[1]}) / (FAR * rate)
        if lag > 0.0:
            tried.append({"w_n": 1.0 / lag, "zeta": DAMPINGS[1]})
        best = evidence.best(self, tried)
        best = evidence.best(self, [{**best, "zeta": zeta} for zeta in DAMPINGS])
        best = evidence.best(self, [best, *({**best, "w_n": share * best["w_n"]} for share in CLOSER)])
        return [best] if best else []
