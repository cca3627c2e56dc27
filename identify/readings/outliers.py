"""Which single readings lie far from those beside them, for no reason that the model or the stimulus gives?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.stats import chi2, gamma, mannwhitneyu, norm, poisson

from identify.interval import Interval
from identify.noise import good
from identify.trace import Array, Mask, Trace

BESIDE, AROUND = 17, 201  # readings whose median is the level, and whose median deviation is the scatter
DISTURBED = 1.3  # times the overall scatter: the model fails there, and no reading is judged
FOLLOWING = 2.0  # times as often as in noise that a reading may be the median of those about it: else it goes elsewhere
STANDS_OUT = 2.0  # times the readings on either side: a corner that the model rounds is not one reading
FLICKER = 0.35  # of an LSB: as a standard deviation it leaves one step of the ADC within every threshold
JUMP = 0.02  # of the range of u: a step of the stimulus, at which a reading may be off for other reasons
AFTER_JUMP = 4  # samples
Samples = NDArray[np.intp]  # numbers of samples
MOSTLY, MOSTLY_SD = 0.95, float(norm.ppf(0.975))  # of readings, and within how many sd so many Gaussian ones lie
SCATTER = 1.05  # sd of noise, of a reading off the median of the 17 it is among, by simulation of two million
TO_SD = 1.0 / norm.ppf(0.75)  # a median deviation as a standard deviation
AMONG = 0.930  # median deviation of Gaussian readings from the median of 17 over that from their mean, by simulation
THRESHOLDS = (4.5, 5.0, 5.5, 6.5, 8.0)  # standard deviations
FAR_ABOVE = 2.0  # times the threshold, beyond which readings stand far above the tail of any noise
CONVINCING = 1e-6  # chance of so many readings that far out
CONTRADICTED = 1e-3  # chance of so few of them on held-out readings
BY_MOTION = 1e-5  # chance, or odds, of what comes by itself, below which motion has to do with it


@dataclass(frozen=True)
class Outliers:
    """Readings of one recording against those beside them: how far in V and in sd, the sd in V, and where judged.

    ``moves`` is how fast the model says that they move, V a sample, and ``rises`` that upwards.
    """

    trace: Trace
    off_v: Array
    far: Array
    sd_v: float
    looked_at: Mask
    moves: Array
    rises: Array

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


def outliers(trace: Trace, residual: Array, lsb_v: float = 0.0, evened: Array | None = None) -> Outliers:
    """Return every reading against the median of those beside it, where the model does not fail.

    ``residual`` is what that leaves, V, shape (N,), and ``evened`` that as if all readings scattered alike, where they
    do not. Nor is any judged where readings follow each other farther than noise takes them: about their median they
    then scatter as no noise does. One that flickers between two steps of the ADC, ``lsb_v`` apart, is no outlier.
    """
    use = good(trace)
    off_v = _alone(residual)
    alone = off_v if evened is None else _alone(evened)
    deviation = np.abs(alone)
    sd_v = _scatter(deviation[use], lsb_v)
    if lsb_v < sd_v:  # the median of readings in steps is a step, too
        share = uniform_filter1d((deviation == 0.0).astype(np.float64), AROUND, mode="nearest")
        use = np.asarray(use & (share < FOLLOWING / BESIDE), dtype=np.bool_)
        sd_v = _scatter(deviation[use], lsb_v)
    calm = TO_SD * median_filter(deviation, AROUND, mode="nearest") <= DISTURBED * sd_v
    answer = trace.y[:] - residual
    rises = np.diff(answer, prepend=answer[:1])
    moves = uniform_filter1d(np.abs(rises), BESIDE, mode="nearest")
    moves = np.maximum(moves, 0.0)  # where nothing moves a running sum ends below zero by its rounding
    return Outliers(trace, off_v, alone / (sd_v or np.inf), sd_v, use & calm & ~_jumps(trace.u[:]), moves, rises)


def _alone(residual: Array) -> Array:
    """Return by how much every value lies off the median of those beside it."""
    return np.asarray(residual - median_filter(residual, BESIDE, mode="nearest"))


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


@dataclass(frozen=True)
class FarOut:
    """Readings of several recordings that lie so far out, beyond ``threshold`` sd, as noise alone would not.

    ``out`` are their numbers in each recording, ``count`` all readings that were looked at; ``p_value`` is the chance
    of as many, every threshold paid.
    """

    runs: Sequence[Outliers]
    threshold: float
    out: Sequence[Samples]
    count: int
    p_value: float

    @property
    def sd_v(self) -> float:
        """Return the noise of the recordings, V."""
        return float(np.median([o.sd_v for o in self.runs if o.sd_v > 0.0]))

    @property
    def sizes_v(self) -> Array:
        """Return how far out they lie, V."""
        return np.concatenate([np.abs(o.off_v[out]) for o, out in zip(self.runs, self.out, strict=True)])

    @property
    def sizes_sd(self) -> Array:
        """Return the same, in standard deviations of the noise where each lies."""
        return np.concatenate([np.abs(o.far[out]) for o, out in zip(self.runs, self.out, strict=True)])

    @property
    def noise_v(self) -> Array:
        """Return the noise of each where it lies, V."""
        pairs = zip(self.runs, self.out, strict=True)
        return np.concatenate([np.abs(o.off_v[out] / o.far[out]) for o, out in pairs])

    @property
    def moves_v(self) -> Array:
        """Return how fast the readings move there, V a sample."""
        return np.concatenate([o.moves[out] for o, out in zip(self.runs, self.out, strict=True)])

    @property
    def span_s(self) -> float:
        """Return how long was looked, s."""
        return float(sum(np.count_nonzero(o.looked_at) / o.trace.rate_hz for o in self.runs))

    @property
    def by_motion(self) -> bool:
        """Return whether motion has to do with them: what comes by itself meets readings of any speed.

        Where nearly all move as fast, those that are the one before once more are no faster, but off by one step of it.
        """
        return self._faster or self._one_late

    @cached_property
    def _faster(self) -> bool:
        """Return whether some move faster than others do: how fast what comes by itself meets them is chance."""
        ranks = np.concatenate([o.ranked(at) for o, at in zip(self.runs, self.out, strict=True)])
        return float(gamma.sf(-np.sum(np.log1p(-ranks)), ranks.size)) < BY_MOTION

    @cached_property
    def _one_late(self) -> bool:
        """Return whether each is as far off as the reading before it is, likelier by far than one size either way."""
        pairs = list(zip(self.runs, self.out, strict=True))
        late, noise = np.concatenate([o.rises[out] for o, out in pairs]), SCATTER * self.noise_v
        off, size = np.concatenate([o.off_v[out] for o, out in pairs]), np.median(self.sizes_v)
        thrown, before = (0.5 * np.sum(np.square(rest / noise)) for rest in (np.abs(off) - size, off + late))
        return bool(thrown + off.size * np.log(2.0) - before > -np.log(BY_MOTION))

    def chance_along(self, along: Sequence[Array]) -> float:
        """Return the chance that they stand as high as they do among all that were looked at, of values (N,) a run."""
        those = np.concatenate([each[at] for each, at in zip(along, self.out, strict=True)])
        every = np.concatenate([each[o.looked_at] for each, o in zip(along, self.runs, strict=True)])
        return float(mannwhitneyu(those, every, alternative="greater").pvalue)

    def where(self, size: int, proof: Sequence[Outliers]) -> str:
        """Return in words how many are in the runs fitted and in those held out."""
        return f"{size} in the runs fitted, {sum(o.beyond(self.threshold).size for o in proof)} in those held out"


def far_out(runs: Sequence[Outliers]) -> FarOut | None:
    """Return the readings that lie farther out than noise alone takes them; None where that may be noise.

    Several thresholds are tried, and paid for.
    """
    count = moving(runs, 0.0)
    found = {t: [o.beyond(t) for o in runs] for t in THRESHOLDS}
    chance = {t: _chance(sum(out.size for out in found[t]), count * _tail(t)) for t in THRESHOLDS}
    threshold = min(THRESHOLDS, key=lambda t: chance[t])
    p_value = len(THRESHOLDS) * chance[threshold]
    return FarOut(runs, threshold, found[threshold], count, p_value) if p_value <= CONVINCING else None


def contradicted(proof: Sequence[Outliers], threshold: float, share: float, least_v: float = 0.0) -> bool:
    """Return whether recordings kept back show far fewer readings beyond a threshold than a share of them.

    Of those that move by ``least_v`` [V] a sample or more.
    """
    seen = sum(int(np.count_nonzero(o.moves[o.beyond(threshold)] >= least_v)) for o in proof)
    return float(poisson.cdf(seen, share * moving(proof, least_v))) < CONTRADICTED


def moving(runs: Sequence[Outliers], least_v: float) -> int:
    """Return how many of the readings that were looked at move by ``least_v`` [V] a sample or more."""
    return sum(int(np.count_nonzero(o.looked_at & (o.moves >= least_v))) for o in runs)


def poisson_rate(seen: int, per_seen: float) -> Interval:
    """Return a rate with its exact Poisson interval, from what was seen and the rate that each stands for."""
    low, high = 0.5 * float(chi2.ppf(0.025, 2 * seen)), 0.5 * float(chi2.ppf(0.975, 2 * seen + 2))
    return Interval(per_seen * seen, per_seen * low, per_seen * high)


def _chance(seen: int, expected: float) -> float:
    """Return the probability of so many readings or more that far out, from noise alone."""
    return float(poisson.sf(seen - 1, expected)) if seen else 1.0


def _tail(threshold: float) -> float:
    """Return the share of Gaussian readings beyond a threshold on either side."""
    return float(2.0 * norm.sf(threshold))
