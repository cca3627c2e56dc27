"""What are borders and blocks in the paper's scale, V_p = 1 and G2(0) = 1 (eqs. 5a-5d), and how sure are they there?

V_p is the peak of G1's answer to a unit step; it is G1(0) unless G1 overshoots by more than its doubt: noise makes a
block that hardly overshoots seem to, never the other way, and every border would move with it. A negative V_p turns the
direction of v around, so that loading and unloading change places.
"""

from dataclasses import dataclass

import numpy as np

from identify.bent.bend import straight_lines, straight_values
from identify.bent.curved import CurvedPlay
from identify.blocks import LinearBlock, Play
from identify.chain import Chain
from identify.fit import Fit
from identify.interval import Interval
from identify.model import Rational
from identify.trace import Array
from identify.uncertainty.overshoot import peak, peak_s
from identify.uncertainty.propagation import propagated

BORDERS = ("S_L", "D_L", "S_U", "D_U")


@dataclass(frozen=True)
class Scale:
    """How the fitted blocks are brought to the paper's scale: when G1's step response peaks, and G2(0).

    ``peak_s`` is infinite where the peak is the settled level.
    """

    peak_s: float
    g2_gain: float

    def v_p(self, chain: Chain) -> float:
        """Return V_p of a chain near the fit, V/V."""
        return peak(rational_of(chain, "G1"), self.peak_s)


def scale_of(fit: Fit, wider: float = 1.0) -> Scale:
    """Return the paper's scale of a fitted chain; an overshoot within the doubt of its peak counts as none."""
    g1, g2_gain = rational_of(fit.chain, "G1"), rational_of(fit.chain, "G2").dc_gain
    scale = Scale(peak_s(g1), g2_gain)
    v_p = peak_interval(fit, scale, wider)
    return Scale(np.inf, g2_gain) if v_p.low <= g1.dc_gain <= v_p.high else scale


def rational_of(chain: Chain, name: str) -> Rational:
    """Return a fitted linear block by name."""
    block = next(s for s in chain.stages if isinstance(s, LinearBlock) and s.name == name)
    return block.fitted(chain.values)


def peak_interval(fit: Fit, scale: Scale, wider: float) -> Interval:
    """Return V_p, V/V."""
    return propagated(fit, lambda chain: np.array([scale.v_p(chain)])).intervals(wider)[0]


def scaled_borders(fit: Fit, scale: Scale, wider: float) -> tuple[dict[str, Interval], dict[str, Interval]]:
    """Return the borders in the rig file's scale, and in the paper's; empty for a rig without backlash.

    Of bent borders the nearest straight ones are told.
    """
    own = _own(fit, wider)
    if not own:
        return {}, {}
    found = propagated(fit, lambda chain: _borders(chain, scale)).intervals(wider)
    return own, dict(zip(BORDERS, found, strict=True))


def _own(fit: Fit, wider: float) -> dict[str, Interval]:
    """Return the borders in the rig file's scale; empty where there are none."""
    if fit.chain.stage_of(CurvedPlay) is not None:
        return dict(zip(BORDERS, propagated(fit, straight_lines).intervals(wider), strict=True))
    if fit.chain.stage_of(Play) is None:
        return {}
    return {name: Interval(fit.chain.values[f"F.{name}"], *fit.ci95(f"F.{name}", wider)) for name in BORDERS}


def _borders(chain: Chain, scale: Scale) -> Array:
    """Return S_L, D_L, S_U, D_U with V_p = 1 and G2(0) = 1 (eq. 5a with k_1 = V_p, k_2 = G2(0))."""
    values = straight_values(chain)
    s_l, d_l, s_u, d_u = (values[f"F.{name}"] for name in BORDERS)
    if (v_p := scale.v_p(chain)) < 0.0:
        s_l, d_l, s_u, d_u = s_u, d_u, s_l, d_l
    gain = v_p * scale.g2_gain
    return np.array([s_l * gain, d_l / v_p, s_u * gain, d_u / v_p])
