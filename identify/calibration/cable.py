"""What do runs over a cable tell of the device: delay, skew, gain, offset, noise, steps, each with its doubt?

Several runs with different random levels are looked at one by one: gain, offset and noise are as sure as the runs
agree, whatever the colour of the noise. Where noise does not blur the steps of the ADC, their rounding can be the same
in all runs; what it can add is added to the intervals.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as t_distribution

from identify.calibration.lateness import Lateness, lateness
from identify.calibration.taps import Pass, Taps, pooled, taps_of, window
from identify.interval import Interval
from identify.noise import OFF_GRID, grid_step_v
from identify.trace import Trace

SURE = 0.95
SHARP = 0.2  # noise over step below which rounding may be off by half a step all over
CROOKED = 3.0  # chi-squared over its freedom from which the answer is no dead time with one time constant
__all__ = ["Cable", "Pass", "at_once", "measured"]


@dataclass(frozen=True)
class Cable:
    """What a cable told at one rate; times in s, gain in V/V, the rest in V, the skew in ppm.

    ``delay`` is from the instant at which a sample is put out, by the convention that y[k] is read just before u[k]
    acts. ``skew_ppm`` is by how much it grows in a second, us. ``step`` is that of the ADC, None where no grid shows.
    ``gain`` and ``offset`` are those of output and input together.
    """

    rate_hz: float
    delay: Interval
    time_constant: Interval
    skew_ppm: Interval
    gain: Interval
    offset: Interval
    noise: Interval
    step: Interval | None
    warnings: tuple[str, ...] = ()


def measured(passes: Sequence[Pass]) -> Cable:
    """Return what runs over a cable tell; ValueError with one sentence when they tell nothing.

    The runs are at one rate, at least three, each with other random levels.
    """
    first, count = window(passes)
    runs = [taps_of(one, first, count) for one in passes]
    together = pooled(runs)
    _refuse_silence(together)
    late, step = lateness([together]), _step(passes)
    noise = _agreed([run.noise_v for run in runs], logarithmic=True)
    doubt_v = 0.0 if step is None else _rounding_v(noise.value, step.value)
    return Cable(
        rate_hz=together.rate_hz, delay=late.delay, time_constant=late.time_constant,
        skew_ppm=_skew(passes, first, count), gain=_agreed([run.gain for run in runs], doubt_v / _size_v(passes)),
        offset=_agreed([run.offset_v for run in runs], doubt_v), noise=noise, step=step,
        warnings=_warnings(together, late),
    )  # fmt: skip


def at_once(one: Pass) -> tuple[float, float]:
    """Return the gain that one run shows, and the share of the reading's variation that follows what was put out."""
    taps = taps_of(one, *window([one]))
    varies = float(np.var(one.y))
    return taps.gain, max(0.0, 1.0 - taps.noise_v**2 / varies) if varies > 0.0 else 0.0


def _refuse_silence(taps: Taps) -> None:
    """Raise ValueError when what is read has nothing to do with what is put out."""
    if abs(taps.gain) < 10.0 * float(np.sqrt(np.sum(taps.sd**2) * taps.scatter)):
        raise ValueError("the input does not follow the output: is the cable in place?")


def _agreed(values: Sequence[float], doubt: float = 0.0, logarithmic: bool = False) -> Interval:
    """Return the mean of what the runs tell and its interval from their scatter, ``doubt`` more on both sides."""
    told = np.log(values) if logarithmic else np.asarray(values)
    mean = float(told.mean())
    half = float(t_distribution.ppf(0.5 + 0.5 * SURE, told.size - 1) * told.std(ddof=1) / np.sqrt(told.size))
    ends = (mean, mean - half, mean + half)
    value, low, high = np.exp(ends) if logarithmic else ends
    return Interval(float(value), float(low) - doubt, float(high) + doubt)


def _size_v(passes: Sequence[Pass]) -> float:
    """Return the level at which an error of the reading is an error of the gain: the mean square over the mean."""
    return float(np.mean([np.mean(one.u**2) / max(float(np.mean(np.abs(one.u))), 1e-300) for one in passes]))


def _rounding_v(noise_v: float, step_v: float) -> float:
    """Return by how much rounding to steps can shift a mean, V: noise ahead of the ADC blurs it (Widrow 1961).

    With Gaussian noise the first harmonic of the sawtooth is left, step / pi exp(-2 pi^2 (noise / step)^2).
    """
    ahead_v = float(np.sqrt(max(noise_v**2 - step_v**2 / 12.0, 0.0)))
    if ahead_v < SHARP * step_v:
        return 0.5 * step_v
    return step_v / np.pi * float(np.exp(-2.0 * (np.pi * ahead_v / step_v) ** 2))


def _step(passes: Sequence[Pass]) -> Interval | None:
    """Return the step of the grid on which all readings lie, as sure as the span of the readings makes it."""
    y = np.concatenate([one.y for one in passes])
    step = grid_step_v([Trace("cable", passes[0].rate_hz, y, y)])
    if step == 0.0:
        return None
    half = OFF_GRID * step / max(round(float(np.ptp(y)) / step), 1)
    return Interval(step, step - half, step + half)


def _skew(passes: Sequence[Pass], first: int, count: int) -> Interval:
    """Return how much the delay grows in a run, ppm: the second half against the first, at the worst of both."""
    size = min(one.u.size for one in passes)
    halves = slice(0, size // 2), slice(size // 2, size)
    early, late = (lateness([pooled([taps_of(one, first, count, part) for one in passes])]).delay for part in halves)
    apart_s = 0.5 * size / passes[0].rate_hz
    ends = (late.low - early.high) / apart_s * 1e6, (late.high - early.low) / apart_s * 1e6
    return Interval(0.5 * (ends[0] + ends[1]), *ends)


def _warnings(taps: Taps, late: Lateness) -> tuple[str, ...]:
    """Return what is not as a cable should be."""
    found = []
    if late.misfit > CROOKED * taps.scatter:
        found.append("the answer is no dead time with one time constant: is there more than a cable, or a hum on it?")
    if taps.scatter > CROOKED:
        found.append("the runs differ by more than noise: the start is not the same each time, or a contact is loose")
    return tuple(found)
