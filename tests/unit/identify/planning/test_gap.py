"""Does the condition for a moving gap agree with the play operator itself?"""

import numpy as np
import pytest

from identify.model import Rational
from identify.planning.excitation import Wave
from identify.planning.gap import Gap, excess, fastest_hz, gap_in

OPAMP = Gap(8.0, 1.25, 8.0, -1.25)
G1 = Rational((1000.0,), (1e-4, 20.0, 1000.0))


def sine(amplitude_v: float, frequency_hz: float, offset_v: float = 0.0) -> Wave:
    return Wave("s", 1e4, 1 / frequency_hz, 1.0, offset_v, np.array([frequency_hz]), np.array([amplitude_v + 0j]))


@pytest.mark.parametrize(("frequency_hz", "needed_v"), [(50.0, 7.95), (100.0, 15.76), (250.0, 39.3)])
def test_the_amplitudes_that_free_the_paper_s_rig(frequency_hz: float, needed_v: float) -> None:
    """physics.md 1.4: 7.95 V is the lower end at 50 Hz; the stuck rows of Table 6 need 15.8 and 39.3 V."""
    assert 10.0 / excess(OPAMP, sine(10.0, frequency_hz), G1) == pytest.approx(needed_v, rel=3e-3)


def test_ten_volts_reach_63_hz() -> None:
    assert fastest_hz(OPAMP, G1, 10.0, 1000.0) == pytest.approx(63.0, abs=0.5)
    assert fastest_hz(OPAMP, G1, 1.0, 1000.0) is None


@pytest.mark.parametrize("seed", range(8))
def test_it_moves_just_above_the_threshold_and_never_below_whatever_the_slopes(seed: int) -> None:
    draw = np.random.default_rng(seed)
    s_l, s_u = draw.uniform(0.5, 9.0, 2)
    tried = Gap(s_l, draw.uniform(0.2, 2.0), s_u, draw.uniform(-2.0, -0.2))
    centre = draw.uniform(-0.15, 0.15)
    v = np.cos(2 * np.pi * np.arange(4000) / 4000)
    v += 0.4 * np.cos(4 * np.pi * np.arange(4000) / 4000 + draw.uniform(0.0, 6.0))
    threshold = 1.0 / tried.excess(centre, float(v.max()), float(v.min()))
    start = np.full(4000, centre)
    for factor, moves in ((0.99, False), (1.01, True)):
        approach = np.linspace(0.0, factor * threshold, 200)[:, None] * v + centre
        w = tried.passed(np.concatenate((start, approach.ravel(), np.tile(factor * threshold * v + centre, 3))))
        assert (np.ptp(w[-4000:]) > 1e-12) == moves


def test_a_gap_without_width_is_always_moved() -> None:
    assert Gap(1.0, 0.0, 1.0, 0.0).excess(0.0, 1e-6, -1e-6) == float("inf")


def test_levels_within_reach_meet_the_rails_exactly() -> None:
    low, high = OPAMP.reach(-10.0, 10.0)
    assert (low, high) == (-2.5, 2.5)
    assert OPAMP.passed(np.array([high]))[0] == 10.0
    assert OPAMP.passed(np.array([low]))[0] == -10.0


def test_a_chain_without_borders_has_no_gap() -> None:
    assert gap_in({"F.gain": 1.0, "F.offset": 0.0}) is None
