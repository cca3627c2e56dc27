"""Is the noise of a reading the same everywhere, or does it go with the level, the rate or the clock?

Told from second differences in time of what a model leaves, in which what is slow against a sample is small, and
asked to be as neighbouring readings of white noise are: what is new in every reading has come in behind G2, which lets
nothing so quick pass. No physics of the signal path makes it, known or missing, so that the model may be under
suspicion. Where such scatter goes with something, readings are weighed by how much each scatters.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, final

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.stats import chi2

from identify.colour import Colour, Sizes
from identify.interval import Interval
from identify.noise import good, grid_step_v
from identify.readings.blemish import Blemish
from identify.readings.outliers import TO_SD, Samples
from identify.stage import Parameter
from identify.trace import Array, Trace
from identify.unnamed.correction import UNNAMED

WITHIN = 17  # readings whose mean is the level
# Shares of all values at the ends of stretches of a coordinate: finer towards its ends, where few readings may move
# much faster, or stand much higher, than most. LEAST values make a stretch.
SHARES = np.sort([*np.linspace(0.0, 1.0, 33), *(2.0 ** -np.arange(6, 10)), *(1.0 - 2.0 ** -np.arange(6, 10))])
LEAST, LASTING, FEW = 300, 1000, 8  # values; those in a row that make a stretch of the clock; stretches at least
# Of second differences, which share readings, so many independent values would tell as much: squares of correlations.
SHARE = 1.0 / (1.0 + 2.0 * ((2.0 / 3.0) ** 2 + (1.0 / 6.0) ** 2))
FAR_OUT = 4.0  # sd
APART = 20  # values in a row, of which the first and the last share readings with others
CONVINCING = 1e-6  # probability of as much by chance
CONFIRMING = 10.0  # twice the gain of the log-likelihood on readings kept back
MATERIAL = 0.003  # of that an independent value: sd that differ by a twenty-fifth; less moves no odds
COARSE = 0.5  # of the noise: wider steps of the ADC make scatter of their own
WHITE, ABOUT = -2.0 / 3.0, 0.1  # correlation of neighbouring second differences of white noise, and how near is near
THROUGH, DOUBT = -0.5, 3.0  # of what has come through a lag, and by how many standard errors that is excluded
Left = tuple[Trace, Array]  # a recording and what a model leaves of its readings, V, shape (N,)


@dataclass(frozen=True)
class UnevenNoise(Blemish):
    """Noise that is larger in some readings than in others."""

    id = UNNAMED
    form = "uneven noise"
    equation = "y' = y + e s(c), e white of rms 1, c what it goes with"
    declared: ClassVar = (Parameter("noise.least", "V", "log"), Parameter("noise.most", "V", "log"))

    @staticmethod
    def coordinate(trace: Trace) -> Array:
        """Return what the noise of every reading may go with, shape (N,)."""
        raise NotImplementedError

    @staticmethod
    def edges(where: Array) -> Array:
        """Return the ends of the stretches of it in each of which one sd is told, from where there are values."""
        return np.unique(np.quantile(where, SHARES))


def _level(trace: Trace) -> Array:
    """Return the readings freed of most of their noise, V, shape (N,)."""
    return np.asarray(uniform_filter1d(np.asarray(trace.y[:], dtype=np.float64), WITHIN, mode="nearest"))


@final
class OverRate(UnevenNoise):
    """Noise that goes with how fast the reading moves."""

    title = "noise that goes with how fast the reading moves"
    axis = "rate of y"
    fingerprint = "scatter against the size of the rate"
    sentence = (
        "The readings scatter more or less, the faster they move: {}. Where it is more, the moments at which they are "
        "taken are uneven, as behind a clock that jitters or a trigger that comes by software."
    )

    @staticmethod
    def coordinate(trace: Trace) -> Array:
        """Return how fast the readings move either way, V/s, shape (N,)."""
        level = _level(trace)
        return np.abs(np.diff(level, prepend=level[:1])) * trace.rate_hz


@final
class OverLevel(UnevenNoise):
    """Noise that goes with the level of the reading."""

    title = "noise that goes with the level of the reading"
    axis = "level of y"
    fingerprint = "scatter against the level"
    sentence = (
        "The readings scatter the more or less, the higher they are: {}. Something multiplies the reading by noise, as "
        "a reference of the ADC that is not quiet, or a part of the input is noisy at some levels."
    )

    @staticmethod
    def coordinate(trace: Trace) -> Array:
        """Return the level, V, shape (N,)."""
        return _level(trace)


@final
class OverClock(UnevenNoise):
    """Noise that was larger at some times."""

    title = "noise that changes with the clock"
    axis = "clock time"
    fingerprint = "scatter against clock time"
    sentence = (
        "The readings scatter more at some times than at others: {}. Something was switched, moved or came loose "
        "meanwhile, whatever was played."
    )

    @staticmethod
    def coordinate(trace: Trace) -> Array:
        """Return the clock, s, shape (N,)."""
        return trace.clock_s

    @staticmethod
    def edges(where: Array) -> Array:
        """Return the ends of stretches of the clock: what comes and goes may do so at any time."""
        return np.unique(np.quantile(where, np.linspace(0.0, 1.0, max(where.size // LASTING, 1) + 1)))


KINDS: tuple[type[UnevenNoise], ...] = (OverLevel, OverRate, OverClock)


@dataclass(frozen=True)
class Uneven:
    """Noise that goes with something: its sd, V, at knots of that, both of shape (bins,), and what tells of it."""

    blemish: UnevenNoise
    knots: Array
    sd_v: Array

    def of(self, trace: Trace) -> Array:
        """Return the sd of every reading of a recording, V, shape (N,)."""
        return np.interp(self.blemish.coordinate(trace), self.knots, self.sd_v)

    def evened(self, trace: Trace, left: Array) -> Array:
        """Return what is left of a recording, V, as if all its readings scattered alike, shape (N,)."""
        sd_v = self.of(trace)
        return np.asarray(left * (float(np.median(sd_v)) / sd_v))

    def colour(self, trace: Trace, rms_v: float) -> Colour:
        """Return how a fit is to weigh the readings of a recording, ``rms_v`` standing for a reading's noise."""
        return Colour(sizes=Sizes(self.of(trace) / rms_v))


@dataclass(frozen=True)
class _Scatter:
    """What noise alone makes, as values of its sd, V, each beside the one before it, and where they were read."""

    values: Array
    before: Array
    at: dict[type[UnevenNoise], Array]

    def beside(self, other: "_Scatter") -> "_Scatter":
        """Return these values and others."""
        at = {kind: np.concatenate((each, other.at[kind])) for kind, each in self.at.items()}
        return _Scatter(np.append(self.values, other.values), np.append(self.before, other.before), at)

    def part(self, which: int) -> "_Scatter":
        """Return the first or the second of every two stretches of ``APART`` values."""
        use = np.arange(self.values.size) // APART % 2 == which
        return _Scatter(self.values[use], self.before[use], {kind: each[use] for kind, each in self.at.items()})


@dataclass(frozen=True)
class _Told:
    """What speaks for noise that goes with one thing: knots of that, the sd there, V, and how many values tell each."""

    gain: float
    kind: type[UnevenNoise]
    knots: Array
    sd_v: Array
    count: Array

    @property
    def ends(self) -> dict[str, Interval]:
        """Return the least and the largest sd, V."""
        doubt = 1.96 / np.sqrt(2.0 * SHARE * self.count)
        at = {"least": int(np.argmin(self.sd_v)), "most": int(np.argmax(self.sd_v))}
        ends = {name: self.sd_v[i] * np.array([1.0, 1.0 - doubt[i], 1.0 + doubt[i]]) for name, i in at.items()}
        return {name: Interval(*map(float, three)) for name, three in ends.items()}

    def at(self, seen: _Scatter) -> Array:
        """Return the sd of values where they were read, V."""
        return np.asarray(np.interp(seen.at[self.kind], self.knots, self.sd_v))


def uneven_noise(training: Sequence[Left], proof: Sequence[Left]) -> Uneven | None:
    """Return the noise where it is uneven beyond doubt, and that holds on readings kept back; None where it is not.

    Of the clock every stretch is its own, in recordings kept back, too: half of the readings tell, the others confirm.
    """
    step_v = grid_step_v([trace for trace, _ in (*training, *proof)])
    seen, kept = _scatter(training), _scatter(proof)
    if seen.values.size < FEW * LEAST or step_v > COARSE * _sd(seen.values):
        return None
    every = seen.beside(kept)
    asked = ((OverLevel, seen, kept), (OverRate, seen, kept), (OverClock, every.part(0), every.part(1)))
    told, seen, kept = max(((_told(a, kind), a, b) for kind, a, b in asked), key=lambda each: each[0].gain)
    here = told.at(seen)
    p_value = min(len(KINDS) * float(chi2.sf(told.gain, max(told.sd_v.size - 1, 1))), 1.0)
    enough = p_value < CONVINCING and told.gain > MATERIAL * SHARE * here.size
    if not enough or not _is_new(seen, here):
        return None
    if kept.values.size >= LEAST and _gain(kept, told.at(kept)) < CONFIRMING:
        return None
    blemish = told.kind(told.ends, p_value, span=_span(seen.at[told.kind], told))
    return Uneven(blemish, told.knots, told.sd_v)


def _span(where: Array, told: _Told) -> tuple[float, float, float]:
    """Return the ends of where readings scatter more than their middle, and which share of all scatter is there."""
    knots, sd_v = told.knots, told.sd_v
    more, power = knots[sd_v > np.sqrt(np.min(sd_v) * np.max(sd_v))], np.square(np.interp(where, knots, sd_v))
    low, high = (float(end) for end in (np.min(more), np.max(more)))
    low, high = float(np.min(where)) if low == knots[0] else low, float(np.max(where)) if high == knots[-1] else high
    return low, high, float(np.sum(power, where=(where >= low) & (where <= high)) / np.sum(power))


def _scatter(runs: Sequence[Left]) -> _Scatter:
    """Return what neighbouring readings of all recordings scatter by."""
    found = [_differences(*run) for run in runs if run[0].size > 3]
    parts = [np.concatenate(each) for each in zip(*found, strict=True)] or [np.zeros(0)] * (2 + len(KINDS))
    values, before, *at = parts
    return _Scatter(values, before, dict(zip(KINDS, at, strict=True)))


def _differences(trace: Trace, left: Array) -> list[Array]:
    """Return second differences as a reading's noise, V, those before them, and what of every kind it may go with."""
    ok, second = good(trace), np.diff(left, 2) / np.sqrt(6.0)
    use = ok[3:] & ok[2:-1] & ok[1:-2] & ok[:-3]
    return [second[1:][use], second[:-1][use], *(kind.coordinate(trace)[2:-1][use] for kind in KINDS)]


def _sd(values: Array) -> float:
    """Return the standard deviation of Gaussian values, however far a few of them lie out; 0 of none."""
    return TO_SD * float(np.median(np.abs(values))) if values.size else 0.0


def _told(seen: _Scatter, kind: type[UnevenNoise]) -> _Told:
    """Return what speaks for noise that goes with one thing; nothing where it cannot be told so."""
    where = seen.at[kind]
    order = np.argsort(where, kind="stable")
    bins = _joined(np.split(order, np.searchsorted(where[order], kind.edges(where)[1:-1], side="right")))
    knots = np.array([float(np.median(where[each])) for each in bins])
    sd_v = np.array([_rms(seen.values[each]) for each in bins])
    rises = bool(np.all(sd_v > 0.0) and np.all(np.diff(knots) > 0.0))
    gain = _gain(seen, np.interp(where, knots, sd_v)) if rises else 0.0
    return _Told(gain, kind, knots, sd_v, np.array([each.size for each in bins]))


def _joined(parts: Sequence[Samples]) -> list[Samples]:
    """Return parts in a row of which each that is too small to tell an sd is joined to the next, or else the last."""
    found: list[Samples] = []
    for part in parts:
        found = [*found[:-1], np.concatenate((found[-1], part))] if found and found[-1].size < LEAST else [*found, part]
    if len(found) > 1 and found[-1].size < LEAST:
        found[-2:] = [np.concatenate(found[-2:])]
    return found


def _rms(values: Array) -> float:
    """Return the rms of values of which those far out count as ``FAR_OUT`` sd away."""
    far_v = FAR_OUT * _sd(values)
    return float(np.sqrt(np.mean(np.square(np.clip(values, -far_v, far_v)))))


def _gain(seen: _Scatter, sd_v: Array) -> float:
    """Return twice the gain in log-likelihood of every value's own sd, of the course ``sd_v``, over one for all.

    Either is as large as it is in these readings; what lies far out counts as ``FAR_OUT`` away.
    """
    own, one = _sd(seen.values / sd_v) * sd_v, np.full(sd_v.size, _sd(seen.values))
    if not own.all() or not one.all():  # most of them are the same
        return 0.0
    costs = [2.0 * np.log(sd) + np.square(np.minimum(np.abs(seen.values / sd), FAR_OUT)) for sd in (one, own)]
    return SHARE * float(np.sum(costs[0] - costs[1]))


def _is_new(seen: _Scatter, sd_v: Array) -> bool:
    """Return whether what makes noise, of ``sd_v`` in every value, larger is new in every reading, or nearly so.

    What has come through G2 hangs together; readings that are an earlier one once more do a little, too.
    """
    square, product, larger = np.square(seen.values), seen.values * seen.before, sd_v > np.mean(sd_v)
    beyond, common = (float(np.mean(each[larger]) - np.mean(each[~larger])) for each in (square, product))
    if beyond <= 0.0 or common / beyond < WHITE - ABOUT:
        return False
    apart = product - THROUGH * square  # on average as where noise is least, where the rest has come through a lag
    more = (apart[larger] - np.mean(apart[~larger])) / np.square(sd_v[larger])
    excluded = float(np.mean(more)) < -DOUBT * float(np.std(more)) / np.sqrt(SHARE * more.size)
    return bool(excluded) or common / beyond < WHITE + ABOUT
