"""By how much do intervals widen because the residual is larger than noise, or hangs together?"""

from collections.abc import Sequence

import numpy as np

from identify.chain import Chain
from identify.observe import Observation
from identify.trace import regrouped

LENGTHS = (1, 10, 100, 1000)  # samples a sum runs over
TOGETHER = 1_000_000  # samples taken at once: a multiple of every length
ENOUGH = 30  # sums needed to tell their variance


def inflation(chain: Chain, observations: Sequence[Observation]) -> float:
    """Return a factor of at least one on standard deviations.

    The variance of the residual, and of its sums over stretches of several lengths, is compared with that of white
    noise of the known size.
    """
    totals, counts = dict.fromkeys(LENGTHS, 0.0), dict.fromkeys(LENGTHS, 0)
    for observation in observations:
        for residual in regrouped(observation.misfits(chain), TOGETHER):
            for length in LENGTHS:
                whole = residual[: residual.size // length * length].reshape(-1, length)
                sums = whole.sum(axis=1) / observation.noise_v
                totals[length] += float(sums @ sums)
                counts[length] += sums.size
    ratios = (totals[n] / counts[n] / n for n in LENGTHS if counts[n] >= ENOUGH or n == 1)
    return float(np.sqrt(max(1.0, *ratios)))
