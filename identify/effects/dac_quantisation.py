"""The generator's output has steps: it cannot say every voltage."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from identify.blocks import Source
from identify.chain import Chain
from identify.comb import FINEST, centred, comb, rounded
from identify.effects.effect import Confusion, Effect
from identify.fit import total_chi_squared
from identify.stage import Grid, Parameter, Place, Run, Shape, Values, memoryless

if TYPE_CHECKING:
    from identify.evidence import Evidence
    from identify.observe import Observation

# The size is found by comparing all (identify.comb). A fit moves it within those that round alike, and its interval is
# that of the errors' size: the far narrower one of the edges, along which nothing has a slope, is not told.
LSB = Parameter("dac_quantisation.lsb", "V", scale=5e-6, least=0.0, within=1.00001)
WEIGHED = 3  # sizes compared with the plain parameters moved
LARGE, SHARE = 1e3, 0.1  # fall of chi-squared, and share of what is to explain, from which a size is found more closely
SHARES = (0.1, 0.3, 0.5, 0.7, 0.9)  # of the way through the sizes that round that alike
CLOSER = (-0.1, -0.05, 0.05, 0.1)
TOLD, ZOOMS, TRIED, CLOSER_STILL = 3e-4, 3, 12, 5.0  # share of a step that is looked around it, in ever smaller parts
LEAPS = (0.01, 0.02, 0.04, 0.08)  # of a step at the highest level, by which a size may be off
LOOKED_ELSEWHERE = 12.0 + 2.0 * np.log(FINEST)  # chi-squared: more than the best of so many sizes gains on noise


@final
class DacQuantisation(Effect):
    """u rounded to whole steps of the DAC, as a command of few bits or a coarse generator is."""

    id = "dac_quantisation"
    title = "steps of the DAC"
    equation = "u' = lsb round(u / lsb)"
    sentence = (
        "The generator puts out whole steps only: {}. Use a DAC of more bits or a smaller range of it, or let the "
        "protocol play levels that are whole steps."
    )
    axis = "level of u"
    fingerprint = "steps in v, images at the update rate"
    quick = True
    compared = True
    places = (Place.SOURCE,)
    declared = (LSB,)
    absent: ClassVar = {"lsb": 0.0}
    confused_with = (
        Confusion("adc_quantisation", "a staircase: an ADC rounds what G2 has smoothed, a DAC what was asked for"),
        Confusion("source_nonlinearity", "a slow ramp of u: steps repeat along it, a curve does not"),
        Confusion("process_noise", "the same run twice: steps come again at the same levels, noise does not"),
    )
    example: ClassVar = {"lsb": 0.047}

    def applicable(self, chain: Chain) -> bool:
        """Return whether u is what a DAC was told to hold: a measured u has its steps already."""
        source = chain.stage_of(Source)
        return super().applicable(chain) and source is not None and source.held

    def begin(self, values: Values, grid: Grid, shape: Shape) -> tuple[Run, Shape]:
        """Return the rounding at work."""
        (lsb,) = values
        return memoryless((lambda u: rounded(u, lsb)) if lsb > 0.0 else (lambda u: u), shape)

    def starts(self, evidence: "Evidence") -> list[dict[str, float]]:
        """Return the step that explains most, if more than the best of all sizes would on noise."""
        low, high = evidence.range(Place.SOURCE)
        if not self.applicable(evidence.chain) or low == high:
            return []
        found = comb(evidence.coarse)
        if found.most < LOOKED_ELSEWHERE:
            return []
        likely = [{"lsb": centred(found.inside(step))} for step in found.best(high - low, WEIGHED)]
        if not likely:
            return []
        best = min(likely, key=lambda values: self._left(evidence, values))
        gain = evidence.gain(self, best)
        if gain < LOOKED_ELSEWHERE:
            return []
        likely_so = gain > max(LARGE, SHARE * (evidence.left - evidence.residual.size))
        return [self._within(evidence, *found.alike(best["lsb"]), best) if likely_so else best]

    def resettled(self, chain: Chain, observations: "Sequence[Observation]") -> Chain:
        """Return ``chain`` with the step that rounds the fewest levels to a wrong one; ever closer ones are tried."""
        reach = TOLD
        for _ in range(ZOOMS):
            near = [centred(chain.values[LSB.name] * (1.0 + reach * share)) for share in np.linspace(-1.0, 1.0, TRIED)]
            options = [chain, *(chain.with_values({LSB.name: lsb}) for lsb in near)]
            chain = min(options, key=lambda option: total_chi_squared(option, observations))
            reach /= CLOSER_STILL
        return chain

    def leaps(self, chain: Chain, observations: "Sequence[Observation]") -> list[Chain]:
        """Return ``chain`` with steps that round most of what was played alike: gains take up most of the change."""
        lsb, highest = chain.values[LSB.name], max(float(np.max(np.abs(o.trace.u[:]))) for o in observations)
        steps = [centred(lsb * (1.0 + side * share * lsb / highest)) for share in LEAPS for side in (-1.0, 1.0)]
        return [chain.with_values({LSB.name: step}) for step in steps]

    def _within(self, evidence: "Evidence", least: float, most: float, best: dict[str, float]) -> dict[str, float]:
        """Return the step between two that explains most: what is held long rounds alike, all else tells them apart."""
        near = [{"lsb": centred(least + share * (most - least))} for share in SHARES]
        best = evidence.best(self, [best, *near])
        near = [{"lsb": centred(best["lsb"] + share * (most - least))} for share in CLOSER]
        return evidence.best(self, [best, *near])

    def _left(self, evidence: "Evidence", values: dict[str, float]) -> float:
        """Return what chi-squared is left with steps of a size once the plain parameters have moved, and a bit more.

        Sizes whose errors are alike differ by less than what moving to first order leaves out.
        """
        change = evidence.change(self.put_in(evidence.chain, values))
        moved = evidence.followed(self.put_in(evidence.chain, values), change)
        again = evidence.change(moved)
        return evidence.left_by(evidence.residual - again)
