"""Which few numbers, had they alone changed, account for all that changed - and which others would do as well?

Errors within a fit hang together: one part that changed moves several numbers, and a number by itself may seem to have
stayed. To first order, with the covariance of both sides, the change left when some numbers are free to differ is a
chi-squared; numbers are freed one by one, the one that explains most first.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from identify.identification import Identification
from identify.interval import number
from identify.trace import Array

LEFT = 0.05  # p-value from which what is left counts as chance
AS_WELL = 3.84  # of chi-squared, by which another number may account for less and still not be excluded
ROUNDING = 1e-13  # relative variance that is nothing but rounding
MOST = 4  # numbers freed; a change that takes more is one of everything


@dataclass(frozen=True)
class Account:
    """Numbers whose change accounts for all of it; ``instead`` are such as could each take the place of the first.

    ``left_p`` is how often chance leaves as much as they do; below ``LEFT`` they do not account for all.
    """

    names: tuple[str, ...]
    left_p: float
    instead: tuple[str, ...] = ()

    @property
    def is_whole(self) -> bool:
        """Return whether nothing but chance is left."""
        return self.left_p >= LEFT

    def to_dict(self) -> dict[str, object]:
        """Return the form of ``rig compare --json``."""
        return {"names": list(self.names), "all_of_it": self.is_whole, "left_p": number(self.left_p, 3),
                "instead": list(self.instead)}  # fmt: skip


@dataclass(frozen=True)
class Moved:
    """How far named numbers moved, the size of each, and the covariance of the move; all in standard deviations."""

    names: tuple[str, ...]
    by: Array
    size: Array
    covariance: NDArray[np.float64]

    def left(self, freed: Sequence[str]) -> float:
        """Return the chi-squared of the change that is left when ``freed`` may differ as they like."""
        return self.left_along(np.eye(len(self.names))[:, [self.names.index(name) for name in freed]])

    def left_along(self, directions: NDArray[np.float64]) -> float:
        """Return the chi-squared that is left when it may also go along ``directions``, shape (names, m)."""
        curvatures, axes = np.linalg.eigh(self.covariance)
        white = (axes / np.sqrt(np.maximum(curvatures, ROUNDING * curvatures[-1]))).T
        wanted, ways = white @ self.by, white @ directions
        if ways.shape[1]:
            wanted = wanted - ways @ np.linalg.lstsq(ways, wanted, rcond=None)[0]
        return float(wanted @ wanted)


def moved(before: Identification, after: Identification, names: tuple[str, ...]) -> Moved:
    """Return by how much the named numbers differ."""
    by, size, covariance = np.zeros(len(names)), np.zeros(len(names)), np.zeros((len(names), len(names)))
    for sign, found in ((-1.0, before), (1.0, after)):
        assert found.certainty is not None
        at = [found.certainty.names.index(name) for name in names]
        values = np.array([found.certainty.values[name] for name in names])
        by, size = by + sign * values, size + 0.5 * values
        covariance += found.certainty.covariance[np.ix_(at, at)]
    sd = np.sqrt(np.diag(covariance))
    return Moved(names, by / sd, size / sd, covariance / np.outer(sd, sd))


def accounted(change: Moved) -> Account:
    """Return the fewest numbers, up to ``MOST``, whose change accounts for the rest."""
    freed: tuple[str, ...] = ()
    left_p = _chance(change, freed)
    while left_p < LEFT and len(freed) < min(MOST, len(change.names)):
        rest = [name for name in change.names if name not in freed]
        freed = (*freed, min(rest, key=lambda name: change.left((*freed, name))))
        left_p = _chance(change, freed)
    return Account(freed, left_p, _instead(change, freed))


def _chance(change: Moved, freed: tuple[str, ...]) -> float:
    held = len(change.names) - len(freed)
    return float(chi2.sf(change.left(freed), held)) if held else 1.0


def _instead(change: Moved, freed: tuple[str, ...]) -> tuple[str, ...]:
    """Return what could take the place of the first number freed, the best first."""
    if not freed:
        return ()
    most = change.left(freed) + AS_WELL
    found = {name: change.left((name, *freed[1:])) for name in change.names if name not in freed}
    return tuple(sorted((name for name, left in found.items() if left < most), key=lambda name: found[name]))
