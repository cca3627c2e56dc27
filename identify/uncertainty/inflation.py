"""By how much do intervals widen because the residual is larger than noise, or hangs together?"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from identify.chain import Chain
from identify.observe import Observation
from identify.trace import regrouped

LENGTHS = (1, 10, 100, 1000)  # samples a sum runs over
TOGETHER = 1_000_000  # samples taken at once: a multiple of every length
ENOUGH = 30  # sums needed to tell their variance
FALSE_ALARMS = 1e-3  # share of good models whose intervals are widened for nothing


def inflation(chain: Chain, observations: Sequence[Observation], freedom: float = float("inf")) -> float:
    """Return a factor of at least one on standard deviations.

    The variance of the residual, and of its sums over stretches of several lengths, is compared with that of white
    noise of the known size; coloured noise is made white first. It counts where it is larger than chance makes it:
    chance in the residual, and in the noise's own size, known as well as ``freedom`` readings tell it. The largest of
    several scattering ratios is above one for the best of models, and would widen every interval.
    """
    totals, counts = dict.fromkeys(LENGTHS, 0.0), dict.fromkeys(LENGTHS, 0)
    for observation in observations:
        for residual in regrouped(observation.whitened(chain), TOGETHER):
            for length in LENGTHS:
                whole = residual[: residual.size // length * length].reshape(-1, length)
                sums = whole.sum(axis=1)
                totals[length] += float(sums @ sums)
                counts[length] += sums.size
    ratios = [_excess(totals[n] / n, counts[n], freedom) for n in LENGTHS if counts[n] >= ENOUGH or n == 1]
    return float(np.sqrt(max(1.0, *ratios)))


def _excess(total: float, count: int, freedom: float) -> float:
    """Return the ratio of a sum of ``count`` squares to its expectation, one where chance explains it."""
    if count == 0:
        return 1.0
    independent = 1.0 / (1.0 / count + 1.0 / freedom)
    most = float(chi2.ppf(1.0 - FALSE_ALARMS / len(LENGTHS), independent)) / independent
    return total / count if total / count > most else 1.0
