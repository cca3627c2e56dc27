"""How far does a fit come on means of a few readings, in a fraction of the time?

What a rig moves is slow beside its samples: means tell nearly as much, and a search goes most of its way on them. What
it believes to have gained there, all readings must confirm.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.linalg import LinAlgError

from identify.chain import Chain
from identify.fit import Fit, total_chi_squared
from identify.observe import Observation
from identify.thinning import fewest

CONFIRMED = 0.5  # share of what a search gains on means, that all readings must confirm
VISIBLE = 0.1  # of chi-squared: less is not asked about

Search = Callable[[Sequence[Observation]], Fit]


def gone_ahead(chain: Chain, observations: Sequence[Observation], search: Search) -> Fit | None:
    """Return the fit that a ``search`` from a chain finds on means of a few readings, its cost that of all of them.

    None where there are no such means, or where they mislead.
    """
    try:
        with np.errstate(over="ignore", invalid="ignore"):
            few = fewest(chain, observations)
    except (ValueError, ArithmeticError, LinAlgError):
        few = None
    found = search(few) if few else None
    if few is None or found is None or not np.isfinite(found.cost):
        return None
    left, left_of_few = (total_chi_squared(found.chain, seen) for seen in (observations, few))
    believed = total_chi_squared(chain, few) - left_of_few
    confirmed = total_chi_squared(chain, observations) - left
    if believed - confirmed > (1.0 - CONFIRMED) * abs(believed) + VISIBLE:
        return None
    return replace(found, cost=found.cost - left_of_few + left)
