"""Which set of effects explains the residual, with no more in it than the data ask for?

Forward selection, then backward deletion. Each round screens every effect by what it would leave to first order, fits
the most promising ones jointly with the plain parameters, and takes the best if it pays for its parameters.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import log

import numpy as np

from identify.chain import Chain
from identify.effects.effect import Effect, short
from identify.evidence import Candidate, Evidence, candidates
from identify.fit import Fit, chi_squared, fit
from identify.observe import Observation

MOST_EFFECTS = 4
FITTED_A_ROUND = 5
PROMISING = 0.2  # share of the best promise below which a candidate is not fitted
QUICK, PATIENT = 12, 40  # iterations of a fit that is compared, and of one that is kept

Note = Callable[[str, float], None]


@dataclass(frozen=True)
class Hypothesis:
    """A set of effects, fitted: ``chi2`` is the sum of squared residuals over the noise, without the prior."""

    effects: tuple[Effect, ...]
    fit: Fit
    chi2: float
    count: int

    @property
    def parameters(self) -> int:
        """Return how many numbers were searched."""
        return len(self.fit.coordinates)

    @property
    def spread(self) -> float:
        """Return the residual variance over the noise's, at least one."""
        return max(self.chi2 / self.count, 1.0)

    @property
    def names(self) -> tuple[str, ...]:
        """Return the ids."""
        return tuple(effect.id for effect in self.effects)

    def price(self, other: "Hypothesis") -> float:
        """Return what Schwarz's criterion asks chi-squared to fall by for the parameters this one has more."""
        return (self.parameters - other.parameters) * log(self.count)

    def better_than(self, other: "Hypothesis") -> bool:
        """Return whether this hypothesis pays for its parameters; misfit that remains counts as noise."""
        return self.advantage(other) > 0.0

    def advantage(self, other: "Hypothesis") -> float:
        """Return by how much the criterion prefers this hypothesis (twice a log posterior odds)."""
        return (other.chi2 - self.chi2) / min(self.spread, other.spread) - self.price(other)


@dataclass(frozen=True)
class Bench:
    """The data and the plain chain all hypotheses are built on."""

    plain: Chain
    observations: tuple[Observation, ...]
    fixed: tuple[str, ...]
    kinds: tuple[type[Effect], ...]

    def fitted(self, chain: Chain, effects: Sequence[Effect], iterations: int = PATIENT) -> Hypothesis:
        """Fit a chain from its own values, with the priors of the plain parameters at the rig file's."""
        found = fit(chain, self.observations, self.plain.values, self.fixed, iterations)
        chi2 = sum(chi_squared(found.chain, o) for o in self.observations)
        return Hypothesis(tuple(effects), found, chi2, sum(o.count for o in self.observations))

    def with_effects(self, effects: Sequence[Effect], values: Mapping[str, float]) -> Chain:
        """Return the plain chain with ``effects`` in it and every value that ``values`` knows by full name."""
        chain = self.plain
        for effect in effects:
            chain = effect.put_in(chain, {})
        known = {k: v for k, v in values.items() if k.partition("[")[0] in chain.values}
        return chain.with_values(known)

    def rounds(self, start: Hypothesis, note: Note) -> list["Round"]:
        """Add effects one by one while each pays for itself; return what every round considered."""
        found: list[Round] = []
        best = start
        for number in range(MOST_EFFECTS):
            note(f"screening effects, round {number + 1}", 0.2 + 0.15 * number)
            this = self.round(best)
            found.append(this)
            if this.best is None:
                break
            best = this.best
        return found

    def round(self, base: Hypothesis) -> "Round":
        """Screen all effects on the residual of ``base`` and fit those that promise most."""
        evidence = Evidence(base.fit, self.observations)
        screened = candidates(evidence, self.kinds)
        tried = [self.extended(base, candidate) for candidate in promising(screened, base)]
        return Round(base, tuple(screened), tuple(sorted(tried, key=lambda h: -h.advantage(base))))

    def extended(self, base: Hypothesis, candidate: Candidate) -> Hypothesis:
        """Fit ``base`` with one more effect."""
        chain = candidate.effect.put_in(base.fit.chain, candidate.values)
        return self.fitted(chain, (*base.effects, candidate.effect))

    def pruned(self, hypothesis: Hypothesis) -> Hypothesis:
        """Drop effects that no longer pay for themselves beside the others, the weakest first."""
        while len(hypothesis.effects) > 1:
            without = [self.without(hypothesis, effect) for effect in hypothesis.effects]
            best = max(without, key=lambda h: h.advantage(hypothesis))
            if best.advantage(hypothesis) < 0.0:
                break
            hypothesis = best
        return hypothesis

    def without(self, hypothesis: Hypothesis, effect: Effect) -> Hypothesis:
        """Fit ``hypothesis`` less one effect."""
        rest = tuple(e for e in hypothesis.effects if e is not effect)
        return self.fitted(self.with_effects(rest, hypothesis.fit.chain.values), rest)


@dataclass(frozen=True)
class Round:
    """One step of the selection: what was screened, what was fitted, best first."""

    base: Hypothesis
    screened: tuple[Candidate, ...]
    tried: tuple[Hypothesis, ...]

    @property
    def best(self) -> Hypothesis | None:
        """Return the hypothesis that wins the round, None when none pays for itself."""
        return self.tried[0] if self.tried and self.tried[0].better_than(self.base) else None


def promising(screened: Sequence[Candidate], base: Hypothesis) -> list[Candidate]:
    """Return what is worth a fit: the best form of every effect at every place, among those that promise most."""
    floor = log(base.count) * base.spread
    best = max((c.gain for c in screened), default=0.0)
    kept: list[Candidate] = []
    for candidate in screened:
        same = [c for c in kept if (c.effect.id, c.effect.place) == (candidate.effect.id, candidate.effect.place)]
        rivals = [c for c in same if candidate.gain > 0.9 * c.gain and len(c.values) != len(candidate.values)]
        if candidate.gain > max(floor, PROMISING * best) and len(same) < 1 + len(rivals):
            kept.append(candidate)
    return kept[:FITTED_A_ROUND]


def values_of(effect: Effect, chain: Chain) -> dict[str, float]:
    """Return an effect's values in a chain, by short name."""
    return {short(p.name): float(np.asarray(chain.values[p.name])) for p in effect.parameters()}
