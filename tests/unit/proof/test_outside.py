"""Does physics that is in no catalogue do what its equation says, on signals whose answer is known by hand?"""

import numpy as np
import pytest

from tests.proof import outside
from tests.proof.integrator import Grid
from tests.proof.physics import Scene, ideal_play
from tests.proof.rigs import OP_AMP

GRID = Grid(1000.0, 400, 8, start_s=12.0)
T = GRID.run_s


def scene(**values: float) -> Scene:
    return Scene(GRID, OP_AMP, np.zeros(GRID.samples), values, seed=5)


def test_a_bit_that_is_stuck_lifts_every_other_step() -> None:
    u = np.array([-0.75, -0.25, 0.25, 0.75, 1.25])  # bits of 0.5 V: floor -2, -1, 0, 1, 2
    assert outside.stuck_bit(u, scene(weight=0.5)).tolist() == [-0.25, -0.25, 0.75, 0.75, 1.75]


def test_a_joint_cracks_once_by_the_clock() -> None:
    v = outside.cracked_joint(np.ones(T.size), scene(share=0.02, moment=12.1))
    assert np.all(v[T < 0.1] == 1.0)
    assert np.all(v[T > 0.1001] == 1.02)


def test_a_gap_that_warms_moves_its_borders_out_with_the_heat_of_v() -> None:
    v, tau = np.full(T.size, 3.0), 0.05
    v[0] = 0.0
    held = scene(k=0.1, tau=tau, top=3.0)
    w = outside.warming_gap(v, held)
    assert w[1] == pytest.approx(ideal_play(v, held)[1], rel=1e-3)
    assert w.max() == w[-1]  # it was pushed up to the border at first, and stays as the border retreats
    rising = np.linspace(0.0, 3.0, T.size)
    late = ideal_play(rising, held)[-1] - outside.warming_gap(rising, scene(k=0.1, tau=1e-5, top=3.0))[-1]
    assert late == pytest.approx(OP_AMP.s_l * 0.1 * OP_AMP.d_l_v, rel=1e-3)


def test_what_follows_motion_begins_with_none_however_fast_the_run_begins() -> None:
    """It had begun as if v had moved for ever as fast as in the first instant."""
    w, seen = 4.0 * -np.expm1(-T / 0.003), scene(k=0.1, tau=0.05, top=100.0)
    less = 1.0 - outside.worked_gain(w, seen)[1:] / w[1:]
    assert less[0] < 0.1 * less.max()
    assert less.max() == pytest.approx(0.1 * 4.0 / (100.0 * 0.05), rel=0.2)  # the way it went, over the lag
    wider = outside.stirred_gap(w, seen) - ideal_play(w, seen)
    assert 0.0 < np.abs(wider).max() < 1.05 * OP_AMP.s_l * 0.1 * 4.0 / (100.0 * 0.05)


def test_a_trigger_goes_up_and_down_at_levels_of_its_own() -> None:
    w = np.array([0.0, 0.9, 1.1, 0.0, -0.9, -1.1, 0.9, 1.2])
    assert (outside.trigger(w, scene(size=5.0, level=1.0)) - w).tolist() == [0.0, 0.0, 5.0, 5.0, 5.0, 0.0, 0.0, 5.0]


def test_rails_sag_with_what_was_drawn_before() -> None:
    w = np.full(T.size, 8.0)
    w[0] = 0.0
    out = outside.sagging_rails(w, scene(rail=9.0, sag=0.5, tau=0.05))
    assert out[1] == 8.0
    assert out[-1] == pytest.approx(9.0 - 0.5 * 8.0 * (1.0 - np.exp(-T[-1] / 0.05)), rel=1e-3)


def test_a_lag_of_one_way_falls_at_once() -> None:
    x = np.where((T > 0.1) & (T < 0.2), 1.0, 0.0)
    out = outside.one_way_lag(x, scene(tau=0.02))
    up = (T > 0.1005) & (T < 0.1995)
    assert np.allclose(out[up], 1.0 - np.exp(-(T[up] - 0.1) / 0.02), atol=0.01)
    assert np.all(out[T > 0.2001] == 0.0)


def test_a_line_of_the_source_goes_with_the_clock_and_not_with_u() -> None:
    out = outside.source_line(np.full(T.size, 2.0), scene(amplitude=0.1, frequency=70.0))
    middle_s = 12.0 + (np.arange(T.size) + 0.5) * GRID.step_s
    assert np.allclose(out, 2.0 + 0.1 * np.sin(2.0 * np.pi * 70.0 * middle_s))


def test_a_ripple_of_the_adc_s_reference_goes_with_the_reading_and_the_clock() -> None:
    y = np.full(GRID.samples, 2.0)
    out = outside.adc_ripple(y, scene(share=0.1, frequency=70.0))
    assert np.allclose(out, 2.0 + 0.2 * np.sin(2.0 * np.pi * 70.0 * (12.0 + GRID.sample_s)))


def test_a_noisy_reference_scatters_what_it_multiplies() -> None:
    y = np.repeat([0.0, 2.0, -8.0], 20_000)
    out = outside.noisy_reference(y, scene(sd=0.01)) - y
    assert np.all(out[:20_000] == 0.0)
    assert [np.std(part) for part in np.split(out, 3)[1:]] == pytest.approx([0.02, 0.08], rel=0.03)


def test_a_shared_supply_takes_its_share_with_u_of_the_sample_before() -> None:
    u = np.array([0.0, 5.0, -10.0, 0.0])
    seen = Scene(GRID, OP_AMP, u, {"share": 0.1, "top": 10.0}, seed=5)
    assert outside.shared_supply(np.full(4, 2.0), seen).tolist() == pytest.approx([2.0, 2.0, 1.9, 1.8])


def test_a_hold_wanders_inside_the_gap_and_no_border_lets_it_out() -> None:
    v = 1.2 * OP_AMP.d_l_v * np.sin(2.0 * np.pi * 5.0 * T)
    w, ideal = (outside.wandering_hold(v, scene(sd=sd)) for sd in (0.5, 0.0))
    assert np.allclose(ideal, ideal_play(v, scene()))
    lower, upper = OP_AMP.s_l * (v - OP_AMP.d_l_v), OP_AMP.s_u * (v - OP_AMP.d_u_v)
    assert np.all((w >= lower - 1e-12) & (w <= upper + 1e-12))
    first = T < 0.02  # before any border is met
    assert np.std(np.diff(w[first])) == pytest.approx(0.5 * np.sqrt(GRID.step_s), rel=0.2)


def test_an_amplifier_of_g1_that_is_too_slow_goes_straight() -> None:
    place, slow = outside.OUTSIDE["slow_g1"]
    v = slow(np.where(T < 0.1, 0.0, 1.0), scene(rate=10.0))
    assert place == "v"
    assert np.allclose(v, np.clip(10.0 * (T - 0.1), 0.0, 1.0), atol=2.0 * 10.0 * GRID.step_s)


def test_a_joint_warms_with_the_square_of_the_reading() -> None:
    y = outside.warm_joint(np.full(400, -2.0), scene(k=0.1, tau=0.05, top=4.0))
    assert y[[0, 49, -1]] == pytest.approx(-2.0 + 0.025 * -np.expm1(np.array([-1.0, -50.0, -400.0]) / 50.0), rel=1e-6)


def test_a_hurried_reading_is_short_by_its_rate() -> None:
    rising = 3.0 * np.arange(50) / 1000.0
    y = outside.hurried_reading(rising, scene(k=0.1, top=6.0))
    rate_hz = scene(k=0.1, top=6.0).grid.rate_hz
    assert y == pytest.approx(rising * (1.0 - 0.1 * min(3e-3 * rate_hz / 6.0, 1.0)))


def test_a_dimmed_source_lacks_a_share_in_every_half_period_of_the_mains() -> None:
    u = outside.dimmed_source(np.full(T.size, 2.0), scene(share=0.1))
    assert set(np.round(u, 9)) == {1.8, 2.0}
    assert np.mean(u < 1.9) == pytest.approx(0.3, abs=0.01)
    assert u[0] == pytest.approx(1.8)  # the clock of the runs starts with the mains


def test_every_turn_finds_another_gap() -> None:
    v = 3.0 * np.sin(2.0 * np.pi * 10.0 * T)
    w, ideal = (outside.scattered_gap(v, scene(sd=sd)) for sd in (0.1, 0.0))
    assert np.allclose(ideal, ideal_play(v, scene()))
    top = np.searchsorted(T, 0.025 + 0.1 * np.arange(4))  # of every period
    tops = (w - ideal)[top]
    assert len(set(np.round(tops, 6))) == 4
    assert 0.02 < np.std(tops) / OP_AMP.s_l < 0.5
