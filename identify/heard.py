"""Does anything of the source come back in the readings?

A lead that is off, another channel, a supply that is not switched on: what is read then is noise about a level. A model
with enough freedom fits that as well as anything, and whatever is named for it is wrong.
"""

from collections.abc import Sequence
from dataclasses import replace
from operator import itemgetter

import numpy as np

from identify.chain import tapped
from identify.effects import chain_of
from identify.model import Backlash, LinearF, Model
from identify.natural_units import shown
from identify.noise import good
from identify.trace import LONG, Array, Trace

WIDER = 1.5  # times the gap of the rig file, that may be stuck in earnest
FORETOLD = 10.0  # times the noise that a rig with such a gap would move the readings by, at least, for silence to tell
EARLY = 0.1  # of what is foretold: so much of it in a stretch is no chance
SAME = 1e-10  # of the information of a signal, by which rounding may tell it from others
SILENT = 0.01  # of what is foretold, that chance, pickup and what leaks past the rig may look like of it
SHARE = 0.2  # of what is read, that may look like it: noise has no more


def check_heard(model: Model, traces: Sequence[Trace], noise_v: float) -> None:
    """Raise ValueError where nothing of the source is in any of the recordings, though the rig should make much of it.

    What is compared is a line in the signals of the simulation, u, v, w and y, and in how fast they move, whatever the
    sizes: a coupling capacitor lets through no more than that.
    """
    if model.unknown or not traces:
        return
    foretold = []
    for trace in traces:
        rms_v = _foretold(model, trace, noise_v)
        if rms_v is None:
            return
        foretold.append((rms_v, trace))
    foretold_v, trace = max(foretold, key=itemgetter(0))
    y = trace.y[:LONG][good(trace)[:LONG]]
    stuck = "" if isinstance(model.f, LinearF) else (
        f", or F rests in a gap more than {WIDER:g} times as wide as the rig file has it (play a larger amplitude)"
    )  # fmt: skip
    raise ValueError(
        f"the readings do not follow the source: they stay at {shown(float(np.mean(y)), 'V', 3)} "
        f"± {shown(float(np.std(y)), 'V', 2)} where the rig file foretells {shown(foretold_v, 'V', 2)} rms; nothing of "
        f"the rig reaches the ADC (check the cable, the channel and the supply){stuck}"
    )


def _foretold(model: Model, trace: Trace, noise_v: float) -> float | None:
    """Return how much the readings should move, V rms; None where they follow something, or need not move at all."""
    like, least = _Line(), _Line()
    ok = good(trace)
    wide = replace(model, f=model.f.widened(WIDER)) if isinstance(model.f, Backlash) else model
    both = zip(*(tapped(chain_of(m, trace.intersample), trace) for m in (model, wide)), strict=True)
    first = 0
    with np.errstate(over="ignore", invalid="ignore"):
        for taps, wider in both:
            use = slice(first, first + taps[0].size)
            first, y = use.stop, trace.y[use][ok[use]]
            like.add([row[ok[use]] for row in (*(np.diff(tap, prepend=tap[:1]) for tap in taps), *taps)], y)
            least.add([wider[-1][ok[use]]], y)
            if like.found_v > EARLY * like.last_v:
                return None
    if not np.isfinite(like.last_v) or not least.last_v > FORETOLD * noise_v:
        return None
    unlike = like.found_v < SILENT * like.last_v and like.found_v < SHARE * like.read_v
    return like.last_v if unlike else None


class _Line:
    """What a constant and a combination of signals make of readings, from sums that stretches add to."""

    def __init__(self) -> None:
        """Begin with none."""
        self._square: Array | float = 0.0
        self._along: Array | float = 0.0
        self._own, self._count = 0.0, 0

    def add(self, rows: Sequence[Array], y: Array) -> None:
        """Take a stretch of signals, V, shape (n,) each, and of readings."""
        base = np.array([*rows, np.ones(y.size)])
        self._square, self._along = self._square + base @ base.T, self._along + base @ y
        self._own, self._count = self._own + float(y @ y), self._count + y.size

    @property
    def last_v(self) -> float:
        """Return the rms of the last signal about its mean, V."""
        square = np.asarray(self._square)
        return _about_mean(float(square[-2, -2]), float(square[-2, -1]), self._count)

    @property
    def read_v(self) -> float:
        """Return the rms of the readings about their mean, V."""
        return _about_mean(self._own, float(np.asarray(self._along)[-1]), self._count)

    @property
    def found_v(self) -> float:
        """Return the rms of the best combination about its mean, V; infinity where a signal is not finite."""
        square, along = np.asarray(self._square), np.asarray(self._along)
        if not np.all(np.isfinite(square)):
            return np.inf
        size = np.sqrt(np.maximum(square.diagonal(), np.finfo(float).tiny))
        weights = np.linalg.pinv(square / np.outer(size, size), rcond=SAME, hermitian=True) @ (along / size) / size
        return _about_mean(float(weights @ square @ weights), float(weights @ square[-1]), self._count)


def _about_mean(square: float, total: float, count: int) -> float:
    """Return the rms about their mean of numbers of which the sum of squares and the sum are known."""
    return float(np.sqrt(max(square / max(count, 1) - (total / max(count, 1)) ** 2, 0.0)))
