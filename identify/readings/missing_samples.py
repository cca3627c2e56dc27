"""Were readings lost, so that what follows in the recording comes too early?

From the sample ``position`` on, the recording is ``count`` samples ahead of the model's answer. Every count is tried at
every position, on every second reading; the others have to confirm it. A loss is a step of the time axis by a whole
number of samples: the readings just before and just after it must each be in time once it is mended. A clock that runs
fast, or a delay, fails that.
"""

from dataclasses import dataclass, replace
from math import log
from typing import ClassVar, final

import numpy as np
from scipy.stats import chi2

from identify import kernels
from identify.effects.effect import Confusion
from identify.interval import Interval
from identify.noise import good, period_of, stretches
from identify.readings.blemish import Blemish
from identify.stage import Parameter
from identify.trace import Array, Mask, Trace, part

LONGEST = 1100  # samples: a block of a USB converter is 512 or 1024
WORK = 3e8  # products at most: bounds time on long recordings
CONVINCING = 40.0  # fall of chi-squared, beyond the price of the search
LAG_SD = 0.1  # samples: how well the lag on either side of a loss has to be known
NEAR = 0.03  # of the run's movement, looked at on either side at least: whole edges, not the start of one
LAG_OFF = 0.3  # samples by which it may differ once the loss is mended
PART_OF_PERIOD = 0.7  # of a stimulus, up to which a loss is told from readings taken twice
NEIGHBOURS = 8  # readings that are off together
STRETCHES = 40  # of a recording, over which sums show what hangs together
SHIFTS = (-3, -2, -1, 1, 2, 3)  # samples by which the whole recording may lie off: a delay, not a loss
PLAIN = 20  # samples: a loss of fewer is a delay from there on, and nothing else is
DROP = 3.84  # of chi-squared at the ends of a 95 % interval


@final
class MissingSamples(Blemish):
    """Readings that were never stored: what follows moves up."""

    id = "missing_samples"
    title = "lost readings"
    equation = "y'[k] = y[k + count] from position on"
    sentence = (
        "Readings were lost on the way to the computer, and what follows in the recording comes too early: {}. Read "
        "out faster or in larger blocks, or have the converter number its readings. They are put back as gaps."
    )
    axis = "clock time"
    fingerprint = "step in the time axis"
    declared: ClassVar = (Parameter("missing_samples.position", "s"), Parameter("missing_samples.count", "1"))
    confused_with: ClassVar = (
        Confusion("clock_skew", "the same run again: a clock that runs fast does so evenly, and again"),
        Confusion("dead_time", "the beginning of the run: a delay is there from the start"),
    )


@dataclass(frozen=True)
class Loss:
    """Readings lost in one recording: from sample ``at`` on, ``count`` of them; ``low`` to ``high`` bound ``at``.

    ``proof`` is the fall of chi-squared on readings that had no part in finding it.
    """

    trace: Trace
    at: int
    count: int
    low: int
    high: int
    proof: float

    def blemish(self) -> MissingSamples:
        """Return what is reported: the place on the clock of the recordings, in s."""
        start, step = self.trace.start_s, 1.0 / self.trace.rate_hz
        position = Interval(*(start + step * k for k in (self.at, self.low - 0.5, self.high + 0.5)))
        count = Interval(*(float(self.count),) * 3)
        p_value = float(chi2.sf(self.proof, 1))
        values = {"position": position, "count": count}
        return MissingSamples(values, p_value, f"run {self.trace.name}", (position.low, position.high, 1.0))

    def mended(self) -> Trace:
        """Return the recording with a gap where readings were lost, and all that follows in its time."""
        return with_gap(self.trace, self.at, self.count)


def with_gap(trace: Trace, at: int, count: int) -> Trace:
    """Return a recording with ``count`` readings that do not count put in at ``at``, and as many less at its end."""
    y, use = trace.y[:], np.array(good(trace))
    bridge = np.linspace(float(y[max(at - 1, 0)]), float(y[at]), count + 2)[1:-1]
    late = np.concatenate((y[:at], bridge, y[at : y.size - count]))
    valid = np.concatenate((use[:at], np.zeros(count, dtype=bool), use[at : use.size - count]))
    return replace(trace, y=late, valid=valid)


def loss_in(trace: Trace, answer: Array, noise_v: float, rough: bool = False) -> Loss | None:
    """Return the loss of readings that a recording shows against the model's answer, None when it shows none.

    A ``rough`` look does not ask that both sides are in time: the model may have been led astray by the loss itself.
    """
    y, use = trace.y[:], good(trace)
    longest = int(min(LONGEST, y.size // 3, WORK / y.size, PART_OF_PERIOD * _shortest_period(trace)))
    if longest < 1:
        return None
    even = use & (np.arange(y.size) % 2 == 0)
    gains = np.zeros(longest)
    kernels.best_cuts(y, answer, even, gains)
    price = 2.0 * log(longest * y.size)
    count = int(np.argmax(gains)) + 1
    first = _latest(_gains(y, answer, even, count))
    scatter = max(noise_v, _after(y, answer, use, first, count, rough))
    if gains[count - 1] < (CONVINCING + price) * scatter**2:
        return None
    others = use & ~even
    late = max(_as_delay(y, answer, others, at) for at in ((0, first) if count > PLAIN else (0,)))
    proof = (_gains(y, answer, others, count)[first] - late) / scatter**2
    if proof < CONVINCING or not _certain(y, answer, others, first, count, CONVINCING + price):
        return None
    if not (rough or _in_time(y, answer, use, first, count, scatter)):
        return None
    first, low, high = _placed(y, answer, use, count, scatter)
    return Loss(trace, first, count, low, high, proof)


def _shortest_period(trace: Trace) -> float:
    """Return the shortest period of the stimulus in samples; infinite when it has none."""
    periods = [period_of(part(trace.u, start, stop)) for start, stop in stretches(trace)]
    return float(min((period for period in periods if period), default=np.inf))


def _as_delay(y: Array, answer: Array, use: Mask, at: int) -> float:
    """Return by how much the sum of squares falls at most when all from a sample on is moved in time, V^2.

    Moved by samples, or by any part of one: where a stimulus comes again after 692.3 samples, a loss of 692 looks like
    a delay of a third of a sample.
    """
    slope = np.where(use, np.gradient(answer), 0.0)[at:]
    by_part = float(slope @ (y - answer)[at:]) ** 2 / max(float(slope @ slope), 1e-300)
    inside = slice(max(at, *SHIFTS), y.size - max(SHIFTS))
    here = np.square(y - answer)[inside]
    falls = [here - np.square(y - np.roll(answer, shift))[inside] for shift in SHIFTS]
    return max(by_part, *(float(np.sum(fall[use[inside]])) for fall in falls))


def _after(y: Array, answer: Array, use: Mask, at: int, count: int, rough: bool) -> float:
    """Return the scatter of readings about the answer once the loss is mended, V: a model that fails proves less.

    What hangs together in the misfit lets its products with the slope scatter more: that counts as more scatter, but
    not in a ``rough`` look, where the loss itself may have made the model late.
    """
    misfit = _misfits(y, answer, at, count)
    plain = float(np.mean(np.square(misfit[use[: misfit.size]])))
    if rough:
        return float(np.sqrt(plain))
    moving = np.where(use[: misfit.size], np.delete(np.gradient(answer), np.s_[at : at + count]), 0.0)
    sums = [float(np.sum(piece)) for piece in np.array_split(misfit * moving, STRETCHES)]
    together = float(np.sum(np.square(sums))) / max(float(moving @ moving), 1e-300)
    return float(np.sqrt(max(plain, together)))


def _misfits(y: Array, answer: Array, at: int, count: int) -> Array:
    """Return readings less the answer at the times they were taken."""
    return np.concatenate((y[:at] - answer[:at], y[at : y.size - count] - answer[at + count :]))


def _gains(y: Array, answer: Array, use: Mask, count: int) -> Array:
    """Return by how much the sum of squares of the readings in use falls when a loss is mended at each sample, V^2."""
    stop = y.size - count
    fall = np.square(y[:stop] - answer[:stop]) - np.square(y[:stop] - answer[count:])
    return np.cumsum(np.where(use[:stop], fall, 0.0)[::-1])[::-1]


def _latest(gains: Array) -> int:
    """Return the last sample of those at which most is gained: readings that do not count change nothing."""
    return gains.size - 1 - int(np.argmax(gains[::-1]))


def _certain(y: Array, answer: Array, use: Mask, at: int, count: int, convincing: float) -> bool:
    """Return whether the answer moved by the loss is in the readings, beyond what the misfit it leaves makes of that.

    Of a coarse ADC most readings are where the model has them, and few are off, each by a whole step, with its
    neighbours: there a few readings decide by how much a sum of squares falls.
    """
    here, stop = slice(at, y.size - count), y.size - count
    moved = np.where(use[here], answer[at + count : stop + count] - answer[here], 0.0)
    along, left = (moved * (y[here] - one) for one in (answer[here], answer[at + count : stop + count]))
    groups = np.add.reduceat(left, np.arange(0, left.size, NEIGHBOURS))
    return float(np.sum(along)) ** 2 > convincing * float(groups @ groups)


def _in_time(y: Array, answer: Array, use: Mask, at: int, count: int, scatter: float) -> bool:
    """Return whether the readings on either side of a mended loss have the same lag against the answer."""
    misfit, slope = _misfits(y, answer, at, count), np.gradient(answer)
    kept = np.r_[0:at, at + count : answer.size]
    moving = np.where(use[: misfit.size], slope[kept], 0.0)
    enough = max((scatter / LAG_SD) ** 2, NEAR * float(moving @ moving))
    lags = []
    for near in (np.arange(at - 1, -1, -1), np.arange(at, misfit.size)):
        energy = np.cumsum(np.square(moving[near]))
        if energy.size == 0 or energy[-1] < enough:
            return False
        size, off, lag = _whole(energy, enough), float("inf"), 0.0
        while off > LAG_SD and size < 2 * near.size:
            window = near[:size]
            lag, known = _lag(misfit[window], moving[window], answer[kept[window]])
            off, size = scatter * known, 2 * size
        if off > LAG_SD:
            return False
        lags.append(lag)
    return abs(lags[1] - lags[0]) < LAG_OFF


def _whole(energy: Array, enough: float) -> int:
    """Return how many samples hold enough movement, and half as many again: the last edge to its end."""
    return int(1.5 * (np.searchsorted(energy, enough) + 1))


def _lag(misfit: Array, moving: Array, answer: Array) -> tuple[float, float]:
    """Return by how many samples readings are early, whatever their offset, drift and scale, and its sd per V."""
    others = np.stack((np.ones(misfit.size), np.arange(misfit.size), answer), axis=1)
    own = moving - others @ np.linalg.lstsq(others, moving, rcond=None)[0]
    energy = float(own @ own)
    return (float(own @ misfit) / energy, energy**-0.5) if energy > 0.0 else (0.0, float("inf"))


def _placed(y: Array, answer: Array, use: Mask, count: int, scatter: float) -> tuple[int, int, int]:
    """Return where a loss of ``count`` readings begins, most likely and at the ends of its 95 % interval."""
    gain = _gains(y, answer, use, count)
    near = np.flatnonzero(gain > np.max(gain) - DROP * scatter**2)
    return int(np.argmax(gain)), int(near[0]), int(near[-1])
