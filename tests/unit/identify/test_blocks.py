"""Do the stages of the plain model delay, filter and hold as their equations say?"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.between import source_voltage
from identify.blocks import Gain, LinearBlock, Play, run_linear
from identify.model import Backlash, LinearF, Rational
from identify.stage import Block, Grid, Held, Parameter, Place, Ramp

STEP_S = 1e-4
TAU_S = 3.7e-4
GRID = Grid("a", STEP_S)
G1 = LinearBlock(Rational((2e-3, 5.0), (1e-7, 4e-3, 2.0)), "G1", Place.G1)


def ask(run, signal, first=0):
    return run(Block(signal, signal, first, GRID))


def lag_of_held_levels(u, delay_s, t):
    """Return the answer of 1/(1 + s TAU_S) to levels u[k] held from k STEP_S on and ``delay_s`` late, closed form."""
    y = np.zeros(t.size)
    for k, change in enumerate(np.diff(u, prepend=0.0)):
        since = np.maximum(t - k * STEP_S - delay_s, 0.0)
        y += change * -np.expm1(-since / TAU_S)
    return y


def late_block(num, den, *delays, fixed_s=0.0):
    own = tuple(Parameter(f"delay{i}", "s", "log") for i in range(len(delays)))
    return LinearBlock(Rational(num, den), "G2", Place.G2, fixed_delay_s=fixed_s, delays=own)


def begun(block, *delays, shape):
    return block.begin((*block.start_values(), *delays), GRID, shape)


@settings(deadline=None, max_examples=60)
@given(st.floats(0.0, 6.0), st.integers(0, 2**32 - 1))
def test_what_follows_a_held_level_is_late_by_any_fraction_of_a_step_exactly(steps, seed):
    u, delay_s = np.random.default_rng(seed).normal(size=40), steps * STEP_S
    run, shape = begun(late_block((1.0,), (TAU_S, 1.0), delay_s), delay_s, shape=Held())
    assert isinstance(shape, Ramp)
    y = ask(run, source_voltage(u, "held", 1))
    assert np.allclose(y, lag_of_held_levels(u, delay_s, STEP_S * np.arange(u.size)), rtol=0, atol=1e-9)


@settings(deadline=None, max_examples=40)
@given(st.floats(0.0, 6.0), st.lists(st.floats(-2.0, 2.0), min_size=3, max_size=3))
def test_what_follows_a_ramp_is_late_by_any_fraction_of_a_step_exactly(steps, zeros):
    """The answer to straight pieces on a grid so fine that every delay is a whole number of its steps."""
    fine, coarse = Grid("a", STEP_S / 64), np.random.default_rng(0).normal(size=40)
    steps = round(64 * steps) / 64
    block = late_block((1e-8 * zeros[0], 1e-4 * zeros[1], 1.0), (3e-8, 2.5e-4, 1.0))
    drawn = np.interp(np.arange(64 * 39 + 1) / 64, np.arange(40), np.concatenate(([0.0], coarse[1:])))
    punctual = run_linear(block.stepper(block.start_values(), fine, Ramp()))(Block(drawn, drawn, 0, fine))
    run, _ = begun(late_block(block.start.num, block.start.den, steps), steps * STEP_S, shape=Ramp())
    at = 64 * np.arange(40) - round(64 * steps)
    expected = np.where(at > 0, punctual[np.maximum(at, 0)], 0.0)
    assert np.allclose(ask(run, np.concatenate(([0.0], coarse[1:]))), expected, rtol=0, atol=1e-9)


@settings(deadline=None, max_examples=40)
@given(st.floats(0.0, 6.0))
def test_a_ramp_behind_a_gain_is_late_by_any_fraction_of_a_step(steps):
    run, shape = begun(late_block((2.0,), (1.0,), steps), steps * STEP_S, shape=Ramp())
    assert isinstance(shape, Ramp)
    assert np.allclose(ask(run, np.arange(40.0)), 2.0 * np.maximum(np.arange(40.0) - steps, 0.0), rtol=0, atol=1e-9)


def test_a_held_level_behind_a_gain_stays_held_and_hands_on_what_it_is_late_by():
    run, shape = begun(late_block((1.0,), (1.0,), 3e-4, fixed_s=2.5e-5), 3e-4, shape=Held())
    assert shape == Held(pytest.approx(0.25))
    assert ask(run, np.arange(1.0, 9.0)).tolist() == [0, 0, 0, 1, 2, 3, 4, 5]


def test_fixed_and_fitted_delays_add_up():
    block = late_block((1.0,), (TAU_S, 1.0), 2e-4, 1e-4, fixed_s=1.25e-4)
    assert [p.name for p in block.parameters()] == ["G2.den.s1", "delay0", "delay1"]
    assert block.delay_s((TAU_S, 2e-4, 1e-4)) == pytest.approx(4.25e-4)
    assert block.late((TAU_S, 2e-4, 1e-4), GRID) == (4, pytest.approx(0.25))


def test_a_whole_number_of_steps_leaves_no_fraction_by_rounding():
    assert late_block((1.0,), (1.0,), fixed_s=3e-4).late((), GRID) == (3, pytest.approx(0.0, abs=1e-8))


@settings(deadline=None, max_examples=40)
@given(st.lists(st.integers(1, 9), min_size=1, max_size=12), st.floats(0.0, 15.0))
def test_a_late_block_does_not_see_how_the_signal_is_cut(sizes, steps):
    signal = np.random.default_rng(0).normal(size=sum(sizes))
    block = late_block((1.0,), (TAU_S, 1.0), fixed_s=steps * STEP_S)
    whole = ask(begun(block, shape=Ramp())[0], signal)
    run, _ = begun(block, shape=Ramp())
    pieces = np.split(signal, np.cumsum(sizes)[:-1])
    assert np.allclose(np.concatenate([ask(run, piece) for piece in pieces]), whole, rtol=0, atol=1e-12)


def test_a_delay_of_years_is_silence():
    """First order leads to such a one now and then; a line that held all of it would take 40 TiB."""
    run, _ = begun(late_block((1.0,), (TAU_S, 1.0), fixed_s=5.5e8), shape=Ramp())
    assert not ask(run, np.ones(100)).any()
    assert not ask(run, np.ones(100), 100).any()


def test_parameters_of_a_linear_block_are_its_coefficients_by_power():
    assert [p.name for p in G1.parameters()] == ["G1.den.s2", "G1.den.s1", "G1.num.s1"]
    assert [p.unit for p in G1.parameters()] == ["s^2", "s^1", "s^1"]
    assert [p.coordinate for p in G1.parameters()] == ["log", "log", "linear"]
    assert G1.start_values() == pytest.approx((5e-8, 2e-3, 4e-4))


@pytest.mark.parametrize(("order", "names"), [
    (1, ["s1"]),
    (2, ["s2", "s1"]),
    (3, ["section1.s2", "section1.s1", "section2.s1"]),
    (4, ["section1.s2", "section1.s1", "section2.s2", "section2.s1"]),
])
def test_a_denominator_is_fitted_in_sections(order, names):
    den = tuple(np.poly([-1.0, -3.0, -10.0, -40.0][:order]))
    block = LinearBlock(Rational((1.0,), den), "G2", Place.G2)
    assert [p.name for p in block.parameters()] == [f"G2.den.{name}" for name in names]
    fitted = block.rational(block.start_values())
    assert np.asarray(fitted.den) * den[-1] == pytest.approx(den, rel=1e-12)


@settings(max_examples=60)
@given(st.lists(st.floats(-5.0, 5.0), min_size=4, max_size=4), st.integers(3, 4))
def test_every_value_of_sections_is_stable(logs, order):
    den = tuple(np.poly([-1.0, -3.0, -10.0, -40.0][:order]))
    block = LinearBlock(Rational((1.0,), den), "G2", Place.G2)
    fitted = block.rational(tuple(np.exp(logs[:order])))
    assert np.all(np.roots(fitted.den).real < 0.0)


def test_a_numerator_is_searched_at_its_own_size():
    slow = LinearBlock(Rational((1.0, 1.0), (1e-5, 1e-2, 1.0)), "G1", Place.G1)
    assert slow.parameters()[-1].scale == pytest.approx(0.3)


def test_a_linear_block_keeps_its_gain_whatever_is_fitted():
    fitted = G1.rational((1e-7, 3e-3, 1e-4))
    assert fitted.dc_gain == pytest.approx(2.5)
    assert fitted.num == pytest.approx((2.5e-4, 2.5))
    assert fitted.den == (1e-7, 3e-3, 1.0)


@settings(max_examples=40)
@given(st.floats(1.0, 1e3), st.floats(0.0, 1e5))
def test_a_fitted_block_at_its_start_has_the_start_s_frequency_response(scale, omega):
    start = Rational((2e-3 * scale, 5.0 * scale), (1e-7 * scale, 4e-3 * scale, 2.0 * scale), 1e-3)
    block = LinearBlock(start, "G1", Place.G1)
    fitted, s = block.rational(block.start_values()), 1j * omega
    response = np.polyval(fitted.num, s) / np.polyval(fitted.den, s)
    assert response == pytest.approx(np.polyval(start.num, s) / np.polyval(start.den, s), rel=1e-9)
    assert fitted.dead_time_s == start.dead_time_s


def test_only_dynamics_make_a_held_signal_continuous():
    gain = LinearBlock(Rational((3.0,), (2.0,)), "G1", Place.G1)
    run, shape = gain.begin((), GRID, Held(0.25))
    assert shape == Held(0.25)
    assert ask(run, np.array([2.0, -4.0])).tolist() == [3.0, -6.0]
    assert isinstance(G1.begin(G1.start_values(), GRID, Held())[1], Ramp)


@pytest.mark.parametrize(
    ("borders", "rest"),
    [((8.0, 1.25, 8.0, -1.25), 0.0), ((8.0, 3.0, 8.0, 1.0), -8.0), ((8.0, -1.0, 8.0, -2.0), 8.0)],
)
def test_play_rests_as_near_to_zero_as_its_borders_allow(borders, rest):
    run, shape = Play(Backlash(*borders)).begin(borders, GRID, Held(0.5))
    assert shape == Held(0.5)
    assert ask(run, np.zeros(3)).tolist() == [rest] * 3


def test_play_remembers_between_blocks():
    play = Play(Backlash(8.0, 1.25, 7.0, -1.0))
    v = np.cumsum(np.random.default_rng(2).normal(size=90))
    whole = ask(play.begin(play.start_values(), GRID, Ramp())[0], v)
    run, _ = play.begin(play.start_values(), GRID, Ramp())
    assert np.array_equal(np.concatenate([ask(run, v[:31]), ask(run, v[31:32]), ask(run, v[32:])]), whole)


def test_scales_of_borders_follow_the_rig_file_and_never_vanish():
    scales = {p.name: p.scale for p in Play(Backlash(8.0, 0.0, 8.0, 0.0)).parameters()}
    assert scales["F.S_L"] == pytest.approx(2.4)
    assert scales["F.D_L"] > 0.0
    assert all(p.scale > 0.0 for p in Gain(LinearF(0.0)).parameters())


def test_gain_is_a_straight_line():
    gain = Gain(LinearF(-2.0, 0.5))
    run, shape = gain.begin(gain.start_values(), GRID, Ramp())
    assert isinstance(shape, Ramp)
    assert ask(run, np.array([0.0, 1.0])).tolist() == [0.5, -1.5]
