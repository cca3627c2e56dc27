"""Which single readings were thrown off: how often, and how far?

A spike is one reading far from those beside it, at a moment of its own: not at a jump of the stimulus, not at the same
place of every repeat, not where the model fails for many readings in a row, and not the more often the faster the
readings move: those are the tail of a scatter in time. How many readings of noise alone would lie so far out is known,
so the number beyond a threshold is a Poisson test; several thresholds are paid for.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.stats import chi2, gamma, norm, poisson

from identify.effects.effect import Confusion
from identify.interval import Interval
from identify.noise import good
from identify.readings.blemish import Blemish
from identify.stage import Parameter
from identify.trace import Array, Mask, Trace

BESIDE, AROUND = 17, 201  # readings whose median is the level, and whose median deviation is the scatter
THRESHOLDS = (4.5, 5.0, 5.5, 6.5, 8.0)  # standard deviations
CONVINCING = 1e-6  # chance of so many readings that far out
DISTURBED = 1.3  # times the overall scatter: the model fails there, and no reading is judged
FOLLOWING = 2.0  # times as often as in noise that a reading may be the median of those about it: else it goes elsewhere
STANDS_OUT = 2.0  # times the readings on either side: a corner that the model rounds is not one reading
FLICKER = 0.35  # of an LSB: as a standard deviation it leaves one step of the ADC within every threshold
ALONE = 1.0  # sd that spikes may be smaller than the threshold: else they are the tail of something else
JUMP = 0.02  # of the range of u: a step of the stimulus, at which a reading may be off for other reasons
AFTER_JUMP = 4  # samples
Samples = NDArray[np.intp]  # numbers of samples
MOSTLY, MOSTLY_SD = 0.95, float(norm.ppf(0.975))  # of readings, and within how many sd so many Gaussian ones lie
TO_SD = 1.0 / norm.ppf(0.75)  # a median deviation as a standard deviation
# Of Gaussian readings against the median of the 17 they are among, by simulation of two million:
AMONG = 0.930  # their median deviation over that from their mean
LEANT, SCATTER = 0.076, 1.05  # sd by which one thrown far off draws that median along, and what scatters about its size
FASTER = 1e-5  # chance of outliers at readings so fast, below which they are no spikes
CONTRADICTED = 1e-3  # chance of so few spikes on held-out readings


@final
class Spikes(Blemish):
    """Single readings thrown off by about the same size, upwards or downwards."""

    id = "spikes"
    title = "spikes"
    equation = "y' = y + s size at moments of a Poisson process of the rate, s = +1 or -1"
    sentence = (
        "Single readings are thrown off: {}. Something switches nearby, or a digit is lost on the line; look for a "
        "relay, a loose contact, a cable without a shield. They are left out of the fit."
    )
    axis = "clock time"
    fingerprint = "isolated outliers"
    declared: ClassVar = (Parameter("spikes.rate", "1/s", "log"), Parameter("spikes.size", "V", "log"))
    confused_with: ClassVar = (
        Confusion("coloured_noise", "a longer recording: spikes last one reading each, and the next is as good as any"),
    )


@dataclass(frozen=True)
class Outliers:
    """Readings of one recording against those beside them: how far in sd, the sd in V, and where they may be judged.

    ``moves`` is how fast the model says that they move, V a sample.
    """

    trace: Trace
    far: Array
    sd_v: float
    looked_at: Mask
    moves: Array

    def beyond(self, threshold: float) -> Samples:
        """Return which readings lie alone beyond a threshold, as numbers of samples."""
        size = np.abs(self.far)
        beside = np.maximum(np.concatenate((size[1:], [0.0])), np.concatenate(([0.0], size[:-1])))
        out = np.flatnonzero((size > threshold) & (size > STANDS_OUT * beside) & self.looked_at)
        return np.asarray(out[~_repeated(self.trace, out)])

    def ranked(self, out: Samples) -> Array:
        """Return the share of the readings looked at that moves more slowly than each of ``out``: uniform by chance."""
        others = np.sort(self.moves[self.looked_at])
        return np.searchsorted(others, self.moves[out]) / (others.size + 1)


def outliers(trace: Trace, residual: Array, lsb_v: float = 0.0) -> Outliers:
    """Return every reading against the median of those beside it, where the model does not fail.

    Nor is any judged where readings follow each other farther than noise takes them: about their median they then
    scatter as no noise does. One that flickers between two steps of the ADC, ``lsb_v`` apart, is no outlier.
    """
    use = good(trace)
    alone = residual - median_filter(residual, BESIDE, mode="nearest")
    deviation = np.abs(alone)
    sd_v = _scatter(deviation[use], lsb_v)
    if lsb_v < sd_v:  # the median of readings in steps is a step, too
        share = uniform_filter1d((deviation == 0.0).astype(np.float64), AROUND, mode="nearest")
        use = np.asarray(use & (share < FOLLOWING / BESIDE), dtype=np.bool_)
        sd_v = _scatter(deviation[use], lsb_v)
    calm = TO_SD * median_filter(deviation, AROUND, mode="nearest") <= DISTURBED * sd_v
    answer = trace.y[:] - residual
    moves = uniform_filter1d(np.abs(np.diff(answer, prepend=answer[:1])), BESIDE, mode="nearest")
    return Outliers(trace, alone / (sd_v or np.inf), sd_v, use & calm & ~_jumps(trace.u[:]), moves)


def _scatter(deviation: Array, lsb_v: float) -> float:
    """Return the standard deviation, V, of readings that lie so far from the median of those about each."""
    if not deviation.size:
        return FLICKER * lsb_v
    sd_v = max(TO_SD / AMONG * float(np.median(deviation)), FLICKER * lsb_v)
    return max(sd_v, float(np.quantile(deviation, MOSTLY)) / MOSTLY_SD) if lsb_v else sd_v


def _jumps(u: Array) -> Mask:
    """Return where the stimulus has just jumped, or is about to."""
    jumps = np.flatnonzero(np.abs(np.diff(u)) > JUMP * np.ptp(u)) + 1
    near = np.zeros(u.size, dtype=bool)
    for shift in range(-1, AFTER_JUMP + 1):
        near[np.clip(jumps + shift, 0, u.size - 1)] = True
    return near if jumps.size < u.size // 20 else np.zeros(u.size, dtype=bool)


def _repeated(trace: Trace, out: Samples) -> Mask:
    """Return which outliers are met at the same place of another repeat of their step."""
    place, label = out.astype(np.int64), np.full(out.size, -1)
    labels = sorted({step.label for step in trace.steps})
    for step in trace.steps:
        inside = (out >= step.start) & (out < step.stop)
        place[inside] -= step.start
        label[inside] = labels.index(step.label)
    keys = label * (trace.size + 1) + place
    _, which, counts = np.unique(keys, return_inverse=True, return_counts=True)
    return np.asarray((counts[which] > 1) & (label >= 0))


def spikes(training: Sequence[Outliers], proof: Sequence[Outliers]) -> tuple[tuple[Spikes, ...], float]:
    """Return the spikes of the recordings, and the threshold in sd from which a reading is left out (inf for none).

    Chosen on the training recordings; not reported where the held-out ones show far fewer than they should.
    """
    count = sum(int(np.count_nonzero(o.looked_at)) for o in training)
    found = {t: [o.beyond(t) for o in training] for t in THRESHOLDS}
    chance = {t: _chance(sum(out.size for out in found[t]), count * _tail(t)) for t in THRESHOLDS}
    threshold = min(THRESHOLDS, key=lambda t: chance[t])
    p_value = len(THRESHOLDS) * chance[threshold]
    if p_value > CONVINCING or _faster(training, found[threshold]):
        return (), float("inf")
    sd_v = float(np.median([o.sd_v for o in training if o.sd_v > 0.0]))
    sizes = np.concatenate([np.abs(o.far[out]) * o.sd_v for o, out in zip(training, found[threshold], strict=True)])
    sizes = _without_tail(sizes / sd_v, threshold)
    rate_in, size, size_sd = _fitted(sizes, threshold)
    if size < threshold - ALONE:
        return (), float("inf")
    seen = sum(o.beyond(threshold).size for o in proof)
    expected = rate_in / count * _reached(size, threshold) * sum(int(np.count_nonzero(o.looked_at)) for o in proof)
    if poisson.cdf(seen, expected) < CONTRADICTED:
        return (), float("inf")
    span_s = sum(np.count_nonzero(o.looked_at) / o.trace.rate_hz for o in training)
    values = {
        "rate": _rate(sizes.size, rate_in / sizes.size / span_s),
        "size": Interval(sd_v * size, sd_v * (size - 1.96 * size_sd), sd_v * (size + 1.96 * size_sd)),
    }
    where = f"{sizes.size} in the runs fitted, {seen} in those held out"
    return (Spikes(values, p_value, where),), threshold


def _faster(training: Sequence[Outliers], out: Sequence[Samples]) -> bool:
    """Return whether some readings move faster than others do: how fast a spike meets them is chance."""
    ranks = np.concatenate([o.ranked(at) for o, at in zip(training, out, strict=True)])
    return float(gamma.sf(-np.sum(np.log1p(-ranks)), ranks.size)) < FASTER


def _without_tail(sizes: Array, threshold: float) -> Array:
    """Return sizes, in sd, without those that the tail of the noise adds to spikes which stand far above it."""
    typical = float(np.median(sizes))
    return sizes[sizes > 0.5 * typical] if typical > 2.0 * threshold else sizes


def _chance(seen: int, expected: float) -> float:
    """Return the probability of so many readings or more that far out, from noise alone."""
    return float(poisson.sf(seen - 1, expected)) if seen else 1.0


def _tail(threshold: float) -> float:
    """Return the share of Gaussian readings beyond a threshold on either side."""
    return float(2.0 * norm.sf(threshold))


def _reached(size: float, threshold: float) -> float:
    """Return the share of spikes of a size that lie beyond a threshold, noise added."""
    return float(norm.sf((threshold + LEANT - size) / SCATTER))


def _fitted(sizes: Array, threshold: float) -> tuple[float, float, float]:
    """Return how many spikes there are in all, their size and its standard error, in sd of the noise.

    Maximum likelihood for one size in Gaussian noise of which only what lies beyond the threshold is seen; where sizes
    scatter more than that, their rms.
    """
    sizes = sizes + LEANT
    scatter = float(np.std(sizes))
    if sizes.size > 2 and scatter > 2.0:
        size = float(np.sqrt(np.mean(np.square(sizes))))
        return float(sizes.size), size, float(np.std(np.square(sizes))) / (2.0 * size * np.sqrt(sizes.size))
    grid = np.linspace(max(threshold - 3.0, 0.5), float(np.max(sizes)) + 1.0, 2000)
    squares = np.sum(np.square(sizes)) - 2.0 * grid * np.sum(sizes) + sizes.size * np.square(grid)
    likelihood = -0.5 * squares / SCATTER**2 - sizes.size * norm.logsf((threshold + LEANT - grid) / SCATTER)
    size = float(grid[np.argmax(likelihood)])
    inside = grid[likelihood > np.max(likelihood) - 0.5]
    sd = max(0.5 * float(np.ptp(inside)), SCATTER / np.sqrt(sizes.size))
    return float(sizes.size / _reached(size, threshold)), size, sd


def _rate(seen: int, per_seen: float) -> Interval:
    """Return a rate with its exact Poisson interval, from what was seen and the rate that each stands for."""
    low, high = 0.5 * float(chi2.ppf(0.025, 2 * seen)), 0.5 * float(chi2.ppf(0.975, 2 * seen + 2))
    return Interval(per_seen * seen, per_seen * low, per_seen * high)
