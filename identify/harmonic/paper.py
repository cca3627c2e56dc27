"""What does the paper's own method find: Table 1 for the borders, Table 2 for G1 and G2, eq. (37) for their form?

It is kept as published, for comparison and for starting values, with two slips put right (physics.md 1.7): (29b) takes
the quadrant into account, and (29c) is halved for n = 0. No weights and no intervals: (36) is solved by plain least
squares from G1 = G2 = 1, and gives an answer even where it has many (one delay in all phases, physics.md 1.1; gains
that no two sines separate, 1.2). ``measured`` says which those are.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from identify.harmonic.equations import Equations, gathered, read_at
from identify.harmonic.periods import Complex, Period
from identify.harmonic.steady import frequency_response
from identify.model import Backlash, Rational
from identify.trace import Array

MOVED = 5.0  # standard errors by which a reading must change before the point counts as moved (Remark 6.1)
LEVY_ROUNDS = 8


@dataclass(frozen=True, eq=False)
class Points:
    """Step 4 of Table 1: the levels U_k, their estimates X_k of eq. (14), V, and which half of the walk each is in."""

    levels_v: Array
    means_v: Array
    errors_v: Array

    @property
    def loading(self) -> slice:
        """Return the first half, k = 1 ... N / 2, which Table 1 takes as the loading stage."""
        return slice(0, self.levels_v.size // 2)

    @property
    def unloading(self) -> slice:
        """Return the second half."""
        return slice(self.levels_v.size // 2, self.levels_v.size)


def table_1(levels_v: Array, readings_v: NDArray[np.float64]) -> Points:
    """Return the points of all levels: the mean of M settled readings each (eq. 14), shape (N, M)."""
    count = readings_v.shape[1]
    errors = np.sqrt(np.mean(np.var(readings_v, axis=1, ddof=1)) / count)
    return Points(levels_v, readings_v.mean(axis=1), np.full(levels_v.size, errors))


def borders(points: Points) -> Backlash:
    """Return the straight lines through either half, V_p = G2(0) = 1 (eqs. 8-13, 19).

    Each line begins with the first point that moved: "V_j is the first abscissa such that the working point reaches the
    increasing lateral border". Raises ValueError when a half has fewer than two.
    """
    s_l, d_l = _line(points, points.loading)
    s_u, d_u = _line(points, points.unloading)
    return Backlash(s_l, d_l, s_u, d_u)


def _line(points: Points, half: slice) -> tuple[float, float]:
    """Return slope and crossing of the line through the points of one half, from the first that moved on."""
    levels, means, errors = points.levels_v[half], points.means_v[half], points.errors_v[half]
    moved = np.flatnonzero(np.abs(np.diff(means)) > MOVED * np.sqrt(2.0) * errors[1:])
    if moved.size < 2:
        raise ValueError("fewer than two levels of one half move the output: no line can be drawn through them")
    first = int(moved[0]) + 1
    slope, offset = np.polyfit(levels[first:], means[first:], 1)
    return float(slope), float(-offset / slope)


def fourier(period_v: Array, orders: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return X_n in V and theta_n in rad of one averaged period (eqs. 28-30), shape of ``orders``."""
    turn = 2.0 * np.pi * np.outer(orders, np.arange(period_v.size)) / period_v.size
    a = 2.0 * np.mean(period_v * np.cos(turn), axis=1)
    b = 2.0 * np.mean(period_v * np.sin(turn), axis=1)
    a[orders == 0] *= 0.5
    return np.hypot(a, b), -np.arctan2(b, a)


@dataclass(frozen=True, eq=False)
class Gains:
    """The answer of Table 2: complex G1 at the frequencies played, G2 at their harmonics."""

    g1_hz: Array
    g1: Complex
    g2_hz: Array
    g2: Complex


def table_2(sines: Sequence[Period], f: Backlash, band_hz: float) -> Gains:
    """Return what solves eq. (36) for all harmonics up to ``band_hz``, the mean included.

    The search starts at G1 = G2 = 1, the values of properties P1 and P2.
    """
    chosen = []
    for period in sines:
        step = period.played[0]
        orders = np.arange(int(band_hz / (step * period.base_hz) * (1.0 + 1e-9)) + 1)
        x, theta = fourier(period.mean_y_v(), orders * step)
        plain = read_at(period, orders, 1.0)
        chosen.append(replace(plain, y=x * np.exp(1j * theta), sd_v=np.ones(orders.size)))
    return _solved(gathered(chosen, 1.0), f)


def _solved(system: Equations, f: Backlash) -> Gains:
    """Return the plain least-squares solution of eq. (36) with the borders as they are."""
    free = system.places[-1].start
    last = np.array([f.s_l, f.d_l_v, f.s_u, f.d_u_v])

    def missed(x: Array) -> Array:
        return system.residual(np.concatenate((x, last)))

    def rows(x: Array) -> NDArray[np.float64]:
        return system.jacobian(np.concatenate((x, last)))[:, :free]

    found = least_squares(missed, np.zeros(free), rows, max_nfev=500)
    gain1, phase1, gain2, phase2, _ = (found.x[place] for place in system.places)
    one, two = np.exp(gain1 + 1j * phase1), np.exp(gain2 + 1j * phase2)
    return Gains(system.g1_hz, np.asarray(one), system.g2_hz, np.asarray(two))


def rational(frequencies_hz: Array, gains: Complex, shape: Rational, weights: Array | None = None) -> Rational:
    """Return the rational function of the orders of ``shape`` nearest to measured gains (eq. 37); G(0) = 1.

    A dead time is searched where ``shape`` has one. The start is Levy's linear fit (IRE Trans. AC-4 (1959) 37), the
    search Levenberg-Marquardt.
    """
    delta = np.ones(frequencies_hz.size) if weights is None else weights
    degree, order, late = len(shape.num) - 1, len(shape.den) - 1, shape.dead_time_s > 0.0
    unit = 2.0 * np.pi * float(np.median(frequencies_hz))  # frequencies near one keep the powers of s alike
    scaled = frequencies_hz / unit

    def block(x: Array) -> Rational:
        delay = float(x[-1]) if late else 0.0
        return Rational((*x[:degree].tolist(), 1.0), (*x[degree : degree + order].tolist(), 1.0), delay)

    def missed(x: Array) -> Array:
        apart = (frequency_response(block(x), scaled) - gains) * np.sqrt(delta)
        return np.concatenate((apart.real, apart.imag))

    delay = shape.dead_time_s * unit
    start = _levy(scaled, gains * np.exp(2j * np.pi * scaled * delay), degree, order)
    found = least_squares(missed, np.concatenate((start, [delay] if late else [])), method="lm", xtol=1e-14, ftol=1e-14)
    return _in_seconds(block(found.x), unit)


def _levy(frequencies_hz: Array, gains: Complex, degree: int, order: int) -> Array:
    """Return coefficients of powers degree ... 1 and order ... 1 by a linear fit, reweighted by its own denominator."""
    s = 2j * np.pi * frequencies_hz
    weight = np.ones(s.size)
    x = np.zeros(degree + order)
    for _ in range(LEVY_ROUNDS):
        columns = [s**k for k in range(degree, 0, -1)] + [-gains * s**k for k in range(order, 0, -1)]
        rows, right = np.array(columns).T * weight[:, None], (gains - 1.0) * weight
        x = np.linalg.lstsq(np.concatenate((rows.real, rows.imag)), np.concatenate((right.real, right.imag)))[0]
        weight = 1.0 / np.abs(np.polyval([*x[degree:], 1.0], s))
    return np.asarray(x, dtype=np.float64)


def _in_seconds(block: Rational, unit: float) -> Rational:
    """Return a block fitted in units of 1 / ``unit`` s with coefficients in s."""

    def side(coefficients: tuple[float, ...]) -> tuple[float, ...]:
        order = len(coefficients) - 1
        return tuple(c / unit ** (order - k) for k, c in enumerate(coefficients))

    return Rational(side(block.num), side(block.den), block.dead_time_s / unit)
