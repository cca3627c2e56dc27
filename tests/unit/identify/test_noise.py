"""Is the noise told from what repeats, and not from what is physics?"""

from dataclasses import replace
from unittest import mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from identify import noise as noise_module
from identify.noise import (
    BEGINNINGS,
    good,
    grid_step_v,
    noise_of,
    period_of,
    quantisation_rms,
    settled_dwells,
    stretches,
)
from identify.trace import LONG, Step, Trace, blocks
from tests.proof.rigs import OP_AMP, RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import noisy, recorded

NOISE_V = 0.010
SETTLE_S = 0.15  # 7 time constants of 20 ms
PERIODS = recorded(RC, sine("sine", 50.0, 6.0, 10, 5))
DWELLS = recorded(OP_AMP, staircase("stairs", FIG13_LEVELS_V[::3], 0.3))


def within(measured, true, count):
    """Return whether an estimate from ``count`` values lies where 999 of 1000 would."""
    low, high = np.sqrt(chi2.ppf([5e-4, 1.0 - 5e-4], count) / count)
    return low * true < measured < high * true


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("true_v", [1e-4, 0.01, 0.3])
def test_repeated_periods_tell_the_noise(true_v, seed):
    noise = noise_of([noisy(PERIODS, true_v, seed)], SETTLE_S)
    assert noise.origin == "repeated periods"
    assert within(noise.rms_v, true_v, PERIODS.size // 4)  # overlapping differences hold fewer values than they are


@pytest.mark.parametrize("seed", range(5))
def test_settled_dwells_tell_the_noise(seed):
    noise = noise_of([noisy(DWELLS, NOISE_V, seed)], SETTLE_S)
    assert noise.origin == "settled dwells"
    assert within(noise.rms_v, NOISE_V, DWELLS.size // 8)


def test_drift_hum_and_droop_are_no_noise():
    t = DWELLS.start_s + np.arange(DWELLS.size) / DWELLS.rate_hz
    slow = 0.05 * np.sin(2.0 * np.pi * 50.0 * t) + 0.3 * t + 0.2 * np.exp(-t)
    trace = noisy(replace(DWELLS, y=DWELLS.y + slow), NOISE_V, 3)
    assert noise_of([trace], SETTLE_S).rms_v == pytest.approx(NOISE_V, rel=0.05)


def test_physics_that_repeats_with_the_stimulus_is_no_noise():
    clipped = noisy(replace(PERIODS, y=np.clip(PERIODS.y, -1.0, 1.5)), NOISE_V, 1)
    assert noise_of([clipped], SETTLE_S).rms_v == pytest.approx(NOISE_V, rel=0.1)


def test_recordings_are_pooled():
    both = noise_of([noisy(PERIODS, NOISE_V, 1), noisy(replace(PERIODS, name="b"), 3.0 * NOISE_V, 2)], SETTLE_S)
    assert both.rms_v == pytest.approx(np.sqrt(5.0) * NOISE_V, rel=0.1)


def test_samples_that_were_lost_do_not_count():
    trace = noisy(PERIODS, NOISE_V, 1)
    y, valid = trace.y.copy(), np.ones(trace.size, dtype=bool)
    y[3000:3010], valid[3000:3010] = 50.0, False
    lost = Trace("lost", trace.rate_hz, trace.u, y, valid=valid)
    assert noise_of([lost], SETTLE_S).rms_v == pytest.approx(NOISE_V, rel=0.05)
    assert np.array_equal(good(lost), valid)
    assert good(trace).all()


def test_a_handful_of_repeats_is_not_enough():
    few = replace(noisy(unrepeated(), 0.02, 1), u=np.concatenate([unrepeated().u[:3800], np.zeros(200)]))
    assert noise_of([few], 0.017, declared_v=0.5).origin == "the rig file"  # 29 differences
    assert noise_of([few], 0.010, declared_v=0.5).origin == "settled dwells"  # 99


def unrepeated(count=4000, seed=0):
    """Return a trace of a linear filter under levels that never rest or repeat."""
    u = np.random.default_rng(seed).normal(size=count)
    return Trace("random", 1e4, u, np.convolve(u, 0.5 ** np.arange(10.0))[:count])


def test_without_repeats_the_rig_file_is_believed():
    noise = noise_of([noisy(unrepeated(), 0.02, 1)], SETTLE_S, declared_v=0.015)
    assert (noise.rms_v, noise.origin) == (0.015, "the rig file")


def test_without_any_other_source_a_free_filter_bounds_it():
    noise = noise_of([noisy(unrepeated(), 0.02, 1)], SETTLE_S)
    assert "upper bound" in noise.origin
    assert noise.rms_v == pytest.approx(0.02, rel=0.1)


@pytest.mark.parametrize("traces", [[unrepeated(50)], []], ids=["short", "none"])
def test_no_source_at_all_is_admitted(traces):
    with pytest.raises(ValueError, match="the noise cannot be told"):
        noise_of(traces, SETTLE_S)


@pytest.mark.parametrize("declared_v", [None, 0.01])
@pytest.mark.parametrize("stimulus", [unrepeated(), PERIODS], ids=["random", "repeated"])
def test_an_input_that_reads_one_value_is_told_as_that(stimulus, declared_v):
    dead = replace(stimulus, y=np.full(stimulus.size, 2.5))
    with pytest.raises(ValueError, match=r"^every reading is 2\.5 V: .* check the cable, the channel"):
        noise_of([dead], SETTLE_S, declared_v)


def test_periods_that_are_the_same_to_the_last_digit_tell_no_noise():
    noise = noise_of([PERIODS], SETTLE_S, declared_v=0.015)
    assert (noise.rms_v, noise.origin) == (0.015, "the rig file")


def test_readings_that_mostly_repeat_the_one_before_are_bounded_by_the_steps_of_the_adc():
    lsb = 0.5
    coarse = replace(unrepeated(), y=lsb * np.round(np.cumsum(unrepeated().u) / 20.0 / lsb))
    assert np.median(np.abs(np.diff(coarse.y, 2))) == 0.0
    assert noise_of([coarse], SETTLE_S).rms_v == pytest.approx(lsb / np.sqrt(12.0))


def test_where_the_rig_is_far_from_linear_neighbours_bound_the_noise():
    t = np.arange(20_000) / 1e4
    u = 3.0 * np.sin(2.0 * np.pi * (2.0 * t + 3.0 * t**2))
    bent = Trace("chirp", 1e4, u, np.abs(u) ** 3)
    noise = noise_of([noisy(bent, 0.02, 1)], SETTLE_S)
    assert "neighbouring readings, an upper bound" in noise.origin
    assert noise.rms_v == pytest.approx(0.02, rel=0.02)


def test_a_quiet_reading_on_a_coarse_grid_has_the_noise_of_its_steps():
    lsb = 0.04
    coarse = replace(PERIODS, y=lsb * np.round(PERIODS.y / lsb))
    assert quantisation_rms([coarse]) == pytest.approx(lsb / np.sqrt(12.0), rel=1e-6)
    assert noise_of([coarse], SETTLE_S).rms_v >= 0.999 * lsb / np.sqrt(12.0)
    assert quantisation_rms([PERIODS]) == 0.0


def test_readings_lie_on_a_grid_however_many_levels_they_take():
    rng = np.random.default_rng(5)
    y = 0.0037 * np.rint(rng.uniform(-9.0, 9.0, 8000) / 0.0037) + 0.0011
    on = Trace("on", 1e3, np.zeros(8000), y)
    off = Trace("off", 1e3, np.zeros(8000), np.where(np.arange(8000) == 4321, y + 0.0015, y))
    assert grid_step_v([on]) == pytest.approx(0.0037, rel=1e-6)
    assert grid_step_v([on, off]) == 0.0
    lost = np.arange(8000) != 0
    holed = replace(off, y=np.where(lost, off.y, np.nan), valid=lost)
    assert grid_step_v([holed]) == 0.0
    assert grid_step_v([replace(holed, y=np.where(lost, y, np.nan))]) == pytest.approx(0.0037, rel=1e-6)
    assert grid_step_v([Trace("free", 1e3, np.zeros(800), rng.standard_normal(800))]) == 0.0



@settings(max_examples=50, deadline=None)
@given(st.integers(3, 60), st.integers(2, 5), st.integers(0, 40), st.integers(0, 2**32 - 1))
def test_the_period_of_a_repeated_signal_is_found(period, repeats, more, seed):
    once = np.random.default_rng(seed).uniform(-5.0, 5.0, period)
    u = np.tile(once, repeats + 1)[: period * repeats + min(more, period)]
    assert period_of(u) == period


def test_what_never_repeats_has_no_period():
    assert period_of(np.random.default_rng(0).normal(size=500)) == 0
    assert period_of(np.ones(500)) == 0
    assert period_of(np.array([1.0, 2.0, 1.0])) == 0
    assert period_of(np.linspace(0.0, 1.0, 300)) == 0


def test_a_period_must_fit_twice():
    once = np.random.default_rng(1).normal(size=100)
    assert period_of(np.concatenate([once, once[:60]])) == 0


def test_a_dwell_is_settled_more_than_the_settling_time_after_a_change():
    u = np.array([0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 2.0, 2.0])
    assert settled_dwells(u, 2) == [(5, 6)]
    assert settled_dwells(u, 0) == [(1, 2), (3, 6), (7, 8)]
    assert settled_dwells(np.zeros(4), 1) == [(2, 4)]
    assert settled_dwells(np.zeros(1), 0) == []


@settings(max_examples=100, deadline=None)
@given(st.lists(st.integers(0, 2), min_size=1, max_size=60), st.integers(0, 5), st.integers(1, 7))
def test_dwells_do_not_depend_on_how_the_signal_is_cut(levels, settle, size):
    u = np.array(levels, dtype=float)
    calm = [k for k in range(u.size) if k > settle and np.ptp(u[k - settle - 1 : k + 1]) == 0.0]
    with mock.patch.object(noise_module, "blocks", lambda start, stop: blocks(start, stop, size)):
        found = settled_dwells(u, settle)
    assert [k for start, stop in found for k in range(start, stop)] == calm


@pytest.mark.parametrize("period", [1000, 40_000, 600_000])
def test_the_period_of_a_long_signal_is_found_without_looking_at_all_of_it_at_once(period):
    once = np.sin(np.arange(period) * 2.0 * np.pi / period) + (np.arange(period) == 700)
    u = np.tile(once, 3 * LONG // period + 1)
    assert period_of(u) == period
    u[-period // 2] += 0.1
    assert period_of(u) == 0


def test_a_period_too_long_to_be_looked_for_is_not_found():
    assert period_of(np.arange(2 * BEGINNINGS[-1]) % (BEGINNINGS[-1] // 2 + 1) * 1e-3) == 0


def test_stretches_join_repeats_that_follow_each_other():
    steps = (
        Step("a", "sine", 0, 10), Step("a", "sine", 10, 20, 1), Step("b", "sine", 20, 30), Step("a", "sine", 35, 40, 2),
    )  # fmt: skip
    trace = Trace("t", 1e3, np.zeros(40), np.zeros(40), steps=steps)
    assert stretches(trace) == [(0, 20), (20, 30), (35, 40)]
    assert stretches(replace(trace, steps=())) == [(0, 40)]
