"""Which equations do the harmonics of all sines make together (paper eq. 36), and how do they move with the unknowns?

Harmonic n of the sine at w reads G2(jnw) c_n, with c_n of w from |G1(jw)| and its phase (``harmonics``). Unknown are
gain and phase of G1 at every w, those of G2 at every nw that stands above the noise, and, within what is known of them,
the borders. Sines at one frequency share G1, harmonics at one frequency share G2: that is all that ties them together.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.harmonic.harmonics import coefficients, slopes, threshold_v
from identify.harmonic.periods import Complex, Period
from identify.harmonic.steady import beside_w, frequency_response
from identify.model import Backlash, Model
from identify.trace import Array

Matrix = NDArray[np.float64]
SEEN = 5.0  # standard deviations a harmonic is expected to stand above the noise before it is used
HIGHEST = 0.4  # of the sample rate: above it lines of y fold back
MOST = 40  # harmonics of one sine
SAME = 1e-6  # relative difference of frequencies that are one
BORDERS = 4


@dataclass(frozen=True, eq=False)
class Sine:
    """One sine as F feels it: amplitude and phase of u, the level v swings about, and the harmonics of y used.

    ``g1`` is the index of its frequency among those of G1, ``g2`` the indices of ``orders`` among those of G2 (-1: the
    mean, for which G2(0) is known). ``y`` are the lines of y at ``orders``, ``sd_v`` their noise.
    """

    name: str
    frequency_hz: float
    drive: complex
    level_v: float
    g1: int
    orders: NDArray[np.int64]
    g2: NDArray[np.int64]
    y: Complex
    sd_v: Array


@dataclass(frozen=True, eq=False)
class Equations:
    """All sines that move F, the frequencies they have in common, and the gain of G2 for the mean.

    The unknowns are laid out as log|G1|, arg G1, log|G2|, arg G2, then S_L, D_L, S_U, D_U.
    """

    sines: tuple[Sine, ...]
    g1_hz: Array
    g2_hz: Array
    dc_gain: float

    @property
    def places(self) -> tuple[slice, slice, slice, slice, slice]:
        """Return where each group of unknowns lies."""
        edges = np.cumsum([0, self.g1_hz.size, self.g1_hz.size, self.g2_hz.size, self.g2_hz.size, BORDERS])
        a, b, c, d, e, f = (int(edge) for edge in edges)
        return slice(a, b), slice(b, c), slice(c, d), slice(d, e), slice(e, f)

    def start(self, model: Model) -> Array:
        """Return the unknowns as ``model`` has them."""
        one, two = frequency_response(model.g1, self.g1_hz), frequency_response(model.g2, self.g2_hz)
        assert isinstance(model.f, Backlash)
        f = (model.f.s_l, model.f.d_l_v, model.f.s_u, model.f.d_u_v)
        return np.concatenate((np.log(np.abs(one)), np.angle(one), np.log(np.abs(two)), np.angle(two), f))

    def residual(self, x: Array) -> Array:
        """Return measured minus expected harmonics in units of their noise, real and imaginary parts."""
        return np.concatenate([_parts((s.y - self._expected(s, x)[0]) / s.sd_v, s.orders) for s in self.sines])

    def jacobian(self, x: Array) -> Matrix:
        """Return d residual / d unknowns."""
        return np.concatenate([self._rows(sine, x) for sine in self.sines])

    def _expected(self, sine: Sine, x: Array) -> tuple[Complex, Complex, Complex, float, Backlash]:
        """Return the harmonics of y, those of w, G2 at them, the amplitude of v and the borders about its level."""
        gain1, phase1, gain2, phase2, f = (x[place] for place in self.places)
        s_l, d_l, s_u, d_u = f.tolist()
        borders = Backlash(s_l, d_l - sine.level_v, s_u, d_u - sine.level_v)
        amplitude = abs(sine.drive) * float(np.exp(gain1[sine.g1]))
        w = coefficients(amplitude, float(phase1[sine.g1]) + float(np.angle(sine.drive)), borders, sine.orders)
        two = np.where(sine.g2 < 0, self.dc_gain, np.exp(gain2[sine.g2] + 1j * phase2[sine.g2]))
        return two * w, w, two, amplitude, borders

    def _rows(self, sine: Sine, x: Array) -> Matrix:
        y, w, two, amplitude, borders = self._expected(sine, x)
        gain1, phase1, gain2, phase2, f = self.places
        phase = float(x[phase1][sine.g1]) + float(np.angle(sine.drive))
        moved = two * slopes(amplitude, phase, borders, sine.orders)
        table = np.zeros((sine.orders.size, x.size), dtype=np.complex128)
        table[:, gain1.start + sine.g1] = moved[0] * amplitude
        table[:, phase1.start + sine.g1] = 1j * sine.orders * two * w
        own = np.flatnonzero(sine.g2 >= 0)
        table[own, gain2.start + sine.g2[own]] = y[own]
        table[own, phase2.start + sine.g2[own]] = 1j * y[own]
        table[:, f] = moved[1:].T
        return -_parts(table / sine.sd_v[:, None], sine.orders)


def _parts(lines: NDArray[np.complex128], orders: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return real parts, then the imaginary parts of all but the mean, along the first axis."""
    return np.concatenate((lines.real, lines.imag[orders > 0]))


def equations(sines: Sequence[Period], model: Model) -> tuple[Equations, tuple[Period, ...]]:
    """Return the equations of every sine that moves F as ``model`` has it, and the sines that leave it stuck.

    A harmonic is used when ``model`` expects it to stand out of the noise; what was measured has no say, so that no
    chance excess is chosen.
    """
    moving = tuple(p for p in sines if amplitude_v(p, model) > threshold_v(_about(p, model)))
    chosen = [_read(period, model) for period in moving]
    return gathered(chosen, model.g2.dc_gain), tuple(p for p in sines if p not in moving)


def gathered(sines: Sequence[Sine], dc_gain: float) -> Equations:
    """Return the equations of sines that know their harmonics but not yet what they share."""
    g1_hz = _distinct([sine.frequency_hz for sine in sines])
    g2_hz = _distinct([n * sine.frequency_hz for sine in sines for n in sine.orders.tolist() if n])
    placed = tuple(
        replace(sine, g1=_index(g1_hz, sine.frequency_hz),
                g2=np.array([_index(g2_hz, n * sine.frequency_hz) if n else -1 for n in sine.orders.tolist()]))
        for sine in sines
    )  # fmt: skip
    return Equations(placed, g1_hz, g2_hz, dc_gain)


def frequency_of(period: Period) -> float:
    """Return the frequency of a sine, Hz."""
    return period.played[0] * period.base_hz


def amplitude_v(period: Period, model: Model) -> float:
    """Return the amplitude of v that ``model`` expects."""
    one = frequency_response(model.g1, [frequency_of(period)])
    return float(abs(one[0] * period.drive(period.played)[0]))


def _about(period: Period, model: Model) -> Backlash:
    """Return the borders as a sine about the level of v sees them."""
    assert isinstance(model.f, Backlash)
    level = model.g1.dc_gain * period.mean_u_v
    return Backlash(model.f.s_l, model.f.d_l_v - level, model.f.s_u, model.f.d_u_v - level)


def _read(period: Period, model: Model) -> Sine:
    """Return the mean and the harmonics of a sine that ``model`` expects above the noise, less the work of images."""
    step = period.played[0]
    orders = np.arange(min(int(HIGHEST * period.u.size / step), MOST) + 1)
    expected = coefficients(amplitude_v(period, model), 0.0, _about(period, model), orders)
    expected *= np.abs(frequency_response(model.g2, orders * frequency_of(period)))
    sd = period.sd_v[orders * step]
    used = orders[(np.abs(expected) > SEEN * sd) | (orders == 0)]
    sine = read_at(period, used, model.g1.dc_gain)
    images = frequency_response(model.g2, used * sine.frequency_hz) * beside_w(period, model, used * step)
    return replace(sine, y=sine.y - images)


def read_at(period: Period, orders: NDArray[np.int64], g1_dc_gain: float) -> Sine:
    """Return a sine with the harmonics ``orders``, not yet placed among those of the others."""
    at = orders * period.played[0]
    return Sine(
        period.name, frequency_of(period), complex(period.drive(period.played)[0]), g1_dc_gain * period.mean_u_v, -1,
        orders, np.full(orders.size, -1), period.lines[at], period.sd_v[at],
    )  # fmt: skip


def _distinct(frequencies_hz: Sequence[float]) -> Array:
    """Return the frequencies in ascending order, those that are one only once."""
    ordered = np.sort(np.asarray(frequencies_hz, dtype=np.float64))
    return ordered[np.diff(ordered, prepend=-np.inf) > SAME * ordered]


def _index(among_hz: Array, frequency_hz: float) -> int:
    return int(np.argmin(np.abs(among_hz - frequency_hz)))
