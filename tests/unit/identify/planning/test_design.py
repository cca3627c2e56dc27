"""Does a designed protocol hold what it must, whatever weighs most, and is the paper's the paper's?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.model import LinearF, Model, Rational
from identify.planning.candidates import Room, Stairs, Tone
from identify.planning.design import Design, designed, off, purpose, slowed
from identify.planning.fig13 import fig13
from tests.unit.identify.planning.test_candidates import AROUND, MODEL

RC = replace(MODEL, g1=Rational((1.0,), (0.02, 1.0)), g2=Rational((1.0,), (0.002, 1.0)))
ROOM = Room(-10.0, 10.0, 2000.0, 10.0)


@pytest.fixture(scope="module")
def found() -> Design:
    return designed(RC, ROOM, 0.01)


def test_it_fits_the_time_and_uses_it(found: Design) -> None:
    total = sum(c.time_s * n for c, n in found.steps)
    assert found.time_s == pytest.approx(total)
    assert 9.0 < total <= 10.0


def test_f_can_be_read_without_dynamics_and_g1_told_from_g2_without_orders(found: Design) -> None:
    assert any(isinstance(c, Stairs) and c.readable for c, _ in found.steps)
    sines = [(c.frequency_hz, c.amplitude_v) for c, _ in found.steps if isinstance(c, Tone) and not c.triangle]
    frequencies = [f for f, _ in sines]
    assert any(frequencies.count(f) > 1 for f in frequencies)
    told = [purpose(RC, c, found.steps) for c, _ in found.steps]
    assert sum("Two amplitudes here" in sentence for sentence in told) >= 2


def test_too_short_a_time_and_too_slow_an_input_are_refused() -> None:
    with pytest.raises(ValueError, match=r"1 s is too short: .* takes 1.18 s, .* allow 2.36 s"):
        designed(MODEL, replace(ROOM, time_s=1.0), 0.01)
    ringing = Rational((1.0,), (1e-4, 2e-3, 1.0))
    with pytest.raises(ValueError, match="rings so far"):
        designed(replace(RC, g2=ringing), replace(ROOM, reading_v=2.6, time_s=60.0), 0.01)
    with pytest.raises(ValueError, match="allow a steeper slope"):
        designed(MODEL, replace(ROOM, slew_v_per_s=1e-3), 0.01)


def test_a_linear_rig_is_designed_for_too() -> None:
    line = replace(RC, f=LinearF(2.0, 0.1))
    steps = designed(line, replace(ROOM, time_s=5.0), 0.01).steps
    assert any(isinstance(c, Tone) for c, _ in steps)
    assert not any("border" in purpose(line, c, steps) for c, _ in steps)


def test_a_rig_that_is_off_is_slower_wider_and_steeper_by_as_much() -> None:
    wrong = off(MODEL, (1, -1, 1, -1))
    assert (wrong.f.d_l_v, wrong.f.d_u_v, wrong.f.s_l) == pytest.approx((1.625, -1.625, 5.6))  # type: ignore[union-attr]
    assert np.sort(np.roots(wrong.g1.den)) == pytest.approx(np.sort(np.roots(MODEL.g1.den)) / 1.3)
    assert np.sort(np.roots(wrong.g2.den)) == pytest.approx(np.sort(np.roots(MODEL.g2.den)) / 0.7)
    zeros = slowed(Rational((0.5, 2.0), (1.0, 3.0, 2.0), 0.1), 2.0)
    assert zeros.dc_gain == pytest.approx(1.0)
    assert zeros.dead_time_s == pytest.approx(0.2)
    assert np.roots(zeros.num) == pytest.approx([-2.0])


def test_the_paper_s_experiment_on_the_paper_s_rig_is_the_paper_s() -> None:
    walk, sine = fig13(MODEL, replace(ROOM, rate_hz=10_000.0, time_s=60.0))
    assert isinstance(walk, Stairs)
    assert len(walk.levels_v) == 26
    assert (walk.levels_v[0], max(walk.levels_v), walk.levels_v[-1]) == (-3.0, 3.0, -3.5)
    assert walk.dwell_s == pytest.approx(0.24, abs=1e-3)
    assert sine == Tone(50.0, 10.0, 0.0, 100)


def test_on_other_rigs_it_moves_the_gap_within_the_limits() -> None:
    scaled: Model = replace(MODEL, f=replace(MODEL.f, d_l_v=0.0125, d_u_v=-0.0125))  # type: ignore[type-var]
    walk, _ = fig13(scaled, ROOM)
    assert isinstance(walk, Stairs)
    assert max(walk.levels_v) == pytest.approx(0.03)
    walk, sine = fig13(AROUND, replace(ROOM, low_v=-2.8, high_v=2.8))
    assert isinstance(walk, Stairs)
    assert isinstance(sine, Tone)
    assert min(walk.levels_v) == pytest.approx(-2.8)
    assert sine.frequency_hz < 50.0
