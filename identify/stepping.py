"""What does stepping on the grid of the samples leave out of an answer, and how is it put back?

Between instants w is taken as straight, and a pole faster than a step is met with one step only; little as that errs, a
long run shows it. What a fine grid adds to an answer hardly depends on the values of a chain near its optimum, as long
as the coarse one shows what the values do: it is measured once and taken from the readings, so that all that is done
again and again is done on a coarse grid, the samples' own where that shows it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import log2, sqrt

import numpy as np

from identify.chain import Chain, answered, samples_at_once
from identify.derivatives.sensitivities import sensitivities
from identify.discretise import Matrix
from identify.fit import Fit, fit
from identify.observe import FINEST, LARGEST, Observation
from identify.quadratic import resolved
from identify.trace import Array

ROUNDS = 3  # of measuring what is left out and fitting again, at most
STAYED = 2.0  # how far a fit may move, in sd of its residual: a twentieth of that is what the left out changes by
ITERATIONS = 100  # of a fit in a round
MOVED = 0.3  # standard deviations of a matched test by which what is left out may differ and still be alike
SEEN = 0.1  # sd of a matched test that stepping may be wrong by: errors of several runs may pull a value the same way
SHOWN = 0.1  # share of what is told of any combination of values that half the step may add or take away
TOLD = 0.3  # search coordinates; worse is told by no curvature (uncertainty.profile) and asks for no finer grid


def settled(
    found: Fit, observations: tuple[Observation, ...], fixed: Sequence[str]
) -> tuple[tuple[Observation, ...], Fit]:
    """Return a fit on a coarse grid made as good as on a fine one, and the observations with what that one adds.

    Where the fit moves, what is left out moves by a small part of that: few rounds settle both.
    """
    centre = {c.name: c.centre for c in found.coordinates}
    bare = observations = shown(found, observations) if np.isfinite(found.cost) else observations
    for _ in range(ROUNDS if np.isfinite(found.cost) else 0):
        observations = bare  # what was left out before is let go
        observations = tuple(corrected(o, found.chain) for o in bare)
        before, found = found, fit(found.chain, observations, centre, fixed, ITERATIONS)
        if found.distance(before) < STAYED * sqrt(max(found.cost / max(sum(o.count for o in bare), 1), 1.0)):
            break
    return observations, found


def shown(found: Fit, observations: tuple[Observation, ...]) -> tuple[Observation, ...]:
    """Return the observations on grids that show what the values of a fit do to the answer.

    A grid is made finer until the Fisher information on half its step is the same: what the corrections of later rounds
    leave, and how wrong the fit's intervals are, is of the order of the difference.
    """
    seen = tuple(replace(o, left_out=None) for o in observations)
    told = [_told(found, o) for o in seen]
    while True:
        finer = tuple(replace(o, substeps=2 * o.substeps) if _may_be_finer(o) else o for o in seen)
        better = [old if o is f else _told(found, f) for o, f, old in zip(seen, finer, told, strict=True)]
        changes = _changes(found, told, better)
        if sum(changes) <= SHOWN:
            return seen
        wanted = [change > SHOWN / len(seen) for change in changes]
        seen = tuple(f if want else o for o, f, want in zip(seen, finer, wanted, strict=True))
        told = [new if want else old for old, new, want in zip(told, better, wanted, strict=True)]


def _may_be_finer(observation: Observation) -> bool:
    """Return whether half the step is a grid that still fits in memory and patience."""
    return 2 * observation.substeps <= FINEST and 2 * observation.substeps * observation.trace.size <= LARGEST


def _told(found: Fit, observation: Observation) -> Matrix:
    """Return the Fisher information of one run about the searched coordinates, shape (p, p)."""
    scales = {c.name: c.slope(float(t)) for c, t in zip(found.coordinates, found.theta, strict=True)}
    return sensitivities(found.chain, scales, observation).normal()[0]


def _changes(found: Fit, told: Sequence[Matrix], better: Sequence[Matrix]) -> list[float]:
    """Return for each run the largest share by which a finer grid changes what all runs tell of some combination."""
    little = np.eye(len(found.coordinates)) / TOLD**2
    scale, curvatures, axes = resolved(sum(told, little))
    units = scale[:, None] * axes / np.sqrt(curvatures)
    changes = (units.T @ (new - old) @ units for old, new in zip(told, better, strict=True))
    return [float(np.max(np.abs(np.linalg.eigvalsh(change)), initial=0.0)) for change in changes]


def coarsened(observation: Observation, chain: Chain, factor: int) -> Observation:
    """Return the observation on a grid coarser by up to ``factor``, with what its own adds to the answer of ``chain``.

    Raises ValueError where the chain cannot be simulated.
    """
    substeps = max(observation.substeps // factor, 1)
    if substeps == observation.substeps:
        return observation
    coarse = replace(observation, substeps=substeps, left_out=None)
    added = np.concatenate([part for _, part in _added(coarse, chain, observation.substeps)])
    return replace(coarse, left_out=(added / observation.noise_v).astype(np.float32))


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
    answers = (answered(chain, observation.trace, n, samples_at_once(substeps)) for n in grids)
    first = 0
    for coarse, fine in zip(*answers, strict=True):
        yield slice(first, first + coarse.size), fine - coarse
        first += coarse.size


def alike(some: Sequence[Observation], others: Sequence[Observation]) -> bool:
    """Return whether a matched test would not tell what is added to an answer here from what is added there."""
    if any(a.substeps != b.substeps for a, b in zip(some, others, strict=True)):
        return False
    pairs = [(a.left_out, b.left_out) for a, b in zip(some, others, strict=True)]
    changes = [a - b for a, b in pairs if a is not None and b is not None]
    return bool(sum(float(change @ change) for change in changes) < MOVED**2)
