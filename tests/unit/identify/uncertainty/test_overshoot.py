"""Is the peak of a step response found, wherever it comes from?"""

import math

import numpy as np
import pytest
from scipy import signal

from identify.model import Rational
from identify.uncertainty.overshoot import peak, peak_s, step_response


def ringing(zeta: float, w: float = 3.0, gain: float = 1.0) -> Rational:
    return Rational((gain,), (1.0 / w**2, 2.0 * zeta / w, 1.0))


@pytest.mark.parametrize("zeta", [0.02, 0.2, 0.7])
@pytest.mark.parametrize("gain", [2.0, -0.5])
def test_a_second_order_block_rises_by_the_textbook_share(zeta, gain):
    block = ringing(zeta, gain=gain)
    damped = math.sqrt(1.0 - zeta**2)
    assert peak_s(block) == pytest.approx(math.pi / (3.0 * damped), rel=1e-3)
    assert peak(block, peak_s(block)) == pytest.approx(gain * (1.0 + math.exp(-math.pi * zeta / damped)), rel=1e-6)


@pytest.mark.parametrize(
    "block", [ringing(1.5), Rational((1000.0,), (1e-4, 20.0, 1000.0)), Rational((3.0,), (2.0,)), ringing(1.0)]
)
def test_without_overshoot_the_peak_is_the_settled_level(block):
    assert peak_s(block) == math.inf
    assert peak(block, math.inf) == block.dc_gain


def test_a_zero_makes_real_poles_overshoot():
    block = Rational((4.0, 1.0), (1.0, 2.0, 1.0))  # (4 s + 1) / (s + 1)^2: 1 + (3 t - 1) exp(-t), highest at t = 4/3
    assert peak_s(block) == pytest.approx(4.0 / 3.0, rel=1e-4)
    assert peak(block, peak_s(block)) == pytest.approx(1.0 + 3.0 * math.exp(-4.0 / 3.0), rel=1e-8)


def test_a_jump_at_the_start_may_be_the_peak():
    assert peak_s(Rational((2.0, 1.0), (1.0, 1.0))) == 0.0
    assert peak(Rational((2.0, 1.0), (1.0, 1.0)), 0.0) == pytest.approx(2.0)


def test_the_step_response_is_scipys():
    block = Rational((0.3, -0.2, 2.0), (0.02, 0.3, 1.1, 1.0))
    at = np.linspace(0.0, 8.0, 200)
    _, expected = signal.step((block.num, block.den), T=at)
    assert np.allclose(step_response(block, at), expected, atol=1e-9)


def test_a_fast_ring_on_a_slow_rise_is_not_missed():
    fast = ringing(0.05, w=1e4)
    num = np.polyadd(0.6 * np.array(fast.den), 0.4 * np.polymul(fast.num, (1.0, 1.0))).tolist()
    block = Rational(tuple(num), tuple(np.polymul(fast.den, (1.0, 1.0)).tolist()))
    at = np.linspace(0.0, 12.0, 400_001)
    assert peak(block, peak_s(block)) >= np.max(step_response(block, at[:2000] * 1e-3)) * (1.0 - 1e-9)
