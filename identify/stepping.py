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
LITTLE = 1.0  # standard deviations of a matched test that a grid may leave out of an answer for its slopes to be right
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
    return _sharpened(found, bare, observations, fixed)


def _sharpened(
    found: Fit, bare: tuple[Observation, ...], observations: tuple[Observation, ...], fixed: Sequence[str]
) -> tuple[tuple[Observation, ...], Fit]:
    """Return the fit once more with slopes of a finer grid, where the samples' own is too coarse for them.

    What is put back once makes the answer right, not its slopes: values that the data hardly tell move far for little,
    and with them what the grid leaves out. A fit with slopes off by much scatters more than it need and says less.
    """
    finer = tuple(_fine_enough(o, found.chain) for o in observations)
    if all(one.substeps == other.substeps for one, other in zip(finer, bare, strict=True)):
        return observations, found
    centre = {c.name: c.centre for c in found.coordinates}
    return finer, fit(found.chain, finer, centre, fixed, ITERATIONS)


def _fine_enough(observation: Observation, chain: Chain) -> Observation:
    """Return the observation on the coarsest grid that leaves out little, with what that is."""
    while observation.left_out is not None and observation.substeps < FINEST:
        left_out = observation.left_out[observation.use].astype(np.float64)
        if float(left_out @ left_out) < LITTLE**2:
            break
        finer = replace(observation, substeps=2 * observation.substeps, left_out=None)
        observation = corrected(finer, chain)
    return observation


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
