"""At which moment of the clock did something change for good, and what?

What comes in at a moment does nearly what it would do from the beginning, kept from that moment on: so all moments are
looked at by sums over windows, and only around the likeliest is it simulated.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from math import log1p

import numpy as np
from numpy.typing import NDArray

from identify.discretise import Matrix
from identify.evidence import Evidence
from identify.explain.corrections import free_name, slowest_s
from identify.first_order import Cube
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array
from identify.unnamed.correction import Correction
from identify.unnamed.sudden import SUDDEN, GainSince, SuddenDynamics, SuddenGain

Indices = NDArray[np.intp]
WINDOW_S = 0.05
ENDS = 0.05  # of all readings, that are before a moment at least, and after it
SHORTEST_S = 1e-3  # of what a moment is away from a break
LAGS = 3  # time constants of dynamics that change
SEEN = 1e-9  # eigenvalues below this share of the largest are not told by the data


def suddenly(evidence: Evidence) -> Iterator[tuple[Correction, float]]:
    """Yield laws that come in at the moment at which windows say they explain most, and what that promises there.

    In units of chi-squared. Nothing where too little is before every moment, or after it: what was there from the
    beginning is another thing.
    """
    clock_s, order, starts = _windows(evidence)
    seen = starts / max(order.size, 1)
    midway = (seen > ENDS) & (seen < 1.0 - ENDS)
    for law in _laws(evidence):
        later = midway & (clock_s > law.knots[-1])
        if later.any() and law.applicable(evidence.chain):
            gains = np.where(later, _gains(evidence, law, order, starts), 0.0)
            best = int(np.argmax(gains))
            yield replace(law, knots=(*law.knots[:-1], float(clock_s[best]))), float(gains[best])


def in_breaks(law: Correction, observations: Sequence[Observation]) -> list[tuple[Correction, float]]:
    """Return a gain that leaps as it would in the breaks between runs next to its moment, and the log odds of each.

    A moment that may be any is as much likelier in a break as that is longer than what it is away from there. Nothing
    for another law: rigs start at rest, so that one that adds something is not passed on as it is.
    """
    if type(law) is not SuddenGain:
        return []
    spans = sorted((o.trace.start_s, o.trace.start_s + o.trace.size / o.trace.rate_hz) for o in observations)
    breaks = [(stop, start) for (_, stop), (start, _) in pairwise(spans) if stop < start]
    away = [max(stop - law.knots[-1], law.knots[-1] - start, SHORTEST_S) for stop, start in breaks]
    near = sorted(zip(away, breaks, strict=True))[:2]
    return [(replace(law, knots=(0.5 * (stop + start),)), log1p((start - stop) / by)) for by, (stop, start) in near]


def from_a_run_on(law: Correction) -> Correction:
    """Return a gain that leaps between two runs as the one that holds in every run, behind the linear block."""
    behind = {Place.SOURCE: Place.G1, Place.F: Place.SENSE}.get(law.place, law.place)
    return GainSince(behind, law.knots, law.name)


def _laws(evidence: Evidence) -> Iterator[Correction]:
    """Yield every law that may come in, there from the beginning."""
    name, first = free_name(evidence.chain), min(o.trace.start_s for o in evidence.observations)
    yield from (law(place, (first,), name) for law in SUDDEN for place in law.places)
    taus = np.geomspace(evidence.sample_s, max(slowest_s(evidence), 2.0 * evidence.sample_s), LAGS)
    early = max(first, 1.01 * float(taus[-1]))
    yield from (SuddenDynamics(place, (*taus.tolist(), early), name) for place in SuddenDynamics.places)


def _windows(evidence: Evidence) -> tuple[Array, Indices, Indices]:
    """Return when every window begins on the clock, s, the samples by the clock, and where windows begin in these."""
    clock = [o.trace.start_s + np.flatnonzero(o.use) * evidence.sample_s for o in evidence.observations]
    every = np.concatenate(clock)
    order = np.argsort(every, kind="stable")
    number = np.floor(every[order] / WINDOW_S)
    starts = np.flatnonzero(np.diff(number, prepend=-np.inf))
    return every[order][starts], order, starts.astype(np.intp)


def _gains(evidence: Evidence, law: Correction, order: Indices, starts: Indices) -> Array:
    """Return what a law promises that comes in as each window begins, the fitted parameters moving with it."""
    step = evidence.observations[0].noise_v
    chain, names = law.put_in(evidence.chain), [p.name for p in law.parameters()]
    rows = evidence.changes([chain.with_values({name: step}) for name in names], step)[:, order]
    if not np.all(np.isfinite(rows)):
        return np.zeros(starts.size)

    def later(each: Array) -> Array:
        return np.cumsum(np.add.reduceat(each, starts, axis=-1)[..., ::-1], axis=-1)[..., ::-1]

    square = np.array([later(rows * row) for row in rows])
    along = later(rows * evidence.residual[order])
    mimic = np.array([later(rows * slope[order]) for slope in evidence.slopes]).reshape(-1, *along.shape)
    return _told(*evidence.less_plain_each(square.T, along.T, mimic.transpose(2, 0, 1)))


def _told(matrices: Cube, rights: Matrix) -> Array:
    """Return the fall of chi-squared by curvatures (w, m, m) and slopes (w, m), as far as the data tell them."""
    values, vectors = np.linalg.eigh(matrices)
    pulls = np.einsum("wij,wi->wj", vectors, rights)
    seen = values > SEEN * np.max(np.abs(values), axis=1, keepdims=True)
    return np.asarray(np.sum(np.square(pulls) / np.where(seen, values, np.inf), axis=1))
