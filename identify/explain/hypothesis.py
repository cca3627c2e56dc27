"""How well does a set of effects, fitted, explain the recordings, and is it more than chance?"""

from collections import Counter
from dataclasses import dataclass
from math import log

from scipy.stats import chi2 as chi2_distribution

from identify.effects.effect import Effect
from identify.fit import Fit
from identify.observe import Observation

FALSE_DISCOVERIES = 0.01  # share of findings on the training data that may be chance
WORTH = 0.2  # share of a misfit beyond the noise an effect must explain: less is what any wrong effect absorbs
NOISE_KNOWN = 0.01  # how well the noise's variance is known at best; misfit below this is not told from noise
LEAST_TOLD = 10.0
STRONG = 10.0  # of twice a log of odds: very strong evidence (Kass and Raftery, J. Am. Stat. Assoc. 90 (1995) 773)
BENT = 3.0  # times what the slope where a fit was left promises that it may still gain: valleys are bent


@dataclass(frozen=True)
class Hypothesis:
    """A set of effects, fitted: ``chi2`` is the sum of squared residuals over the noise, without the prior.

    ``noise_known`` is how well the variance of that noise is known, relative to it. What effects make by chance is not
    in ``chi2``; it hangs together, and the variance of a sum over readings is ``swell`` times that of the noise alone.
    ``data`` are those it was fitted to, on their grids.
    """

    effects: tuple[Effect, ...]
    fit: Fit
    chi2: float
    count: int
    noise_known: float = NOISE_KNOWN
    swell: float = 1.0
    data: tuple[Observation, ...] = ()

    @property
    def parameters(self) -> int:
        """Return how many numbers were searched."""
        return len(self.fit.coordinates)

    @property
    def hope(self) -> float:
        """Return by how much chi-squared may still fall where the fit was left, by its slope there."""
        return BENT * self.fit.beyond

    @property
    def misfit(self) -> float:
        """Return the residual variance over the noise's, less one: what noise does not account for."""
        return self.chi2 / self.count - 1.0

    @property
    def names(self) -> tuple[str, ...]:
        """Return what the effects are called in a chain."""
        return tuple(effect.name for effect in self.effects)

    def effects_with(self, law: Effect, in_place_of: Effect) -> tuple[Effect, ...]:
        """Return the effects with ``law`` in the place of one of them."""
        return tuple(law if effect is in_place_of else effect for effect in self.effects)

    def advantage(self, other: "Hypothesis", information: float | None = None) -> float:
        """Return by how much Schwarz's criterion prefers this hypothesis: twice a log of posterior odds.

        The residual variance is taken as unknown, so that what neither hypothesis explains counts as noise. A
        parameter costs the log of what the data tell about it: of every sample, or of ``information``, the square of
        how many standard deviations a mismatch stands out, where hypotheses explain the same mismatch.
        """
        told = float(self.count) if information is None else min(max(information, LEAST_TOLD), float(self.count))
        return self.fall(other) - (self.parameters - other.parameters) * log(told)

    def fall(self, other: "Hypothesis") -> float:
        """Return the fall of chi-squared from another hypothesis, what neither explains counted as noise.

        Where both have the same chance in them, so that what it makes is noise to what else they differ in.
        """
        return self.count * log(other.chi2 / self.chi2) / min(self.swell, other.swell)

    @property
    def freedom(self) -> int:
        """Return how many numbers noise alone could use: the plain ones searched, and those of the effects."""
        searched = Counter(c.parameter.name for c in self.fit.coordinates)
        mine = {p.name for effect in self.effects for p in effect.parameters()}
        runs = max(searched.values(), default=1)
        return sum(name not in mine for name in searched) + sum(effect.freedom(runs) for effect in self.effects)

    def p_value(self, other: "Hypothesis") -> float:
        """Return how likely noise alone would let chi-squared fall so far from a hypothesis with less in it."""
        return float(chi2_distribution.sf(max(self.fall(other), 0.0), max(self.freedom - other.freedom, 1)))

    @property
    def proven(self) -> float:
        """Return by how much chi-squared is above what noise may make, whose variance is known to ``noise_known``."""
        return proven(self.chi2, self.count, self.noise_known)

    def gains_enough(self, other: "Hypothesis", share: float = WORTH) -> bool:
        """Return whether chi-squared falls by more than what a wrong effect takes of a misfit that is not its own.

        A misfit that may be noise has no share worth asking for.
        """
        return other.chi2 - self.chi2 > share * other.proven

    def share(self, other: "Hypothesis") -> float:
        """Return which share of what ``other`` leaves beyond the noise this hypothesis explains."""
        return (other.chi2 - self.chi2) / max(other.chi2 - other.count, other.noise_known * other.count)


def proven(chi2: float, count: int, noise_known: float) -> float:
    """Return by how much chi-squared of so many readings is above what noise may make, 0 where it is not."""
    return max(chi2 - (1.0 + 2.0 * noise_known) * count, 0.0)


def is_discovery(p_value: float, tried: int) -> bool:
    """Return whether the best of so many tests, however they depend on each other, is no false discovery.

    Benjamini and Yekutieli, Annals of Statistics 29 (2001) 1165: tests of one library are far from independent.
    """
    return p_value * tried * sum(1.0 / k for k in range(1, tried + 1)) <= FALSE_DISCOVERIES
