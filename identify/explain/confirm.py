"""Does a model hold on data used neither for fitting nor for choosing?"""

from collections.abc import Sequence

import numpy as np

from identify.chain import Chain, local_name
from identify.fit import fit
from identify.observe import Observation, pooled_rms
from identify.phases import scanned

BLOCKS = 40  # stretches over which differences of squared residuals are averaged
CONVINCING = 3.0  # standard errors by which a model must be better on held-out data


def adapted(chain: Chain, observations: Sequence[Observation]) -> Chain:
    """Return the chain with local values, such as the phase of the mains, fitted to runs it has not seen.

    All shared parameters stay as they are; a run seen before keeps its values.
    """
    names = [p.name for p in chain.parameters() if p.local]
    new = [o for o in observations if names and local_name(names[0], o.trace.name) not in chain.values]
    shared = [p.name for p in chain.parameters() if not p.local]
    for observation in new:
        chain = fit(scanned(chain, [observation], shared=False), [observation], fixed=shared).chain
    return chain


def held_out_rms(chain: Chain, observations: Sequence[Observation]) -> float:
    """Return the residual rms in V on held-out data."""
    return pooled_rms([o.used_residual(chain) for o in observations])


def improvement(better: Chain, worse: Chain, observations: Sequence[Observation]) -> float:
    """Return by how many standard errors ``better`` has the smaller sum of squared residuals on held-out data.

    With d the difference of the two answers and r the better one's residual, the fall is sum(d^2 + 2 r d); chance
    enters through r d alone, whose sums over stretches also count what hangs together in r.
    """
    fall, chance, white = 0.0, 0.0, 0.0
    total = sum(o.count for o in observations)
    for o in observations:
        r = o.used_residual(better)
        d = o.used_residual(worse) - r
        pieces = max(2, round(BLOCKS * o.count / total))
        fall += float(np.sum(d * (d + 2.0 * r)))
        chance += float(sum(np.sum(piece) ** 2 for piece in np.array_split(r * d, pieces)))
        white += float(np.sum(np.square(d))) * o.noise_v**2
    error = 2.0 * float(np.sqrt(max(chance, white)))
    return fall / error if error > 0.0 else 0.0
