"""How does the play answer a periodic v of any shape, once settled, and how does its answer move with v?

What is held between samples is no pure sine: its images, above the sample rate, reach F as far as G1 lets them through.
Seldom much, but a turning point shifts with them, and harmonics are measured to a few parts in ten thousand.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identify import kernels
from identify.harmonic.periods import Complex, Period
from identify.model import Backlash, Model, Rational
from identify.trace import Array

FINE = 512  # instants to a period of the highest line: a turning point is met to 2e-5 of its amplitude
FINEST = 1 << 20  # instants of a period, at most: bounds memory


@dataclass(frozen=True, eq=False)
class Settled:
    """One settled period: w (N,), and for every instant where w last lay on a border, with the slope of that border.

    w is held from there on, so that it moves by ``slope`` times as much as v moves at ``contact``.
    """

    w: Array
    contact: NDArray[np.int64]
    slope: Array

    @property
    def moves(self) -> bool:
        """Return whether v crosses the gap."""
        return bool(np.ptp(self.w) > 0.0)

    def moved(self, v_moved: Array) -> Array:
        """Return how w moves when v moves by ``v_moved`` (..., N); nothing moves within the gap."""
        return np.asarray(v_moved[..., self.contact] * self.slope)


def settled(v: Array, borders: Backlash, rest_w: float = 0.0) -> Settled:
    """Return the second of two periods from the level ``rest_w``: by then w is on its cycle."""
    twice = np.concatenate((v, v))
    w = np.empty_like(twice)
    kernels.play(borders.s_l, borders.d_l_v, borders.s_u, borders.d_u_v, rest_w, twice, w)
    near = 1e-9 * (1.0 + float(np.max(np.abs(w))))
    upper = np.abs(w - borders.s_u * (twice - borders.d_u_v)) <= near
    lower = np.abs(w - borders.s_l * (twice - borders.d_l_v)) <= near
    last = np.maximum.accumulate(np.where(upper | lower, np.arange(twice.size), -1))[v.size :]
    slope = np.where(upper[last], borders.s_u, borders.s_l) if np.ptp(w[v.size :]) > 0.0 else np.zeros(v.size)
    return Settled(w[v.size :], np.maximum(last, 0) % v.size, slope)


def signal_of(lines: Complex, size: int) -> Array:
    """Return the signal over one period at ``size`` instants, from its complex amplitudes (..., less than size / 2)."""
    halved = 0.5 * lines
    halved[..., 0] = lines[..., 0]
    return np.asarray(np.fft.irfft(halved, size) * size)


def lines_of(signal: Array, count: int) -> Complex:
    """Return the first ``count`` complex amplitudes of a signal given over one period (..., N)."""
    lines = np.fft.rfft(signal)[..., :count] * (2.0 / signal.shape[-1])
    lines[..., 0] *= 0.5
    return np.asarray(lines)


def frequency_response(block: Rational, frequencies_hz: ArrayLike) -> Complex:
    """Return num(jw) / den(jw) exp(-jw dead_time_s)."""
    s = 2j * np.pi * np.asarray(frequencies_hz, dtype=np.float64)
    return np.asarray(np.polyval(block.num, s) / np.polyval(block.den, s) * np.exp(-s * block.dead_time_s))


def instants(period: Period) -> int:
    """Return on how many instants to draw one period."""
    return min(1 << int(np.ceil(np.log2(max(FINE * max(period.played), 2 * period.u.size)))), FINEST)


def beside_v(period: Period, model: Model) -> Array:
    """Return what of v does not come from the played lines: its level, and the images of what is held."""
    lines = np.arange(instants(period) // 2)
    spectrum = period.drive(lines) * frequency_response(model.g1, lines * period.base_hz)
    spectrum[list(period.played)] = 0.0
    spectrum[0] = model.g1.dc_gain * period.mean_u_v
    return signal_of(spectrum, instants(period))


def beside_w(period: Period, model: Model, lines: NDArray[np.int64]) -> Complex:
    """Return by how much the images change the lines of w, as ``model`` has it."""
    assert isinstance(model.f, Backlash)
    beside, played = beside_v(period, model), np.array(period.played)
    spectrum = np.zeros(int(played[-1]) + 1, dtype=np.complex128)
    spectrum[played] = period.drive(played) * frequency_response(model.g1, played * period.base_hz)
    pure = signal_of(spectrum, beside.size)
    with_images, without = (settled(pure + v, model.f).w for v in (beside, np.full(beside.size, np.mean(beside))))
    return np.asarray(lines_of(with_images - without, int(lines[-1]) + 1)[lines])
