"""Which step of a protocol tells what, and how sure would the answer be?

The Fisher information of white noise, J'J / sigma^2, is summed step by step from the sensitivities of the chain on the
samples that are or were played. The variance of an efficient estimate of q = g'theta is g' C g, C the inverse of the
whole; step s enters it with g' C I_s C g, the part of that variance that its own noise brings. These parts add up to
one, so they are the shares in which the steps make the estimate.
"""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identify.chain import Chain
from identify.coordinate import Coordinate
from identify.derivatives.sensitivities import sensitivities
from identify.interval import number
from identify.observe import Observation
from identify.planning.excitation import named_steps
from identify.planning.quantities import Quantity, corners_hz, quantities
from identify.quadratic import inverse
from identify.trace import Step

Matrix = NDArray[np.float64]
NOTHING = 0.01  # share of every estimate below which a step tells nothing
UNTOLD = 0.5  # share of an estimate that comes from where it started, above which the data do not tell it


@dataclass(frozen=True)
class Expected:
    """What a protocol tells of one quantity: standard error (unit of the value) and the share of every step in it.

    ``told`` is False when most of what is known of it comes from where the search starts.
    """

    quantity: Quantity
    sd: float
    shares: dict[str, float]
    told: bool

    @property
    def relative(self) -> float:
        """Return the standard error over the size of the quantity."""
        return self.sd / self.quantity.size

    def to_dict(self) -> dict[str, object]:
        """Return value, unit, half width of the 95 % interval, and the shares."""
        q = self.quantity
        return {
            "value": number(q.value), "unit": q.unit, "half_width_95": number(1.96 * self.sd) if self.told else None,
            "shares": {label: number(share, 3) for label, share in self.shares.items()},
        }  # fmt: skip


@dataclass(frozen=True)
class Information:
    """The information of every step, by label, about the searched coordinates, and the prior that holds the rest."""

    labels: tuple[str, ...]
    kinds: tuple[str, ...]
    times_s: tuple[float, ...]
    matrices: Matrix
    prior: Matrix
    quantities: tuple[Quantity, ...]

    @cached_property
    def covariance(self) -> Matrix:
        """Return the covariance an efficient estimate would have, shape (p, p)."""
        return inverse(self.prior + self.matrices.sum(axis=0))

    def expected(self) -> tuple[Expected, ...]:
        """Return standard error and shares of every quantity."""
        return tuple(self._expected(q) for q in self.quantities)

    def _expected(self, quantity: Quantity) -> Expected:
        along = self.covariance @ quantity.slope
        variance = float(quantity.slope @ along)
        parts = np.einsum("i,sij,j->s", along, self.matrices, along) / (variance or 1.0)
        shares = dict(zip(self.labels, parts.tolist(), strict=True))
        return Expected(quantity, float(np.sqrt(variance)), shares, float(np.sum(parts)) > 1.0 - UNTOLD)

    def steps(self) -> tuple["StepInformation", ...]:
        """Return the same step by step."""
        told = [e for e in self.expected() if e.told]
        return tuple(
            StepInformation(label, kind, time_s, {e.quantity.name: e.shares[label] for e in told})
            for label, kind, time_s in zip(self.labels, self.kinds, self.times_s, strict=True)
        )


@dataclass(frozen=True)
class StepInformation:
    """The share of one step, all its repeats together, in what is told of every quantity."""

    label: str
    kind: str
    time_s: float
    shares: dict[str, float]

    @property
    def best(self) -> tuple[str, float]:
        """Return the quantity in which the step has its largest share, and that share; ("", 0) when none is told."""
        return max(self.shares.items(), key=lambda item: item[1], default=("", 0.0))

    @property
    def tells_nothing(self) -> bool:
        """Return whether the step could be left out."""
        return self.best[1] < NOTHING

    def to_dict(self) -> dict[str, object]:
        """Return the form of the JSON answers."""
        return {
            "label": self.label, "kind": self.kind, "time_s": number(self.time_s),
            "shares": {name: number(share, 3) for name, share in self.shares.items()},
            "tells_nothing": self.tells_nothing,
        }  # fmt: skip


def information(
    chain: Chain, coordinates: Sequence[Coordinate], observations: Sequence[Observation],
    frequencies_hz: Sequence[float] | None = None,
) -> Information:  # fmt: skip
    """Return what ``observations`` tell about ``chain`` at its own values; readings in them are not looked at.

    ``frequencies_hz`` are those at which gain and phase of G1 and G2 are asked for; by default around their corners.
    """
    centred = tuple(Coordinate(c.name, c.parameter, _value(chain, c)) for c in coordinates)
    labels, matrices = by_step(chain, centred, observations)
    kinds, times_s = _described(observations)
    asked = quantities(chain, centred, frequencies_hz or corners_hz(chain, _lowest_rate_hz(observations)))
    told = ((kinds[label], times_s[label]) for label in labels)
    of_kind, taking_s = zip(*told, strict=True)
    return Information(labels, of_kind, taking_s, matrices, prior_of(centred), asked)


def prior_of(coordinates: Sequence[Coordinate]) -> Matrix:
    """Return the information of the fit's prior, shape (p, p)."""
    return np.diag([c.prior_sd**-2.0 for c in coordinates])


def _value(chain: Chain, coordinate: Coordinate) -> float:
    return chain.values.get(coordinate.name, chain.values[coordinate.parameter.name])


def _lowest_rate_hz(observations: Sequence[Observation]) -> float:
    return min(o.trace.rate_hz for o in observations)


def _described(observations: Sequence[Observation]) -> tuple[dict[str, str], dict[str, float]]:
    """Return kind and total time of every step by label."""
    kinds: dict[str, str] = {}
    times_s: dict[str, float] = {}
    for o in observations:
        for step in named_steps(o.trace):
            kinds.setdefault(step.label, step.kind)
            times_s[step.label] = times_s.get(step.label, 0.0) + (step.stop - step.start) / o.trace.rate_hz
    return kinds, times_s


def by_step(
    chain: Chain, coordinates: Sequence[Coordinate], observations: Sequence[Observation]
) -> tuple[tuple[str, ...], Matrix]:
    """Return the labels in the order they are played, and J'J per noise variance of each, shape (labels, p, p)."""
    found: dict[str, Matrix] = {}
    for observation in observations:
        steps = named_steps(observation.trace)
        for step in steps:
            found.setdefault(step.label, np.zeros((len(coordinates), len(coordinates))))
        used = _used(steps, observation)
        for first, slopes in _slopes(chain, coordinates, observation):
            for label, part in _within(used, first, slopes.shape[1]):
                found[label] += slopes[:, part] @ slopes[:, part].T
    return tuple(found), np.array(list(found.values()))


def _slopes(chain: Chain, coordinates: Sequence[Coordinate], observation: Observation) -> Iterator[tuple[int, Matrix]]:
    """Yield slopes of the readings against the coordinates per noise sd, with the number of readings yielded before."""
    found, first = sensitivities(chain, {c.name: c.slope(0.0) for c in coordinates}, observation), 0
    for residual, rows in found.chunks:
        yield first, rows[:, found.columns].T
        first += residual.size


def _within(used: Sequence[tuple[str, int, int]], first: int, count: int) -> Iterator[tuple[str, slice]]:
    """Yield the label of every step that has some of the used readings first ... first + count, and which of these."""
    for label, start, stop in used[bisect_right(used, first, key=lambda step: step[2]) :]:
        if start >= first + count:
            return
        yield label, slice(max(start - first, 0), min(stop - first, count))


def _used(steps: Sequence[Step], observation: Observation) -> list[tuple[str, int, int]]:
    """Return the labels in the order of time, with the count of used readings before start and before stop of each."""
    edges = sorted({0, *(edge for step in steps for edge in (step.start, step.stop))})
    counts = [int(np.count_nonzero(observation.use[a:b])) for a, b in pairwise(edges)]
    before = dict(zip(edges, np.cumsum([0, *counts]).tolist(), strict=True))
    return sorted(((s.label, before[s.start], before[s.stop]) for s in steps), key=lambda step: step[1:])
