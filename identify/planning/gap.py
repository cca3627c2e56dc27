"""Which input moves the play operator, and how far does w then go?

With the borders of eqs. (6)-(7), v = c + a(t) leaves w where it is as long as S_L (max v - D_L) <= S_U (min v - D_U):
then one level of w lies between the borders all the time. For equal slopes that is 2 V <= D_L - D_U (physics.md 1.3).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from identify import kernels
from identify.model import Rational
from identify.planning.excitation import Wave, response
from identify.trace import Array

NAMES = ("F.S_L", "F.D_L", "F.S_U", "F.D_U")


@dataclass(frozen=True)
class Gap:
    """The borders of F in their own scale, V/V and V."""

    s_l: float
    d_l: float
    s_u: float
    d_u: float

    def excess(self, centre_v: float, high_v: float, low_v: float) -> float:
        """Return the size of a(t), high_v above and low_v below the centre, over the size at which F begins to move."""
        moves_at = self.s_l * (self.d_l - centre_v) - self.s_u * (self.d_u - centre_v)
        swing = self.s_l * high_v - self.s_u * low_v
        return swing / moves_at if moves_at > 0.0 else float("inf")

    def passed(self, v: Array) -> Array:
        """Return w when v is passed through from w = 0, V, shape (N,)."""
        w = np.empty_like(v)
        kernels.play(self.s_l, self.d_l, self.s_u, self.d_u, 0.0, v, w)
        return w

    def settled(self, v: Array) -> Array:
        """Return w over a period v that is repeated for ever, V, shape (N,)."""
        return self.passed(np.tile(v, 2))[v.size :]

    def reach(self, low_w: float, high_w: float) -> tuple[float, float]:
        """Return the levels of v, lowest and highest, that keep w within two levels."""
        return low_w / self.s_u + self.d_u, high_w / self.s_l + self.d_l


def gap_in(values: Mapping[str, float]) -> Gap | None:
    """Return the borders among the values of a chain; None where F has none of this kind."""
    return Gap(*(values[name] for name in NAMES)) if all(name in values for name in NAMES) else None


def excess(gap: Gap, wave: Wave, g1: Rational) -> float:
    """Return the amplitude of a wave over the amplitude at which it begins to move F behind ``g1``."""
    return gap.excess(wave.offset_v * g1.dc_gain, *wave.swing_behind(g1))


def fastest_hz(gap: Gap, g1: Rational, amplitude_v: float, below_hz: float) -> float | None:
    """Return the highest frequency below another at which a sine about 0 V moves F; None when there is none."""
    tried = np.geomspace(1e-4 * below_hz, below_hz, 400)

    def over(frequency_hz: float) -> float:
        size = amplitude_v * float(np.abs(response(g1, np.array([frequency_hz])))[0])
        return gap.excess(0.0, size, -size) - 1.0

    moving = [k for k, f in enumerate(tried) if over(float(f)) > 0.0]
    if not moving or moving[-1] == tried.size - 1:
        return float(tried[-1]) if moving else None
    return float(brentq(over, tried[moving[-1]], tried[moving[-1] + 1], rtol=1e-9))
