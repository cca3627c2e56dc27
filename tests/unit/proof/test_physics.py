"""Does each concealed piece of physics do what its equation says, on signals whose answer is known by hand?"""

from dataclasses import replace

import numpy as np
import pytest

from tests.proof import physics
from tests.proof.cases import CASES
from tests.proof.integrator import Grid, read_when
from tests.proof.outside import OUTSIDE
from tests.proof.physics import WHERE, Scene
from tests.proof.rigs import OP_AMP, SKEWED

GRID = Grid(1000.0, 400, 8, start_s=12.0)
T = GRID.run_s
STEP = np.where(T > 0.1, 1.0, 0.0)
AFTER = GRID.run_s > 0.1 + GRID.step_s  # the step itself takes one sub-step
LEVELS = np.array([-20.0, -3.0, 0.0, 5.0, 20.0])


def scene(rig=OP_AMP, u=None, grid=GRID, **values):
    return Scene(grid, rig, np.zeros(grid.samples) if u is None else u, values, seed=5)


def test_every_physics_is_concealed_in_some_case():
    assert {concealed.name for case in CASES for concealed in case.physics} <= {*WHERE, *OUTSIDE}
    assert not set(WHERE) & set(OUTSIDE)


# --- F: laws without memory ---------------------------------------------------------------------------------------


def test_saturation_is_flat_beyond_its_limits():
    assert physics.clipped(LEVELS, scene(upper=4.5, lower=-2.5)).tolist() == [-2.5, -2.5, 0.0, 4.5, 4.5]


def test_soft_saturation_is_odd_and_approaches_its_level():
    out = physics.soft_saturation(LEVELS, scene(level=7.0))
    assert out[-1] == pytest.approx(7.0 * np.tanh(20.0 / 7.0))
    assert out[0] == -out[-1]
    assert abs(out[-1]) < 7.0


def test_one_sided_soft_saturation_leaves_the_other_side_alone():
    out = physics.soft_saturation_upper(LEVELS, scene(level=7.0))
    assert np.array_equal(out[:3], LEVELS[:3])
    assert np.allclose(out[3:], 7.0 * np.tanh(LEVELS[3:] / 7.0))


def test_diode_clamp_solves_its_own_equation_and_leaves_negative_levels_alone():
    w = np.linspace(-5.0, 20.0, 300)
    out = physics.diode_clamp(w, scene(drop=2e-4, knee=1.1))
    assert np.array_equal(out[w <= 0], w[w <= 0])
    assert np.allclose((out + 2e-4 * np.expm1(out / 1.1))[w > 0], w[w > 0], rtol=0, atol=1e-9)
    assert out[-1] < 15.0


# --- F: the memory ------------------------------------------------------------------------------------------------

CHARGED = np.where(T < 0.05, 3.0, 1.5)  # v jumps onto the rising border, then back into the gap, and rests there
CHARGED_W = 8.0 * (3.0 - 1.25)


def test_leak_decays_exponentially_towards_zero_on_the_plateau_and_not_on_the_border():
    w = physics.leak(CHARGED, scene(rate=2.0))
    on_border, plateau = T < 0.05, T >= 0.05
    expected = np.maximum(CHARGED_W * np.exp(-2.0 * (T[plateau] - T[plateau][0] + GRID.step_s)), 8.0 * (1.5 - 1.25))
    assert np.all(w[on_border] == CHARGED_W)
    assert np.allclose(w[plateau], expected, rtol=0, atol=1e-12)


def test_bias_current_is_a_straight_run_on_the_plateau_until_the_border_stops_it():
    w = physics.bias_current(CHARGED, scene(current=30.0))
    assert np.allclose(w, np.minimum(CHARGED_W + 30.0 * T, 8.0 * (CHARGED + 1.25)), rtol=0, atol=1e-9)
    assert w[-1] == 8.0 * (1.5 + 1.25)


def test_without_leak_or_current_the_plateau_is_ideal():
    ideal = physics.ideal_play(CHARGED, scene())
    assert np.array_equal(physics.leak(CHARGED, scene(rate=0.0)), ideal)
    assert np.array_equal(physics.bias_current(CHARGED, scene(current=0.0)), ideal)


def test_borders_are_crossed_where_the_rig_says():
    lower, upper = physics.borders(np.array([SKEWED.d_l_v, SKEWED.d_u_v, 2.0]), SKEWED)
    assert lower[0] == upper[1] == 0.0
    assert lower[2] == SKEWED.s_l * (2.0 - SKEWED.d_l_v)
    assert upper[2] == SKEWED.s_u * (2.0 - SKEWED.d_u_v)


def test_curved_border_adds_the_cube_of_the_distance_from_the_crossing():
    v = np.linspace(0.0, 3.0, 100)
    w = physics.curved_border(v, scene(k3=0.1))
    beyond = v > 1.25
    assert np.allclose(w[beyond], 8.0 * (v[beyond] - 1.25) + 0.1 * (v[beyond] - 1.25) ** 3)
    assert np.all(w[~beyond] == 0.0)


def test_second_play_takes_up_in_two_stages():
    v = np.linspace(0.0, 3.0, 301)
    w = physics.second_play(v, scene(gap=4.0, weight=0.25))
    slope = np.diff(w) / np.diff(v)
    assert np.allclose(slope[v[1:] < 1.25], 0.0)
    assert np.allclose(slope[(v[:-1] > 1.25) & (v[1:] < 2.0)], 0.75 * 8.0)
    assert np.allclose(slope[v[:-1] > 2.0], 8.0)


def test_rate_dependent_gap_makes_contact_later_by_k_times_the_speed():
    v = 10.0 * T  # V: 10 V/s, up to 4 V
    w = physics.rate_dependent_gap(v, scene(k=0.05))
    assert np.allclose(w, np.maximum(8.0 * (v - 1.25 - 0.5), 0.0), rtol=0, atol=1e-9)
    assert np.allclose(physics.rate_dependent_gap(-v, scene(k=0.05)), -w, rtol=0, atol=1e-9)


@pytest.mark.parametrize("speed", [1.0, 100.0, 1000.0])
def test_a_contact_through_a_diode_is_later_by_the_logarithm_of_the_speed(speed):
    there = scene(n_vt=0.03)
    v = speed * there.grid.step_s * np.arange(round(5.0 / (speed * there.grid.step_s)))
    w = physics.diode_contact(v, there)
    late = 0.03 * np.log(speed / 100.0)
    assert w[-1] == pytest.approx(8.0 * (v[-1] - 1.25 - late), abs=1e-4)
    assert np.allclose(physics.diode_contact(-v, there), -w, rtol=0, atol=1e-9)


def test_slew_limit_leaves_slow_signals_alone_and_bounds_fast_ones():
    assert np.allclose(physics.slew_limit(3.0 * T, scene(rate=5.0)), 3.0 * T)
    out = physics.slew_limit(STEP, scene(rate=5.0))
    assert np.allclose(out[AFTER], np.minimum(5.0 * (T[AFTER] - 0.1), 1.0), rtol=0, atol=1e-9)


def test_absorption_jumps_at_once_but_for_its_fraction_which_creeps():
    out = physics.absorption(STEP, scene(fraction=0.2, tau=0.05))
    expected = 1.0 - 0.2 * np.exp(-(T[AFTER] - 0.1) / 0.05)
    assert np.allclose(out[AFTER], expected, rtol=0, atol=2e-3)


# --- dynamics -----------------------------------------------------------------------------------------------------


def test_extra_pole_answers_a_step_with_its_exponential():
    out = physics.extra_pole(2.0 * STEP, scene(tau=0.03))
    assert np.allclose(out[AFTER], 2.0 * (1.0 - np.exp(-(T[AFTER] - 0.1) / 0.03)), rtol=0, atol=5e-3)


def test_resonance_amplifies_its_own_frequency_by_one_over_two_zeta():
    wn = 2.0 * np.pi * 40.0
    out = physics.resonance(np.sin(wn * T), scene(w_n=wn, zeta=0.25))
    assert np.ptp(out[T > 0.25]) / 2.0 == pytest.approx(2.0, rel=2e-3)


def test_dead_time_reads_a_ramp_late_by_a_part_of_a_sample():
    y = read_when(4.0 * T, physics.dead_time(GRID.sample_s, scene(delay=1.7e-3)), GRID.step_s)
    assert np.allclose(y[2:], 4.0 * (GRID.sample_s[2:] - 1.7e-3), rtol=0, atol=1e-12)


# --- sense --------------------------------------------------------------------------------------------------------


def test_feedthrough_adds_what_the_dac_held_before_the_reading():
    u = np.random.default_rng(1).normal(size=GRID.samples)
    y = physics.feedthrough(np.zeros(GRID.samples), scene(u=u, k=0.3))
    assert y[0] == 0.0
    assert np.allclose(y[1:], 0.3 * u[:-1])


def test_hum_is_three_lines_of_the_amplitudes_given():
    values = {"frequency": 50.0, "amplitude": 0.2, "third": 0.06, "fifth": 0.02}
    y = physics.hum_at_y(np.zeros(GRID.samples), scene(**values))
    lines = np.abs(np.fft.rfft(y)) * 2.0 / y.size
    at = {hz: round(hz * y.size / GRID.rate_hz) for hz in (50, 150, 250)}
    assert [lines[at[hz]] for hz in at] == pytest.approx([0.2, 0.06, 0.02])
    assert np.delete(lines, list(at.values())).max() < 1e-10


@pytest.mark.parametrize("hum", [physics.hum_at_y, physics.hum_at_v])
def test_hum_runs_on_with_the_clock_from_one_run_to_the_next(hum):
    values = {"frequency": 49.97, "amplitude": 0.2, "third": 0.0, "fifth": 0.0}
    size = GRID.samples if hum is physics.hum_at_y else T.size
    steps_of_grid = 1 if hum is physics.hum_at_y else GRID.substeps
    first = hum(np.zeros(size), scene(**values))
    later = hum(np.zeros(size), scene(grid=Grid(1000.0, 400, 8, start_s=12.1), **values))
    assert np.allclose(first[100 * steps_of_grid :], later[: size - 100 * steps_of_grid], rtol=0, atol=1e-12)


def test_offset_drift_is_zero_at_clock_zero_and_grows_with_the_clock():
    y = physics.offset_drift(np.zeros(GRID.samples), scene(rate=2e-3))
    assert y[0] == pytest.approx(2e-3 * 12.0)
    assert y[-1] - y[0] == pytest.approx(2e-3 * GRID.sample_s[-1])


def test_gain_drift_multiplies_by_the_clock():
    y = physics.gain_drift(np.full(GRID.samples, 3.0), scene(rate=1e-2))
    assert y[0] == pytest.approx(3.0 * 1.12)


def test_rectifying_sensor_loses_the_sign_it_is_told_to_lose():
    assert np.array_equal(physics.rectifying_sensor(LEVELS, scene(lost=1.0)), np.abs(LEVELS))
    assert np.allclose(physics.rectifying_sensor(LEVELS, scene(lost=0.25)), [-10.0, -1.5, 0.0, 5.0, 20.0])


def test_ac_coupling_lets_a_plateau_decay():
    out = physics.ac_coupling(STEP, scene(tau=0.08))
    assert np.allclose(out[AFTER], np.exp(-(T[AFTER] - 0.1) / 0.08), rtol=0, atol=2e-3)


def test_adc_averaging_turns_a_step_into_a_ramp_of_its_length():
    out = physics.adc_averaging(STEP, scene(length=0.08))
    assert np.allclose(out, np.clip((T - 0.1) / 0.08, 0.0, 1.0), rtol=0, atol=2e-3)
    assert np.allclose(physics.adc_averaging(np.full_like(STEP, 3.0), scene(length=0.08)), 3.0)


def test_adc_nonlinearity_bends_the_readings():
    out = physics.adc_nonlinearity(np.array([-2.0, 0.0, 3.0]), scene(k2=0.1, k3=-0.01))
    assert np.allclose(out, [-2.0 + 0.4 + 0.08, 0.0, 3.0 + 0.9 - 0.27])


# --- the rest of the catalogue ------------------------------------------------------------------------------------


def test_rounding_leaves_multiples_of_the_step():
    out = physics.rounded(np.array([0.04, 0.06, -0.31]), scene(lsb=0.1))
    assert np.allclose(out, [0.0, 0.1, -0.3])


def test_a_bent_source_adds_its_cube():
    assert np.allclose(physics.cubic(np.array([-2.0, 3.0]), scene(k=0.01)), [-2.08, 3.27])


def test_a_source_pole_and_an_ac_coupling_share_out_a_step():
    drive = np.where(T[1:] > 0.1, 2.0, 0.0)
    slow, fast = physics.source_pole(drive, scene(tau=0.04)), physics.input_ac_coupling(drive, scene(tau=0.04))
    since = np.maximum(T[1:] - 0.1, 0.0)
    assert np.allclose(slow, 2.0 * -np.expm1(-since / 0.04), rtol=0, atol=5e-3)
    assert np.allclose(slow + fast, drive)


def test_a_gap_is_put_where_the_rig_file_knows_none():
    linear = replace(OP_AMP, d_l_v=0.0, d_u_v=0.0, linear=True)
    v = np.sin(40.0 * T)
    w = physics.backlash(v, scene(linear, D_L=0.3, D_U=-0.2))
    assert np.array_equal(w, physics.ideal_play(v, scene(replace(OP_AMP, d_l_v=0.3, d_u_v=-0.2))))
    assert np.array_equal(physics.backlash(v, scene(linear, D_L=0.0, D_U=0.0)), physics.ideal_play(v, scene(linear)))


def test_unequal_slopes_change_the_falling_border_only():
    v = 3.0 * np.sin(40.0 * T)
    w = physics.unequal_slopes(v, scene(ratio=1.1))
    assert w.max() == pytest.approx(8.0 * (3.0 - 1.25), rel=1e-4)
    assert w.min() == pytest.approx(8.8 * (-3.0 + 1.25), rel=1e-4)


def test_a_knee_takes_up_as_a_parabola_and_ends_on_the_border():
    v, width = np.linspace(0.0, 4.0, 8001), 0.4
    w = physics.soft_knee(v, scene(width=width))
    x = np.clip(v - 1.25 + 0.5 * width, 0.0, width)
    assert np.allclose(w, 8.0 * (0.5 * x**2 / width + np.maximum(v - 1.25 - 0.5 * width, 0.0)), rtol=0, atol=3e-4)
    assert np.allclose(physics.soft_knee(-v, scene(width=width)), -w, rtol=0, atol=1e-12)


def test_a_knee_comes_back_to_where_v_turned():
    v = np.concatenate([np.linspace(0.0, 1.3, 500), np.linspace(1.3, 0.0, 37), np.linspace(0.0, 1.3, 911)])
    w = physics.soft_knee(v, scene(width=0.4))
    assert np.all(w[500:530] == w[499])
    assert w[-1] == w[499]


def test_tilt_lets_a_plateau_follow_v():
    v = np.concatenate([np.linspace(0.0, 3.0, 100), np.linspace(3.0, 1.0, 100)])
    w = physics.plateau_tilt(v, scene(k=0.05))
    assert np.allclose(w[100:] - w[199], 0.05 * (v[100:] - v[199]))


def test_process_noise_has_its_size_and_its_band():
    v = physics.process_noise(np.zeros(40_001), scene(sd=0.2, bandwidth=700.0))
    assert np.std(v) == pytest.approx(0.2, rel=0.05)
    power = np.abs(np.fft.rfft(v)) ** 2
    above = np.fft.rfftfreq(v.size, GRID.step_s) > 701.0
    assert power[above].sum() < 1e-12 * power.sum()


def test_low_passed_noise_forgets_as_its_bandwidth_says():
    v = physics.low_passed_noise(np.zeros(200_001), scene(sd=0.2, bandwidth=100.0))
    assert np.std(v) == pytest.approx(0.2, rel=0.05)
    lag = round(1.0 / (2.0 * np.pi * 100.0 * GRID.step_s))
    assert np.corrcoef(v[lag:], v[:-lag])[0, 1] == pytest.approx(np.exp(-1.0), abs=0.05)


def test_a_fast_clock_reads_ever_earlier():
    times = physics.clock_skew(GRID.sample_s, scene(ppm=200.0))
    assert times[0] == 0.0
    assert GRID.sample_s[-1] - times[-1] == pytest.approx(2e-4 * GRID.sample_s[-1])


def test_coloured_noise_has_its_size_and_its_slope():
    y = physics.coloured_noise(np.zeros(40_000), scene(grid=Grid(1000.0, 40_000, 1), sd=0.3, slope=1.5))
    assert np.sqrt(np.mean(y**2)) == pytest.approx(0.3, rel=0.3)  # few lines carry most of it
    power = np.abs(np.fft.rfft(y)) ** 2
    low, high = np.mean(power[100:200]), np.mean(power[1000:2000])
    assert np.log10(low / high) == pytest.approx(1.5, abs=0.2)


def test_spikes_come_as_often_and_as_large_as_told():
    grid = Grid(1000.0, 50_000, 1, start_s=3.0)
    y = physics.spikes(np.zeros(50_000), scene(grid=grid, rate=4.0, size=0.5))
    assert set(np.unique(y)) <= {-1.0, -0.5, 0.0, 0.5, 1.0}
    assert np.count_nonzero(y) == pytest.approx(200, abs=45)


def test_lost_readings_bring_what_follows_early_in_one_run():
    y = np.arange(400.0)
    out = physics.missing_samples(y, scene(position=12.1, count=3.0))
    assert np.array_equal(out[:100], y[:100])
    assert np.array_equal(out[100:397], y[103:])
    assert np.array_equal(physics.missing_samples(y, scene(position=1.0, count=3.0)), y)


def test_a_pair_of_diodes_solves_its_own_equation_and_a_lower_diode_is_an_upper_one_turned():
    w = np.linspace(-20.0, 20.0, 801)
    out = physics.diode_pair(w, scene(drop=2e-4, knee=0.7, series=0.1))
    current = w - out  # in volts on R
    assert np.allclose(current, 4e-4 * np.sinh((out - 0.1 * current) / 0.7), rtol=0, atol=1e-3)
    one_sided = scene(drop=2e-4, knee=0.7)
    assert np.array_equal(physics.diode_clamp_lower(w, one_sided), -physics.diode_clamp(-w, one_sided))
