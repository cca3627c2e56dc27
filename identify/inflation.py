"""By how much do intervals widen because the residual is larger than noise, or hangs together?"""

from collections.abc import Sequence

import numpy as np

from identify.chain import Chain
from identify.observe import Observation

LENGTHS = (10, 100, 1000)  # samples a sum runs over
ENOUGH = 30  # sums needed to tell their variance


def inflation(chain: Chain, observations: Sequence[Observation]) -> float:
    """Return a factor of at least one on standard deviations.

    The variance of the residual, and of its sums over stretches of several lengths, is compared with that of white
    noise of the known size.
    """
    residuals = [o.used_residual(chain) / o.noise_v for o in observations]
    found = [1.0, float(np.mean(np.square(np.concatenate(residuals))))]
    for length in LENGTHS:
        sums = np.concatenate([r[: r.size // length * length].reshape(-1, length).sum(axis=1) for r in residuals])
        if sums.size >= ENOUGH:
            found.append(float(np.mean(np.square(sums))) / length)
    return float(np.sqrt(max(found)))
