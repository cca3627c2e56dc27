"""A stage that cannot move faster than so many volts a second."""

from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify import following
from identify.chain import Chain
from identify.effects.effect import Confusion, Effect
from identify.stage import Block, Grid, Parameter, Place, Ramp, Run, Shape, Values
from identify.trace import Array

if TYPE_CHECKING:
    from identify.evidence import Evidence

RATE = Parameter("slew_limit.rate", "V/s", "log")
LAG = Parameter("slew_limit.lag", "s", scale=1e-4, least=0.0)
SHARPEST = 2e-3  # steps: a lag that no longer rounds
LAGS = (0.5, 2.0, 8.0, 32.0)  # samples
FASTER = 1.6  # times the rate of a sharp limit that a rounded one may have which does as much
LEAST = 0.1  # samples: the lag from which a limit that was sharp is rounded
SHARES = (0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.97)  # of the fastest rate of w: a limit may only just be met


@final
class SlewLimit(Effect):
    """w followed at no more than a rate, the same up and down, by the amplifier that puts F out.

    Rounded as it is in an amplifier whose input stage gives a current of the tanh of its voltage: what is near is
    followed with a lag, what is far at the rate (J. E. Solomon, IEEE J. Solid-State Circuits 9 (1974) 314).
    """

    id = "slew_limit"
    title = "slew limit"
    equation = "w' follows w, |dw'/dt| <= rate; rounded: dw'/dt = rate tanh((w - w') / (rate lag))"
    sentence = (
        "The output of F moves no faster than {}: an amplifier there runs into its slew rate; drive it with smaller or "
        "slower steps, or take a faster one or a smaller capacitor."
    )
    axis = "rate of w"
    fingerprint = "straight edges of fixed slope"
    quick = True
    places = (Place.F,)
    elsewhere: ClassVar = {Place.G1: "", Place.SENSE: ""}  # an amplifier there is as likely to be too slow
    forms = ("", "rounded")
    declared = (RATE, LAG)
    absent: ClassVar = {"rate": float("inf"), "lag": 0.0}
    confused_with = (
        Confusion("extra_pole", "steps of two sizes: a pole rounds both alike, a slew limit spares the small one"),
        Confusion("rate_dependent_gap", "sines of one frequency and rising amplitude: a limit begins at one rate"),
        Confusion("saturation", "a slow sine of the same amplitude: a rail is met there too, a slew limit is not"),
    )
    example: ClassVar = {"rate": 900.0, "lag": 3e-4}

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the rate, and the lag of one that is rounded."""
        return self.declared if self.form else (RATE,)

    def completed(self, chain: Chain, evidence: "Evidence") -> Chain:
        """Return ``chain`` with a lag that just rounds where there is none."""
        sharp = LAG in self.parameters() and chain.values[LAG.name] < SHARPEST * evidence.sample_s
        return chain.with_values({LAG.name: LEAST * evidence.sample_s}) if sharp else chain

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the running follower, at rest; what it follows by leaps it follows in straight lines."""
        most, level, before = values[0] * grid.step_s, 0.0, 0.0
        lag = values[1] / grid.step_s if self.form else 0.0

        def run(block: Block) -> Array:
            nonlocal level, before
            out = np.empty_like(block.signal)
            if lag > SHARPEST and np.isfinite(most):
                level = following.slewed_softly(most, lag, level, before, block.signal, out)
                before = float(block.signal[-1])
            else:
                level = following.slewed(most, level, block.signal, out)
            return out

        return run, Ramp() if np.isfinite(most) else shape

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the limit, tried at shares of the fastest rate at its place, that explains most."""
        top = evidence.rates(self.place)[-1]
        options = [{"rate": share * top} for share in SHARES]
        best = evidence.best(SlewLimit(self.place), options)
        if best and self.form:
            rates = {best["rate"], FASTER * best["rate"], SHARES[-2] * top}
            options = [{"rate": rate, "lag": n * evidence.sample_s} for rate in rates for n in LAGS]
            best = max(options, key=lambda values: evidence.coarse.gain(self, values))  # it has no size to be scaled
        return [best] if best else []
