"""Does the noise of one reading hang together with that of the readings before it, and how is it made white?

Told from what repeats, like its size (identify.noise): from differences between periods of one stimulus, else from
settled dwells freed of their trend. Where these are not white, an autoregressive model e[k] = sum a_j e[k-j] + n[k] is
fitted to their autocovariance (Yule-Walker equations by Levinson's recursion), its order by Schwarz's criterion. The
fit then weighs n[k], which is white: the filter 1 - sum a_j z^-j is run over residual and sensitivities alike.
What lasts for a hundred readings (hum, drift) is physics to be explained and makes no colour.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.signal import detrend, sosfilt, sosfilt_zi
from scipy.stats import chi2

from identify.innovations import Wander, innovations
from identify.noise import good, quantisation_rms, repeated, settled_dwells
from identify.trace import Array, Mask, Trace

HIGHEST = 8  # order
FALSE_ALARMS = 1e-3  # share of white noises taken for coloured
APART = 200  # samples that two readings are apart at least, to count as independent
LASTING = 190  # samples, less than APART, looked at for what lasts: from half of them on noise has forgotten itself
FAINT = 0.1  # correlation of readings that far apart which still passes for none
SHORTEST = 100  # samples of a dwell whose trend can be told from its noise
MOST = 1 << 20  # samples of a stretch looked at: more tell nothing new
FREQUENCIES = 4096  # of an integral over what passes a filter
IN_ALL = 1 << 22  # samples of all stretches looked at: bounds memory
COARSE = 2.0  # times the noise of an ADC's steps, from which the noise has a colour of its own
ENOUGH = 1000  # readings needed to tell a colour

Filter = Callable[[Array, Mask], Array]


@dataclass(frozen=True, eq=False)
class Sizes:
    """How much every reading of one run scatters, over the rms of a reading's noise, shape (N,)."""

    each: Array


@dataclass(frozen=True)
class Colour:
    """Noise as an autoregression with coefficients ``taps``; ``gain`` is its rms over that of its new part n.

    Or, where it hangs together for longer, as white noise passed through a ladder of first-order lags and leads: a
    pole and a zero each, in the plane of z. Or white noise beside what ``wander``s in one run, and in that alone; or
    white noise that is larger in some of its readings.
    """

    taps: tuple[float, ...] = ()
    gain: float = 1.0
    ladder: tuple[tuple[float, ...], ...] = ()
    wander: Wander | None = None
    sizes: Sizes | None = None

    @property
    def white(self) -> bool:
        """Return whether there is nothing to filter."""
        return not self.taps and not self.ladder and not self.of_one_run

    @property
    def of_one_run(self) -> bool:
        """Return whether it says of every reading of one run what that is worth."""
        return self.wander is not None or self.sizes is not None

    @property
    def slow(self) -> float:
        """Return by how much the mean of many readings scatters more than that of white noise of equal rms."""
        still = float(np.prod([(1.0 - pole) / (1.0 - zero) for pole, zero in self.ladder]))
        return 1.0 / (self.gain * (1.0 - sum(self.taps)) * still)

    def of_means(self, m: int) -> "Colour":
        """Return the colour of means of ``m`` readings each, in units of the rms of one reading: that of a ladder.

        Its roots fade over ``m`` readings as they do over one, m times; its gain makes the rms of their new part 1.
        Their power is that of the readings through the mean, folded: a function of z^m passes it as it comes.
        """
        z = np.exp(1j * np.pi / FREQUENCIES * (np.arange(FREQUENCIES) + 0.5))
        slower = tuple(tuple(root**m for root in rung) for rung in self.ladder)
        mean = np.abs((1.0 - z**m) / (1.0 - z)) / m
        left = np.mean(np.square(mean * _passed(slower, z**m) / _passed(self.ladder, z)))
        return Colour(gain=self.gain / float(np.sqrt(left)), ladder=slower)

    def to_dict(self) -> dict[str, object]:
        """Return the form of JSON answers."""
        return {"autoregression": [float(f"{tap:.4g}") for tap in self.taps], "rms_over_new": float(f"{self.gain:.4g}")}


WHITE = Colour()


def _passed(ladder: Sequence[Sequence[float]], z: NDArray[np.complex128]) -> Array:
    """Return how much a ladder that makes white lets pass at points of the unit circle."""
    return np.asarray(np.abs(np.prod([(1.0 - pole * z) / (1.0 - zero * z) for pole, zero in ladder], axis=0)))


def whitening(colour: Colour) -> Filter:
    """Return the filter at work: values (n, ...) per rms and which of them are in use (n,) become those in use, white.

    It remembers what came before, call by call. A reading whose past is not all in use becomes 0: it does not count.
    """
    order = len(colour.taps)
    if colour.wander is not None:
        return innovations(colour.wander)
    if colour.sizes is not None:
        return _evened(colour.sizes)
    if colour.ladder:
        return _climbing(colour)
    if order == 0:
        return lambda values, use: values[use]
    past, known = np.zeros(0), np.zeros(order, dtype=bool)

    def run(values: Array, use: Mask) -> Array:
        nonlocal past, known
        if past.shape[1:] != values.shape[1:] or past.shape[0] != order:
            past = np.zeros((order, *values.shape[1:]))
        joined, in_use, size = np.concatenate((past, values)), np.concatenate((known, use)), values.shape[0]
        white, counts = values.copy(), use.copy()
        for j, tap in enumerate(colour.taps, start=1):
            white -= tap * joined[order - j : order - j + size]
            counts &= in_use[order - j : order - j + size]
        past, known = joined[-order:].copy(), in_use[-order:]
        white[~counts] = 0.0
        return np.asarray(colour.gain * white[use])

    return run


def _evened(sizes: Sizes) -> Filter:
    """Return the filter that weighs every reading of a run as it scatters, from the first reading on."""
    at = 0

    def run(values: Array, use: Mask) -> Array:
        nonlocal at
        here = sizes.each[at : at + use.size][use]
        at += use.size
        return np.asarray(values[use] / here.reshape(-1, *(1,) * (values.ndim - 1)))

    return run


def _climbing(colour: Colour) -> Filter:
    """Return the filter of a ladder at work; where a reading is not in use the last one before it holds.

    Such noise did not begin with the run: the level of its first readings, as many as the white noise in them needs to
    average out, stands for all those before. From rest, the noise that the run begins with would pass for a jump.
    """
    sections, settled = _sections(colour.ladder)
    first = round(1.0 / (1.0 - min(map(min, colour.ladder))))  # readings in the quickest of the ladder's times
    state, last = np.zeros(0), np.zeros(0)

    def run(values: Array, use: Mask) -> Array:
        nonlocal state, last
        if not state.size and not use.any():  # nothing has begun yet
            return values[use]
        if state.shape[2:] != values.shape[1:] or not state.size:
            last = np.mean(values[np.flatnonzero(use)[:first]], axis=0)
            state = settled.reshape(*settled.shape, *(1,) * last.ndim) * last
        shown = values if use.all() else _holding(values, use, last)
        white, state = sosfilt(sections, shown, axis=0, zi=state)
        last = shown[-1]
        return np.asarray(colour.gain * white[use])

    return run


@cache
def _sections(ladder: tuple[tuple[float, ...], ...]) -> tuple[Array, Array]:
    """Return a ladder as sections of second order, and what they remember of a level that has always been 1 V."""
    sections = np.array([(1.0, -pole, 0.0, 1.0, -zero, 0.0) for pole, zero in ladder])
    return sections, sosfilt_zi(sections)


def _holding(values: Array, use: Mask, before: Array) -> Array:
    """Return values of which each that is not in use is the last one in use, ``before`` where there is none."""
    at = np.maximum.accumulate(np.where(use, np.arange(1, use.size + 1), 0))
    return np.concatenate((before[None], values))[at]


def colour_of(differences: Sequence[Array]) -> Colour:
    """Return the colour of noise of which ``differences`` are independent stretches, white unless that is refuted."""
    size = sum(d.size for d in differences)
    if size < ENOUGH:
        return WHITE
    covariance = np.sum([_autocovariance(d) for d in differences], axis=0)
    if covariance[0] <= 0.0:
        return WHITE
    correlation = covariance / covariance[0]
    independent = size / 1.5  # neighbouring differences between periods share readings
    told = independent * float(np.sum(np.square(correlation[1 : HIGHEST + 1])))
    if told < chi2.ppf(1.0 - FALSE_ALARMS, HIGHEST) or _lasts(correlation, independent):
        return WHITE
    models = _levinson(correlation[: HIGHEST + 1])
    scores = [independent * np.log(left) + len(taps) * np.log(independent) for taps, left in models]
    taps, left = models[int(np.argmin(scores))]
    return Colour(tuple(taps.tolist()), 1.0 / float(np.sqrt(left)))


def _autocovariance(d: Array) -> Array:
    """Return the sums of products of values 0, 1, ... LASTING - 1 apart."""
    spectrum = np.fft.rfft(d, next_fast_len(d.size + LASTING, real=True))
    found = np.fft.irfft(np.square(np.abs(spectrum)), next_fast_len(d.size + LASTING, real=True))
    return np.asarray(found[:LASTING])


def _lasts(correlation: Array, independent: float) -> bool:
    """Return whether readings far apart still hang together: hum and drift do, and are physics to be explained."""
    near, far = correlation[1 : LASTING // 2], correlation[LASTING // 2 :]
    scatter = np.sqrt((1.0 + 2.0 * float(np.sum(np.square(near)))) / independent)
    return bool(np.max(np.abs(far)) > FAINT + 4.0 * scatter)


def _levinson(correlation: Array) -> list[tuple[Array, float]]:
    """Return the coefficients and the share of variance left of every order from 0 on."""
    taps, left = np.zeros(0), 1.0
    found = [(taps, left)]
    for order in range(1, correlation.size):
        reflection = float(correlation[order] - taps @ correlation[order - 1 : 0 : -1][: taps.size]) / left
        taps = np.append(taps - reflection * taps[::-1], reflection)
        left *= 1.0 - reflection**2
        found.append((taps, left))
    return found


@dataclass(frozen=True)
class Grain:
    """The rms of the noise of readings taken at one rate, V, and its colour."""

    rms_v: float
    colour: Colour


def grains_of(traces: Sequence[Trace], settle_s: float) -> dict[float, Grain]:
    """Return what repeats tell of the noise at every sample rate, Hz; empty where it is white at all of them.

    ``settle_s`` is how long the rig takes to settle after a step. Noise of the size of the ADC's steps counts as white:
    its colour would be that of rounding.
    """
    found: dict[float, Grain] = {}
    floor = quantisation_rms(traces)
    for rate in {trace.rate_hz for trace in traces}:
        there = [trace for trace in traces if trace.rate_hz == rate]
        for tell in (_between_periods, _within_dwells):
            told = _collected(d for trace in there for d in tell(trace, round(settle_s * rate)))
            if sum(d.size for d in told) >= ENOUGH:
                found[rate] = _grain(told, floor)
                break
    return found if any(grain.colour.taps for grain in found.values()) else {}


def _collected(pieces: Iterable[Array]) -> list[Array]:
    """Return the first pieces, as many as hold ``IN_ALL`` readings."""
    found: list[Array] = []
    size = 0
    for piece in pieces:
        found.append(piece)
        size += piece.size
        if size >= IN_ALL:
            break
    return found


def _grain(differences: Sequence[Array], floor: float) -> Grain:
    """Return size and colour of noise from independent stretches of it."""
    total, size = sum(float(d @ d) for d in differences), sum(d.size for d in differences)
    rms_v = float(np.sqrt(total / size))
    return Grain(max(rms_v, floor), colour_of(differences) if rms_v > COARSE * floor else WHITE)


def _between_periods(trace: Trace, settle: int) -> Iterator[Array]:
    """Yield differences between periods of one stimulus that are far apart, per sqrt(2); 0 where a reading is lost."""
    ok = good(trace)
    for first, stop, period in repeated(trace, settle):
        lag = -(-APART // period) * period
        lag = lag if stop - first >= 2 * lag else period
        once = slice(first, first + min(stop - first - lag, MOST))
        again = slice(once.start + lag, once.stop + lag)
        yield np.where(ok[once] & ok[again], trace.y[again] - trace.y[once], 0.0) / np.sqrt(2.0)


def _within_dwells(trace: Trace, settle: int) -> Iterator[Array]:
    """Yield the readings of settled dwells without a gap, freed of their trend."""
    ok = good(trace)
    for first, stop in settled_dwells(trace.u, settle):
        at = slice(first, min(stop, first + MOST))
        if stop - first >= SHORTEST and np.all(ok[at]):
            yield detrend(trace.y[at])
