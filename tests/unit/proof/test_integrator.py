"""Does the integrator move a linear block as the exact solution of its equation says?"""

from itertools import pairwise

import numpy as np
import pytest

from tests.proof.bench import SUBSTEPS
from tests.proof.integrator import Grid, between, held, linear_block, play, read_at, slewed
from tests.proof.rigs import OP_AMP

TAU_S = 3e-3
STEP_S = 1e-5
T = np.arange(4001) * STEP_S


def _first_order_step(t):
    return 1.0 - np.exp(-t / TAU_S)


def _first_order_ramp(t):
    return t - TAU_S * (1.0 - np.exp(-t / TAU_S))


def _second_order_step(t, wn, zeta):
    wd = wn * np.sqrt(1.0 - zeta**2)
    return 1.0 - np.exp(-zeta * wn * t) * (np.cos(wd * t) + zeta * wn / wd * np.sin(wd * t))


def _lag_error(steps, drive_of, exact, tau_s=TAU_S):
    t = np.linspace(0.0, 4.0 * tau_s, steps + 1)
    out = linear_block(drive_of(t), (1.0,), (tau_s, 1.0), t[1])
    return np.abs(out - exact(t)).max()


def test_step_response_of_first_order_is_exponential():
    out = linear_block(np.full(4000, 2.0), (1.0,), (TAU_S, 1.0), STEP_S)
    assert np.abs(out - 2.0 * _first_order_step(T)).max() < 1e-6


def test_ramp_response_of_first_order_lags_by_tau():
    out = linear_block(between(T), (1.0,), (TAU_S, 1.0), STEP_S)
    assert np.abs(out - _first_order_ramp(T)).max() < 1e-8
    assert out[-1] == pytest.approx(T[-1] - TAU_S, abs=1e-8)


@pytest.mark.parametrize("zeta", [0.1, 0.7])
def test_step_response_of_second_order_overshoots_as_the_textbook_says(zeta):
    wn = 400.0
    out = linear_block(np.ones(4000), (wn**2,), (1.0, 2.0 * zeta * wn, wn**2), STEP_S)
    assert np.abs(out - _second_order_step(T, wn, zeta)).max() < 1e-5
    assert out.max() == pytest.approx(1.0 + np.exp(-np.pi * zeta / np.sqrt(1.0 - zeta**2)), abs=1e-4)


def test_zeros_of_the_numerator_count():
    out = linear_block(np.ones(4000), (TAU_S / 2.0, 1.0), (TAU_S**2, 2.0 * TAU_S, 1.0), STEP_S)
    exact = 1.0 - np.exp(-T / TAU_S) * (1.0 + T / TAU_S / 2.0)
    assert np.abs(out - exact).max() < 1e-5


def test_stiff_block_of_the_op_amp_rig_settles_to_the_slow_pole():
    grid = Grid(10_000.0, 1000, SUBSTEPS)
    slow, fast = np.sort(-np.roots(OP_AMP.g1_den).real)
    out = linear_block(np.ones(grid.samples * SUBSTEPS), OP_AMP.g1_num, OP_AMP.g1_den, grid.step_s)
    exact = 1.0 - (fast * np.exp(-slow * grid.run_s) - slow * np.exp(-fast * grid.run_s)) / (fast - slow)
    assert np.abs(out - exact).max() < 1e-5
    assert np.abs(out - exact)[SUBSTEPS:].max() < 1e-8


@pytest.mark.parametrize(
    ("drive_of", "exact"), [(lambda t: np.ones(t.size - 1), _first_order_step), (between, _first_order_ramp)]
)
def test_error_falls_with_the_square_of_the_step(drive_of, exact):
    errors = [_lag_error(steps, drive_of, exact) for steps in (50, 100, 200, 400)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2.0) < 0.05)


def test_block_settled_before_the_run_stays_where_it_is():
    out = linear_block(np.full(50, 0.7), OP_AMP.g2_num, OP_AMP.g2_den, STEP_S, rest=0.7)
    assert np.abs(out - 0.7).max() < 1e-12


def test_block_without_a_continuous_output_is_refused():
    with pytest.raises(ValueError, match="not strictly proper"):
        linear_block(np.ones(3), (1.0, 0.0), (1.0, 1.0), STEP_S)


def test_held_drive_acts_from_its_own_sample_on_and_is_read_before():
    grid = Grid(1000.0, 3, 8)
    nodes = linear_block(held(np.array([5.0, 0.0, 0.0]), grid), (1.0,), (1e-3, 1.0), grid.step_s)
    y = read_at(nodes, grid)
    assert y[0] == 0.0
    assert y[1] == pytest.approx(5.0 * (1.0 - np.exp(-1.0)), rel=2e-3)
    assert y[2] == pytest.approx(y[1] * np.exp(-1.0), rel=2e-3)


def test_late_reading_of_a_ramp_is_behind_by_the_delay():
    grid = Grid(1000.0, 40, 8)
    y = read_at(10.0 * grid.run_s, grid, delay_s=2.37e-3)
    assert np.allclose(y[3:], 10.0 * (grid.sample_s[3:] - 2.37e-3), rtol=0, atol=1e-12)
    assert np.all(y[:3] == 0.0)


def _play_by_turning_points(v, s, gap):
    """Return w of a play of slope s and full width gap: on a monotone stretch only its first value matters."""
    turns = [0, *(1 + np.flatnonzero(np.diff(np.sign(np.diff(v))) != 0)), v.size - 1]
    w, level = np.zeros(v.size), 0.0
    for first, last in pairwise(turns):
        stretch = slice(first, last + 1)
        w[stretch] = np.clip(level, s * (v[stretch] - gap / 2), s * (v[stretch] + gap / 2))
        level = w[last]
    return w


def test_play_agrees_with_a_walk_from_turning_point_to_turning_point():
    t = np.linspace(0.0, 1.0, 20_001)
    v = 2.0 * np.sin(2 * np.pi * 3 * t) + 1.3 * np.sin(2 * np.pi * 7.3 * t + 0.4)
    w = play(8.0 * (v - 1.25), 8.0 * (v + 1.25), 0.0, 1.0, 0.0)
    assert np.ptp(w) > 10.0
    assert np.allclose(w, _play_by_turning_points(v, 8.0, 2.5), rtol=0, atol=1e-12)


def test_play_stays_stuck_inside_its_gap():
    v = 1.2 * np.sin(np.linspace(0.0, 50.0, 5000))
    assert np.all(play(8.0 * (v - 1.25), 8.0 * (v + 1.25), 0.0, 1.0, 0.0) == 0.0)


def test_slewed_follower_moves_in_a_straight_line_until_it_catches_up():
    out = slewed(np.concatenate([[0.0], np.full(9, 1.0)]), 0.25)
    assert np.allclose(out, [0.0, 0.25, 0.5, 0.75, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0])
