"""How does the reading over a cable answer to the samples put out before it, and how sure is every part of that?

y[k] = offset + sum over n of h[n] u[k - n]. Sample u[k - n] began n periods before the reading, so with s(t) the share
of a step that has arrived t after it was put out, h[n] = gain (s(nT) - s((n - 1)T)): the taps sample the step response.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array

BEFORE = 3
"""Taps looked at before the largest one."""
FEWEST, MOST = 12, 96
TAIL = 3
"""Last taps of which none may show, or more are taken."""
SHOWS = 4.0  # sd
FLOOR = 1e-12
"""Of the span of u: a residual below it is rounding."""

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Pass:
    """One run over the cable: ``u`` as put out and ``y`` as read, V, shape (N,), at one rate."""

    u: Array
    y: Array
    rate_hz: float


@dataclass(frozen=True)
class Taps:
    """The taps h[first], h[first + 1], ... of one run or of several, V/V; ``information`` is their inverse covariance.

    ``offset_v`` and ``noise_v`` are of the run; ``scatter`` says how much more than the noise the runs differ, 1 for
    not at all, told by ``freedom`` numbers.
    """

    rate_hz: float
    first: int
    h: Array
    information: Matrix
    offset_v: float
    noise_v: float
    scatter: float = 1.0
    freedom: int = 0

    @property
    def gain(self) -> float:
        """Return what a constant is multiplied by."""
        return float(self.h.sum())

    @property
    def sd(self) -> Array:
        """Return the standard deviation of every tap."""
        return np.sqrt(np.diag(np.linalg.inv(self.information)))


def largest_tap(one: Pass) -> int:
    """Return after how many samples the reading answers most, from the correlation of u and y."""
    size = 1 << (2 * one.u.size - 1).bit_length()
    spectra = [np.fft.rfft(signal - signal.mean(), size) for signal in (one.y, one.u)]
    correlation = np.fft.irfft(spectra[0] * np.conj(spectra[1]), size)[: one.u.size // 2]
    return int(np.argmax(np.abs(correlation)))


def window(passes: Sequence[Pass]) -> tuple[int, int]:
    """Return the first tap to look at and how many: until the last of them do not show, or there is no end to it.

    Raises ValueError when the runs are too short for the answer.
    """
    first, count = max(largest_tap(passes[0]) - BEFORE, 0), FEWEST
    while True:
        taps = pooled([taps_of(one, first, count) for one in passes])
        if not (np.abs(taps.h[-TAIL:]) > SHOWS * np.sqrt(taps.scatter) * taps.sd[-TAIL:]).any() or count >= MOST:
            return first, count
        count *= 2


def taps_of(one: Pass, first: int, count: int, part: slice = slice(None)) -> Taps:
    """Return ``count`` taps from h[first] on by least squares over ``part`` of a run; ValueError where it is short."""
    after = first + count - 1
    at = np.arange(one.u.size)[part]
    at = at[at >= after]
    if at.size < 4 * count:
        raise ValueError(f"{at.size} samples are too few for {count} taps after {first} samples of delay")
    columns = np.column_stack([np.ones(at.size), *(one.u[at - n] for n in range(first, first + count))])
    normal = columns.T @ columns
    found = np.linalg.solve(normal, columns.T @ one.y[at])
    left = one.y[at] - columns @ found
    noise_v = max(float(np.sqrt(left @ left / (at.size - found.size))), FLOOR * float(np.ptp(one.u)))
    without_offset = normal[1:, 1:] - np.outer(normal[0, 1:], normal[0, 1:]) / normal[0, 0]
    return Taps(one.rate_hz, first, found[1:], without_offset / noise_v**2, float(found[0]), noise_v)


def pooled(runs: Sequence[Taps]) -> Taps:
    """Return the taps of several runs at one rate taken together, and by how much more than noise the runs differ."""
    information = np.sum([run.information for run in runs], axis=0)
    h = np.linalg.solve(information, np.sum([run.information @ run.h for run in runs], axis=0))
    freedom = (len(runs) - 1) * h.size
    apart = sum(float((run.h - h) @ run.information @ (run.h - h)) for run in runs)
    noise_v = float(np.sqrt(np.mean([run.noise_v**2 for run in runs])))
    offset_v = float(np.mean([run.offset_v for run in runs]))
    scatter = max(1.0, apart / freedom) if freedom else 1.0
    return Taps(runs[0].rate_hz, runs[0].first, h, information, offset_v, noise_v, scatter, freedom)
