"""How much do readings on coarse steps of an ADC scatter? As much as their levels within a step have them.

Noise ahead of the converter that is small against a step turns readings over where the level is near the edge of one,
and leaves them alone elsewhere. A run whose levels happen to stand near edges leaves several times what another does:
one figure for all takes that for a misfit, or hides physics where there is less.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.chain import Chain
from identify.effects.adc_quantisation import LSB, NOISE, rounded_mean, rounded_sd
from identify.holdout import Split
from identify.noise import Noise
from identify.observe import Observation
from identify.readings.mend import answer
from identify.trace import Array, Trace

COARSE = 0.5  # of a step: noise ahead of the ADC from which on all readings scatter alike, their sd within 1 %
ORIGIN = "the steps of the ADC, and how far noise ahead of them rounds these off"
ENOUGH = 10.0  # readings that noise turns over
PART = 0.01  # of a step, by which levels are moved
KNOWN = 0.02  # share to which their variance is known: physics not found yet moves levels within their steps


@dataclass(frozen=True, eq=False)
class CoarseSteps:
    """What a chain with steps of the ADC in it says of how readings scatter."""

    chain: Chain

    @property
    def lsb_v(self) -> float:
        """Return the step, V."""
        return self.chain.values[LSB.name]

    @property
    def noise_v(self) -> float:
        """Return the rms of the noise ahead of the ADC, V."""
        return self.chain.values[NOISE.name]

    @property
    def shows(self) -> bool:
        """Return whether readings scatter unlike each other."""
        return self.noise_v < COARSE * self.lsb_v

    def of(self, trace: Trace) -> Array:
        """Return the sd of every reading of a recording, V, shape (N,)."""
        return self._sd(self._level(trace))

    def _level(self, trace: Trace) -> Array:
        """Return what comes in at the ADC, V, shape (N,)."""
        return answer(self.chain.with_values({LSB.name: 0.0}), trace, self.lsb_v)

    def _sd(self, level: Array) -> Array:
        """Return the sd of a reading of every level, V."""
        return rounded_sd(level, self.lsb_v, self.noise_v)

    def told(self, data: Split) -> Split | None:
        """Return data with what noise leaves of every run; the noise told is that of those held out.

        None where it turns hardly any readings over: of what it leaves of them nothing can be said.
        """
        levels = [self._level(o.trace)[o.use] for o in data.train]
        train = [np.square(self._sd(level)) for level in levels]
        test = [np.square(self.of(o.trace)[o.use]) for o in data.test]
        if min(float(np.sum(np.concatenate(part))) for part in (train, test)) < ENOUGH * self.lsb_v**2:
            return None
        noise_v2 = self._telling(np.concatenate(levels), np.concatenate(train))
        known = KNOWN**2 + self._chance(np.concatenate(train)) ** 2
        held_out_v, freedom = float(np.sqrt(np.mean(np.concatenate(test)))), min(data.noise.freedom, 2.0 / known)
        return replace(
            data, train=_scattering(data.train, train, noise_v2), test=_scattering(data.test, test, noise_v2),
            noise=Noise(held_out_v, ORIGIN, freedom),
        )  # fmt: skip

    def _telling(self, level: Array, sd_v2: Array) -> float:
        """Return the variance of readings that tell, V^2: each counts as its mean moves with the level.

        Near an edge it moves and noise is large; elsewhere it stands still, and so little noise speaks of nothing.
        """
        moves = rounded_mean(level + PART * self.lsb_v, self.lsb_v, self.noise_v)
        moves -= rounded_mean(level - PART * self.lsb_v, self.lsb_v, self.noise_v)
        return float(np.average(sd_v2, weights=np.square(moves)))

    def _chance(self, sd_v2: Array) -> float:
        """Return by which share chance makes the sum of squares of readings differ, some of which are turned over.

        Of one that is the next step with the probability p, sd^2 = p (1 - p), the square has the variance
        p (1 - p) (1 - 2 p)^2, in steps.
        """
        share = sd_v2 / self.lsb_v**2
        return float(np.sqrt(np.sum(share * np.maximum(1.0 - 4.0 * share, 0.0))) / np.sum(share))


def _scattering(seen: Sequence[Observation], sd_v2: Sequence[Array], noise_v2: float) -> tuple[Observation, ...]:
    """Return observations of one noise of which every run is told how much that leaves."""
    pairs = zip(seen, sd_v2, strict=True)
    noise_v = float(np.sqrt(noise_v2))
    return tuple(replace(o, noise_v=noise_v, scatter=float(np.mean(each)) / noise_v2) for o, each in pairs)
