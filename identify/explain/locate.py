"""At which stage, and along which coordinate, does what the chain cannot explain enter?"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np
from scipy.stats import chi2 as chi2_distribution

from identify.derivatives.sensitivities import DIFFERENCE
from identify.evidence import Evidence
from identify.explain.corrections import Correction, corrections
from identify.explain.select import Bench, Hypothesis
from identify.stage import Place

ITERATIONS = 10  # a correction is nearly linear in its weights
FITTED = 4  # corrections that are fitted; the others are judged to first order
TIE = 0.97  # a correction that explains this much of what the best one does cannot be excluded


@dataclass(frozen=True)
class Suspect:
    """A correction and the fall of chi-squared it promises to first order, with its number of weights."""

    correction: Correction
    gain: float
    weights: int

    @property
    def p_value(self) -> float:
        """Return the probability of such a gain from noise alone."""
        return float(chi2_distribution.sf(max(self.gain, 0.0), self.weights))

    def advantage(self, count: int) -> float:
        """Return the gain less Schwarz's price."""
        return self.gain - self.weights * log(count)


@dataclass(frozen=True)
class Located:
    """The corrections that explain most, fitted, best first, and the misfit without them."""

    base: Hypothesis
    fitted: tuple[tuple[Correction, Hypothesis], ...]
    p_value: float

    @property
    def significant(self) -> bool:
        """Return whether some correction pays for its weights: something is there."""
        return bool(self.fitted) and self.fitted[0][1].advantage(self.base) > 0.0

    @property
    def best(self) -> Correction:
        """Return the correction that explains most."""
        return self.fitted[0][0]

    @property
    def share(self) -> float:
        """Return which share of the misfit the best correction explains."""
        return self.fitted[0][1].share(self.base)

    def alternatives(self) -> tuple[Place, ...]:
        """Return the other places whose corrections explain nearly as much."""
        floor = TIE * self.share
        places = [c.place for c, h in self.fitted[1:] if h.share(self.base) > floor and c.place != self.best.place]
        return tuple(dict.fromkeys(places))

    def share_at(self, place: Place) -> float:
        """Return the share of the misfit that the best correction at a place explains; 0 when none was fitted."""
        return max((h.share(self.base) for c, h in self.fitted if c.place == place), default=0.0)


def suspects(evidence: Evidence) -> list[Suspect]:
    """Return every correction with its promise to first order, the most telling first."""
    found = []
    for correction in corrections(evidence):
        gain, weights = _promise(evidence, correction)
        found.append(Suspect(correction, gain, weights))
    return sorted(found, key=lambda s: -s.advantage(evidence.residual.size))


def _promise(evidence: Evidence, correction: Correction) -> tuple[float, int]:
    """Return how far chi-squared falls when all weights of a correction and the plain parameters move together."""
    chain = correction.put_in(evidence.chain)
    names = [p.name for p in correction.parameters()]
    step = evidence.observations[0].noise_v
    columns = np.array([evidence.change(chain.with_values({name: step})) for name in names])
    if any(p.local for p in correction.parameters()):
        columns = np.concatenate([np.where(mask, columns, 0.0) for mask in evidence.masks])
    columns = columns[np.any(np.abs(columns) > DIFFERENCE, axis=1)]
    if columns.size == 0 or not np.all(np.isfinite(columns)):
        return 0.0, 1
    free = evidence.without_plain(columns)
    matrix, right = free @ free.T, free @ evidence.without_plain(evidence.residual[None, :])[0]
    solution = np.linalg.pinv(matrix, rcond=1e-9, hermitian=True) @ right
    return float(right @ solution), len(columns)


def located(bench: Bench, base: Hypothesis) -> Located:
    """Fit the corrections that promise most on top of a hypothesis."""
    evidence = Evidence(base.fit, bench.observations)
    ranked = suspects(evidence)
    p_value = min((len(ranked) * s.p_value for s in ranked), default=1.0)
    worth = [s.correction for s in ranked if s.advantage(base.count) > 0.0][:FITTED]
    fitted = [(c, bench.fitted(c.put_in(base.fit.chain), base.effects, ITERATIONS)) for c in worth]
    return Located(base, tuple(_by_misfit(fitted)), min(p_value, 1.0))


def _by_misfit(fitted: Sequence[tuple[Correction, Hypothesis]]) -> list[tuple[Correction, Hypothesis]]:
    """Return the fitted corrections by Schwarz's criterion."""
    return sorted(fitted, key=lambda pair: pair[1].count * log(pair[1].chi2) + pair[1].parameters * log(pair[1].count))
