"""What does stepping on the grid of the samples leave out of an answer, and how is it put back?

Between instants w is taken as straight, and a pole faster than a step is met with one step only; little as that errs, a
long run shows it. What a fine grid adds to an answer hardly depends on the values of a chain near its optimum: it is
measured once and taken from the readings, so that all that is done again and again is done on the samples' own grid.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import log2, sqrt

import numpy as np

from identify.chain import CHUNK, Chain, answered
from identify.fit import Fit, fit
from identify.observe import FINEST, LARGEST, SEEN, Observation
from identify.trace import Array

ROUNDS = 3  # of measuring what is left out and fitting again, at most
STAYED = 2.0  # how far a fit may move, in sd of its residual: a twentieth of that is what the left out changes by
ITERATIONS = 100  # of a fit in a round


def settled(
    found: Fit, observations: tuple[Observation, ...], fixed: Sequence[str]
) -> tuple[tuple[Observation, ...], Fit]:
    """Return a fit on the samples' grid made as good as on a fine one, and the observations with what that one adds.

    Where the fit moves, what is left out moves by a small part of that: few rounds settle both.
    """
    centre, bare = {c.name: c.centre for c in found.coordinates}, observations
    for _ in range(ROUNDS if np.isfinite(found.cost) else 0):
        observations = bare  # what was left out before is let go
        observations = tuple(corrected(o, found.chain) for o in bare)
        before, found = found, fit(found.chain, observations, centre, fixed, ITERATIONS)
        if found.distance(before) < STAYED * sqrt(max(found.cost / max(sum(o.count for o in bare), 1), 1.0)):
            break
    return observations, found


def corrected(observation: Observation, chain: Chain) -> Observation:
    """Return the observation with what its grid leaves out of the answer of ``chain``; without where nobody sees it."""
    finest = min(FINEST, 1 << max(int(log2(LARGEST / observation.trace.size)), 1))
    left_out, total = np.empty(observation.trace.size, dtype=np.float16), 0.0
    for at, added in _added(observation, chain, finest):
        left_out[at] = added / observation.noise_v
        total += float(np.sum(np.square(added[observation.use[at]])))
    return replace(observation, left_out=left_out if sqrt(total) > SEEN * observation.noise_v else None)


def _added(observation: Observation, chain: Chain, substeps: int) -> Iterator[tuple[slice, Array]]:
    """Yield what a finer grid adds to the answer, V, stretch by stretch, and which samples each is of."""
    grids = (observation.substeps, substeps)
    answers = (answered(chain, observation.trace, n, CHUNK // substeps) for n in grids)
    first = 0
    for coarse, fine in zip(*answers, strict=True):
        yield slice(first, first + coarse.size), fine - coarse
        first += coarse.size
