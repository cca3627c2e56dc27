"""How high does the answer of a linear block to a step of 1 V rise, and when (V_p, paper remark 1)?"""

import numpy as np
from scipy.linalg import expm
from scipy.optimize import minimize_scalar

from identify.discretise import Matrix, companion
from identify.model import Rational
from identify.trace import Array

BY_POLE = 80  # instants looked at within the decay of one pole
LONGEST = 10.0  # decays of a pole looked at
PER_RADIAN = 4.0  # instants looked at per radian of a ringing pole
MOST = 2000
EXCESS = 1e-9  # relative; a rise above the settled level that is no rounding


def peak_s(block: Rational) -> float:
    """Return when the step response is farthest out, s; infinite when it never exceeds the level it settles on."""
    if len(block.den) == 1:
        return float("inf")
    at = _instants(np.roots(block.den))
    height = step_response(block, at) / block.dc_gain
    top = int(np.argmax(height))
    if height[top] <= 1.0 + EXCESS:
        return float("inf")
    if top == 0:
        return 0.0
    ends = (float(at[top - 1]), float(at[min(top + 1, at.size - 1)]))
    found = minimize_scalar(
        lambda t: -float(step_response(block, np.array([t]))[0]) / block.dc_gain, bounds=ends, method="bounded",
        options={"xatol": 1e-6 * (ends[1] - ends[0])},
    )  # fmt: skip
    return float(found.x)


def peak(block: Rational, at_s: float) -> float:
    """Return V_p in V, given when it is reached (``peak_s``).

    At a peak the answer does not depend on when it is read, to first order; so V_p may be differentiated with respect
    to the block's coefficients at a fixed ``at_s``.
    """
    return block.dc_gain if np.isinf(at_s) else float(step_response(block, np.array([at_s]))[0])


def step_response(block: Rational, at_s: Array) -> Array:
    """Return the answer to a step of 1 V at 0 s, V, dead time left out, shape of ``at_s``."""
    a, b, taps, direct, w0 = companion(block.num, block.den)
    return np.asarray(direct + _integrated(a, b, at_s * w0) @ taps)


def _integrated(a: Matrix, b: Matrix, at: Array) -> Matrix:
    """Return the states at scaled times, from rest under a constant input of one, shape (times, order)."""
    n = a.shape[0]
    augmented = np.zeros((n + 1, n + 1))
    augmented[:n, :n], augmented[:n, n:] = a, b
    return np.asarray(expm(augmented * at[:, None, None])[:, :n, n])


def _instants(poles: np.ndarray) -> Array:
    """Return times at which nothing of the step response is missed, s."""
    found = [np.zeros(1)]
    for pole in poles:
        span = LONGEST / max(-pole.real, 1e-6 * abs(pole))
        count = min(max(BY_POLE, int(PER_RADIAN * span * abs(pole.imag))), MOST)
        found.append(np.linspace(0.0, span, count))
    return np.unique(np.concatenate(found))
