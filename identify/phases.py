"""Where in its period did something run-specific, such as the mains, stand when each run began?

A phase has several local minima of the residual, so it is first looked for all around the circle, run by run.
"""

from collections.abc import Sequence

import numpy as np

from identify.chain import Chain, local_name
from identify.fit import chi_squared
from identify.observe import Observation
from identify.stage import Parameter

STARTS = 12  # phases tried around the circle


def angles_of(parameters: Sequence[Parameter]) -> list[Parameter]:
    """Return those parameters that are angles."""
    return [p for p in parameters if p.unit == "rad"]


def scanned(chain: Chain, observations: Sequence[Observation], angles: Sequence[Parameter]) -> Chain:
    """Return the chain with every one of its angles where the residual is smallest among the present and a few others.

    Angles that all runs share are tried on all runs, angles of single runs on their own. The chain itself is returned
    when none moves.
    """
    for parameter in angles:
        if not parameter.local:
            chain = _around(chain, parameter.name, chain.values[parameter.name], observations)
            continue
        for observation in observations:
            name = local_name(parameter.name, observation.trace.name)
            chain = _around(chain, name, chain.values.get(name, chain.values[parameter.name]), [observation])
    return chain


def _around(chain: Chain, name: str, here: float, observations: Sequence[Observation]) -> Chain:
    """Return the chain with one angle at the best of a few values."""
    angles = here + np.linspace(0.0, 2.0 * np.pi, STARTS, endpoint=False)[1:]
    options = [chain, *(chain.with_values({name: float(angle)}) for angle in angles)]
    return min(options, key=lambda option: sum(chi_squared(option, o) for o in observations))
