"""How noisy is the reading, told from what repeats and never from the residual of a model?

Noise is taken as what changes from one sample to the next where nothing else does: between two periods of the same
stimulus, or within a settled dwell. First differences in time remove what is slow against a sample (hum, droop,
drift), which is physics to be explained and not noise.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from identify.trace import LONG, Array, Mask, Samples, Trace, blocks, part, regrouped

EXACT = 1e-9  # of the range of readings: what differs by less is the same reading computed twice
OFF_GRID = 0.05  # of a step, that a reading on a grid lies off it at most
ENOUGH = 50  # differences needed before an estimate is trusted
DWELLS_SHARE = 2.0 / 3.0  # neighbouring differences share a reading: 1 / (1 + 2 / 4) as many are independent
PERIODS_SHARE = DWELLS_SHARE**2  # differences in time of differences between periods share readings both ways
FIR_TAPS = 64
NORMAL_MEDIAN = 0.6745  # median of the magnitude of a normal number, in its standard deviations
SECOND_DIFFERENCE = float(np.sqrt(6.0))  # times the noise: that of a second difference
FIR_ROWS = 200_000  # samples a free filter is fitted to, at most
BEGINNINGS = tuple(1 << bits for bits in (16, 18, 20, 21))  # samples in which the period of a long signal is looked for


@dataclass(frozen=True)
class Noise:
    """The standard deviation of one reading in V, and where that figure comes from.

    ``freedom`` is how many independent readings would tell it as well; infinite for a figure that is taken as given.
    """

    rms_v: float
    origin: str
    freedom: float = float("inf")


@dataclass(frozen=True)
class _Pool:
    """A sum of squares of differences, each of variance ``gain`` times the noise's."""

    total: float = 0.0
    count: int = 0

    def with_differences(self, e: Array, gain: float) -> "_Pool":
        """Return the pool with more differences in it."""
        return _Pool(self.total + float(e @ e) / gain, self.count + e.size)


def noise_of(traces: Sequence[Trace], settle_s: float, declared_v: float | None = None) -> Noise:
    """Return the noise of a set of recordings made on one bench.

    ``settle_s`` is how long the rig takes to settle after a step. Sources in order of trust: repeated periods, settled
    dwells, the rig file's figure, and upper bounds: the residual of a free linear filter, the scatter of readings about
    a line through their neighbours. What repeats to the last digit tells of no noise. Raises ValueError when none of
    them is available, and when every reading is one value.
    """
    low, high = _range(traces)
    if low == high:
        raise ValueError(
            f"every reading is {low:.6g} V: nothing of the rig reaches the ADC, or less than a step of it; check the "
            "cable, the channel and the supply"
        )
    exact, floor = EXACT * (high - low), quantisation_rms(traces)
    sources = (("repeated periods", _of_periods, PERIODS_SHARE), ("settled dwells", _of_dwells, DWELLS_SHARE))
    for origin, differences, share in sources:
        pool = _Pool()
        for trace in traces:
            pool = differences(trace, round(settle_s * trace.rate_hz), pool)
        rms_v = max(float(np.sqrt(pool.total / max(pool.count, 1))), floor)
        if pool.count >= ENOUGH and rms_v > exact:
            return Noise(rms_v, origin, share * pool.count)
    if declared_v:
        return Noise(max(declared_v, floor), "the rig file")
    bounds = {
        "the residual of a free linear filter, an upper bound": _free_filter_rms,
        "the scatter about a line through neighbouring readings, an upper bound": _scatter_rms,
    }
    told = [(max(rms(trace), floor), origin) for origin, rms in bounds.items() for trace in traces]
    if not (told := [(rms_v, origin) for rms_v, origin in told if exact < rms_v < float("inf")]):
        raise ValueError("no repeats, no settled dwell and no noise in the rig file: the noise cannot be told")
    return Noise(*min(told))


def _range(traces: Sequence[Trace]) -> tuple[float, float]:
    """Return the lowest and the highest reading of all recordings, V; infinity and its negative where there is none."""
    readings = (t.y[a:b][good(t)[a:b]] for t in traces for a, b in blocks(0, t.size))
    ends = [(float(np.min(y)), float(np.max(y))) for y in readings if y.size]
    return min((low for low, _ in ends), default=np.inf), max((high for _, high in ends), default=-np.inf)


def quantisation_rms(traces: Sequence[Trace]) -> float:
    """Return the noise of the ADC's steps, LSB / sqrt(12), in V; 0 when the readings lie on no coarse grid."""
    return grid_step_v(traces) / float(np.sqrt(12.0))


def grid_step_v(traces: Sequence[Trace]) -> float:
    """Return the step of the grid on which the readings of every recording lie, V; 0 when they lie on none.

    A recording of one level lies on any grid; each may have an offset of its own.
    """
    step = min((_smallest_step(trace) for trace in traces), default=float("inf"))
    return step if np.isfinite(step) and all(_lies_on(trace, step) for trace in traces) else 0.0


def _smallest_step(trace: Trace) -> float:
    """Return the smallest difference between the first readings, infinity where all are equal."""
    levels = np.unique(trace.y[:LONG][good(trace)[:LONG]])
    return float(np.min(np.diff(levels))) if levels.size > 1 else float("inf")


def _lies_on(trace: Trace, step: float) -> bool:
    """Return whether all readings that were received are whole steps from the first of them."""
    ok = good(trace)
    received = (trace.y[a:b][ok[a:b]] for a, b in blocks(0, trace.size))
    start: float | None = None
    for readings in (each for each in received if each.size):
        start = float(readings[0]) if start is None else start
        offsets = (readings - start) / step
        if float(np.max(np.abs(offsets - np.rint(offsets)))) >= OFF_GRID:
            return False
    return True


def good(trace: Trace) -> Mask:
    """Return which samples were received, shape (N,), read-only; one byte stands for all when none was lost."""
    return np.broadcast_to(np.True_, trace.size) if trace.valid is None else trace.valid


def repeated(trace: Trace, settle: int) -> Iterator[tuple[int, int, int]]:
    """Yield [first, stop) of every settled stretch of two periods of a stimulus or more, and its period, in samples."""
    for start, stop in stretches(trace):
        period = period_of(part(trace.u, start, stop))
        first = start + max(settle, period)
        if period and stop - first >= 2 * period:
            yield first, stop, period


def _of_periods(trace: Trace, settle: int, pool: _Pool) -> _Pool:
    """Add the differences between successive periods of a repeated stimulus, settled ones only."""
    ok = good(trace)
    for first, stop, period in repeated(trace, settle):
        for a, b in blocks(first, stop - period - 1):
            once, again = slice(a, b + 1), slice(a + period, b + 1 + period)
            both = ok[once] & ok[again]
            e = np.diff(trace.y[again] - trace.y[once])[both[1:] & both[:-1]]
            pool = pool.with_differences(e, 4.0)
    return pool


def _of_dwells(trace: Trace, settle: int, pool: _Pool) -> _Pool:
    """Add the differences between successive samples where the stimulus has long been constant."""
    ok = good(trace)
    stretches = (ab for dwell in settled_dwells(trace.u, settle) for ab in blocks(dwell[0], dwell[1] - 1))
    found = (np.diff(trace.y[a : b + 1])[ok[a : b + 1][1:] & ok[a : b + 1][:-1]] for a, b in stretches)
    for e in regrouped(found):
        pool = pool.with_differences(e, 2.0)
    return pool


def settled_dwells(u: Samples, settle: int) -> list[tuple[int, int]]:
    """Return the stretches [start, stop) in which u has not changed for more than ``settle`` samples."""
    found: list[tuple[int, int]] = []
    since = 0
    for start, stop in blocks(1, u.size):
        changes = start + np.flatnonzero(np.diff(u[start - 1 : stop]))
        edges = np.concatenate(([since], changes))
        long = np.flatnonzero(np.diff(edges) > settle + 1)
        found += zip((edges[long] + settle + 1).tolist(), edges[long + 1].tolist(), strict=True)
        since = int(edges[-1])
    return found if u.size - since <= settle + 1 else [*found, (since + settle + 1, u.size)]


def stretches(trace: Trace) -> list[tuple[int, int]]:
    """Return the stretches to look for periods in: runs of steps with one label, or the whole trace."""
    joined: list[tuple[str, int, int]] = []
    for step in trace.steps:
        if joined and joined[-1][0] == step.label and joined[-1][2] == step.start:
            joined[-1] = (step.label, joined[-1][1], step.stop)
        else:
            joined.append((step.label, step.start, step.stop))
    return [(start, stop) for _, start, stop in joined] or [(0, trace.size)]


def period_of(u: Samples) -> int:
    """Return the shortest period of u in samples, 0 when it has none that fits twice.

    In a signal longer than ``LONG`` it is looked for in ever longer beginnings, so that one of more than half the
    longest of them is not found; all of the signal must then repeat with it.
    """
    if u.size <= LONG:
        return _period_within(u[:])
    for size in BEGINNINGS:
        period = _period_within(u[:size])
        if period and _repeats(u, period, _alike_v(u[:size])):
            return period
    return 0


def _alike_v(u: Array) -> float:
    """Return up to which difference two samples of u count as the same, V."""
    return 1e-4 * float(np.max(np.abs(u - np.mean(u))))


def _repeats(u: Samples, period: int, tolerance_v: float) -> bool:
    """Return whether all of u is the same one period later."""
    stretches = blocks(0, u.size - period)
    return all(float(np.max(np.abs(u[a + period : b + period] - u[a:b]))) < tolerance_v for a, b in stretches)


def _period_within(u: Array) -> int:
    """Return the shortest period of a signal in memory.

    The squared distance between u and itself shifted is zero at a period; all shifts are had from one transform.
    """
    n = u.size
    centred = u - np.mean(u)
    if n < 4 or not np.any(np.abs(np.diff(u)) > 0.0):
        return 0
    size = 1 << int(np.ceil(np.log2(2 * n)))
    spectrum = np.fft.rfft(centred, size)
    overlap = np.fft.irfft(np.abs(spectrum) ** 2, size)[: n // 2 + 1]
    energy = np.concatenate(([0.0], np.cumsum(np.square(centred))))
    shifts = np.arange(n // 2 + 1)
    distance = energy[n - shifts] + (energy[n] - energy[shifts]) - 2.0 * overlap
    near = np.flatnonzero(distance[1:] < 1e-6 * energy[n]) + 1
    tolerance_v = _alike_v(u)
    return next((int(shift) for shift in near[:200] if _repeats(u, int(shift), tolerance_v)), 0)


def _free_filter_rms(trace: Trace) -> float:
    """Return the residual rms of the best finite impulse response from u to y, V: noise plus what is not linear."""
    if trace.size < 20 * FIR_TAPS or trace.size - trace.size // 2 < FIR_TAPS:
        return float("inf")
    count = min(trace.size - FIR_TAPS, FIR_ROWS)
    padded = np.concatenate((np.zeros(FIR_TAPS), trace.u[: FIR_TAPS + count]))
    view = np.lib.stride_tricks.sliding_window_view(padded, FIR_TAPS + 1)[:, ::-1]
    rows = np.column_stack((view[FIR_TAPS:], np.ones(count)))
    target = trace.y[FIR_TAPS : FIR_TAPS + count]
    ok = good(trace)[FIR_TAPS : FIR_TAPS + count]
    rows, target = rows[ok], target[ok]
    taps = np.linalg.lstsq(rows, target, rcond=1e-8)[0]
    misfit = target - rows @ taps
    return float(np.sqrt(misfit @ misfit / max(target.size - rows.shape[1], 1)))


def _scatter_rms(trace: Trace) -> float:
    """Return how far readings scatter about the middle of the two beside them, V: noise plus how fast they turn.

    From the median: the few at which a signal has a corner do not count.
    """
    y, ok = trace.y[:FIR_ROWS], good(trace)[:FIR_ROWS]
    off = np.abs(np.diff(y, 2))[ok[2:] & ok[1:-1] & ok[:-2]]
    return float(np.median(off)) / NORMAL_MEDIAN / SECOND_DIFFERENCE if off.size >= ENOUGH else float("inf")
