"""Which effects of the catalogue may explain a residual, and from which values would each be searched?"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.effects.effect import Effect
from identify.evidence import Evidence


@dataclass(frozen=True)
class Candidate:
    """An effect with the values a search may begin from, and what speaks for them: a fall of chi-squared."""

    effect: Effect
    values: Mapping[str, float]
    gain: float


def candidates(evidence: Evidence, kinds: Sequence[type[Effect]]) -> list[Candidate]:
    """Return every applicable effect at its best start, those that promise most first."""
    found: list[Candidate] = []
    for kind in kinds:
        for effect in (one.told_apart(evidence.chain) for one in kind.variants()):
            if effect.applicable(evidence.chain):
                seen = evidence.seen_by(effect)
                starts = evidence_starts(seen if effect.quick else seen.coarse, effect)
                found += [Candidate(effect, values, seen.merit(effect, values)) for values in starts]
    return sorted((c for c in found if np.isfinite(c.gain)), key=lambda c: -c.gain)


def evidence_starts(evidence: Evidence, effect: Effect) -> list[dict[str, float]]:
    """Return an effect's starts; an effect that cannot be computed with these data has none."""
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        return [start for start in effect.starts(evidence) if start]
