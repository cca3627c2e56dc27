"""Where in its period did something run-specific, such as the mains, stand when each run began?

A phase has several local minima of the residual, so it is first looked for all around the circle, run by run.
"""

from collections.abc import Sequence

import numpy as np

from identify.chain import Chain, local_name
from identify.fit import chi_squared
from identify.observe import Observation

STARTS = 12  # phases tried around the circle


def scanned(chain: Chain, observations: Sequence[Observation]) -> Chain:
    """Return the chain with the phase of every run where the residual is smallest among the present and a few others."""
    names = [p.name for p in chain.parameters() if p.local and p.unit == "rad"]
    for observation in observations:
        for name in names:
            chain = _around(chain, local_name(name, observation.trace.name), name, observation)
    return chain


def _around(chain: Chain, name: str, shared: str, observation: Observation) -> Chain:
    """Return the chain with one run's phase at the best of a few angles."""
    here = chain.values.get(name, chain.values[shared])
    angles = here + np.linspace(0.0, 2.0 * np.pi, STARTS, endpoint=False)
    options = [chain, *(chain.with_values({name: float(angle)}) for angle in angles[1:])]
    return min(options, key=lambda option: chi_squared(option, observation))
