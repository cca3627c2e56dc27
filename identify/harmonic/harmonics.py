"""Which harmonics does the backlash make of a sine (paper eqs. 23-25)?

v = V cos(psi), psi = w t + phi, V > 0. Once settled, w runs through four pieces of every period: it is held at its
top while v falls through the gap, follows the unloading border down to v = -V, is held at its bottom, and follows the
loading border up to v = V. On each piece w = level + swing cos(psi), so every Fourier integral has a closed form, and
so has its derivative in V and in the four borders: at the turning points w is continuous, so that their motion adds
nothing to first order.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.model import Backlash
from identify.trace import Array

Complex = NDArray[np.complex128]
PARAMETERS = ("V", "S_L", "D_L", "S_U", "D_U")  # the rows of ``slopes``


@dataclass(frozen=True)
class Cycle:
    """One settled cycle: where in psi, rad, its four pieces begin and end, and w = levels + swings cos(psi) on each."""

    begin: Array
    end: Array
    levels: Array
    swings: Array

    def integrals(self, orders: NDArray[np.int64], levels: Array, swings: Array) -> Complex:
        """Return (1 / pi) times the integral of (levels + swings cos psi) exp(-j n psi) over one period."""
        flat, below, above = (_turned(self.begin, self.end, orders + shift) for shift in (0, -1, 1))
        return np.asarray((levels @ flat + 0.5 * swings @ (below + above)) / np.pi)


def threshold_v(borders: Backlash) -> float:
    """Return the amplitude of v up to which w rests: (D_L - D_U) / 2 for equal slopes (physics.md 1.3)."""
    return (borders.s_l * borders.d_l_v - borders.s_u * borders.d_u_v) / (borders.s_l + borders.s_u)


def coefficients(
    amplitude_v: float, phase_rad: float, borders: Backlash, orders: NDArray[np.int64], rest_w: float = 0.0
) -> Complex:
    """Return c_n = s_n exp(j psi_n) of eq. (25) for every n >= 0 in ``orders``: w(t) = Re sum of c_n exp(j n w t).

    v(t) = ``amplitude_v`` cos(w t + ``phase_rad``). c_0 is the mean of w. Within the gap w rests where its level
    ``rest_w`` before the sine was pushed to. Raises ValueError where the borders cross within the reach of v.
    """
    cycle = _cycle(amplitude_v, borders)
    if cycle is None:
        return np.where(orders == 0, _resting(amplitude_v, borders, rest_w), 0.0).astype(np.complex128)
    whole = cycle.integrals(orders, cycle.levels, cycle.swings)
    return _placed(whole, orders, phase_rad)


def slopes(amplitude_v: float, phase_rad: float, borders: Backlash, orders: NDArray[np.int64]) -> Complex:
    """Return the derivatives of ``coefficients`` in V, S_L, D_L, S_U, D_U (``PARAMETERS``), shape (5, len(orders)).

    Zero within the gap. The derivative in the phase is j n c_n.
    """
    cycle = _cycle(amplitude_v, borders)
    if cycle is None:
        return np.zeros((len(PARAMETERS), orders.size), dtype=np.complex128)
    v, s_l, d_l, s_u, d_u = amplitude_v, borders.s_l, borders.d_l_v, borders.s_u, borders.d_u_v
    tables = (
        ((s_l, 0.0, -s_u, 0.0), (0.0, s_u, 0.0, s_l)),
        ((v - d_l, 0.0, 0.0, -d_l), (0.0, 0.0, 0.0, v)),
        ((-s_l, 0.0, 0.0, -s_l), (0.0, 0.0, 0.0, 0.0)),
        ((0.0, -d_u, -v - d_u, 0.0), (0.0, v, 0.0, 0.0)),
        ((0.0, -s_u, -s_u, 0.0), (0.0, 0.0, 0.0, 0.0)),
    )
    rows = [cycle.integrals(orders, np.array(levels), np.array(swings)) for levels, swings in tables]
    return np.array([_placed(row, orders, phase_rad) for row in rows])


def _cycle(v: float, borders: Backlash) -> Cycle | None:
    """Return the cycle of a sine of amplitude ``v``; None when it stays within the gap."""
    s_l, d_l, s_u, d_u = borders.s_l, borders.d_l_v, borders.s_u, borders.d_u_v
    top, bottom = s_l * (v - d_l), s_u * (-v - d_u)
    if top <= bottom:
        return None
    leaves_top, leaves_bottom = (top / s_u + d_u) / v, (bottom / s_l + d_l) / v
    if leaves_top > 1.0 + 1e-12 or leaves_bottom < -1.0 - 1e-12:
        raise ValueError(f"the borders of F cross within the reach of v, {v:.6g} V")
    fall, rise = np.arccos(min(leaves_top, 1.0)), 2.0 * np.pi - np.arccos(max(leaves_bottom, -1.0))
    return Cycle(
        np.array([0.0, fall, np.pi, rise]), np.array([fall, np.pi, rise, 2.0 * np.pi]),
        np.array([top, -s_u * d_u, bottom, -s_l * d_l]), np.array([0.0, s_u * v, 0.0, s_l * v]),
    )  # fmt: skip


def _resting(v: float, borders: Backlash, rest_w: float) -> float:
    """Return the level a sine within the gap leaves w at: pushed up from below, down from above, else untouched."""
    lowest, highest = borders.s_l * (v - borders.d_l_v), borders.s_u * (-v - borders.d_u_v)
    return float(np.clip(rest_w, lowest, highest))


def _placed(whole: Complex, orders: NDArray[np.int64], phase_rad: float) -> Complex:
    """Return the coefficients in t instead of psi; the mean carries half the weight of the others, and is real."""
    return np.where(orders == 0, 0.5 * whole.real, whole * np.exp(1j * orders * phase_rad))


def _turned(begin: Array, end: Array, orders: NDArray[np.int64]) -> Complex:
    """Return the integral of exp(-j m psi) from ``begin`` to ``end``, shape (pieces, orders), any m with 0."""
    width, middle = (end - begin)[:, None], 0.5 * (begin + end)[:, None]
    return np.asarray(width * np.exp(-1j * orders * middle) * np.sinc(orders * width / (2.0 * np.pi)))
