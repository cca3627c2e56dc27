"""Where in its period did something run-specific, such as the mains, stand when each run began?

A phase has several local minima of the residual, so it is first looked for all around the circle, run by run.
"""

from collections.abc import Sequence

import numpy as np

from identify.chain import Chain, local_name
from identify.fit import chi_squared, total_chi_squared
from identify.observe import Observation
from identify.stage import Parameter

STARTS = 12  # phases tried around the circle
TURNED = 10.0  # of chi-squared of a run: a turn that explains less more is no other


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
    return min(options, key=lambda option: total_chi_squared(option, observations))


def turned_sines(chain: Chain, observations: Sequence[Observation], names: Sequence[str]) -> Chain:
    """Return a chain whose sine and cosine, the two local values of ``names``, are turned where that explains more.

    A gap passes on what pushes it and keeps the rest: of a run that rests on plateaus only peaks show, and a fit that
    begins at another turn, small, stays there. What goes on in all runs has one size: that is tried at turns of each.
    """
    pairs = [[local_name(name, o.trace.name) for name in names] for o in observations]
    size = float(np.median([np.linalg.norm([chain.values[name] for name in pair]) for pair in pairs]))
    angles = np.linspace(0.0, 2.0 * np.pi, STARTS, endpoint=False).tolist()
    for pair, o in zip(pairs, observations, strict=True):
        turns = [dict(zip(pair, (size * np.cos(a), size * np.sin(a)), strict=True)) for a in angles]
        best = min((chain.with_values(turn) for turn in turns), key=lambda c: chi_squared(c, o))
        chain = best if chi_squared(best, o) < chi_squared(chain, o) - TURNED else chain
    return chain
