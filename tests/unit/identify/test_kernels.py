"""Do the compiled loops do what their equations say, sample by sample?"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.signal import lsim
from scipy.special import wrightomega

from identify import altered_kernels, charging, contact_kernels, diode, kernels, loading
from identify.discretise import Stepper
from identify.following import slewed, slewed_softly
from identify.readings.missing_samples import _gains, _latest
from tests.proof import integrator

QUICK = settings(deadline=None, max_examples=60)
LEVELS = st.floats(-10.0, 10.0, width=32)
SIGNALS = st.lists(LEVELS, min_size=1, max_size=60).map(np.array)
BORDERS = st.tuples(st.floats(0.2, 9.0), st.floats(0.0, 3.0), st.floats(0.2, 9.0), st.floats(-3.0, 0.0))


def play_by_hand(borders, v, level=0.0, keep=1.0, lose=0.0):
    s_l, d_l, s_u, d_u = borders
    w = []
    for value in v:
        level = level * keep - lose
        level = max(level, s_l * (value - d_l))
        level = min(level, s_u * (value - d_u))
        w.append(level)
    return np.array(w)


def play(borders, v, level=0.0):
    out = np.empty(v.size)
    kernels.play(*borders, level, v, out)
    return out


def block_of(order, seed):
    """Return a stable random state-space step as tuples: rows, g0, g1, c, d."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(order, order))
    rows *= 0.9 / np.abs(np.linalg.eigvals(rows)).max()
    g0, g1, c = rng.normal(size=(3, order))
    return tuple(map(tuple, rows)), tuple(g0), tuple(g1), tuple(c), 0.3


@pytest.mark.parametrize("order", [1, 2, 3, 5])
def test_linear_run_in_chunks_of_any_size_is_linear_run_at_once(order):
    block, signal = block_of(order, order), np.random.default_rng(1).normal(size=200)
    four, whole, parts = Stepper(*block).four, np.empty(200), np.empty(200)
    end = kernels.linear(block, four, (0.0,) * order, 0.0, signal, whole)
    state, last, at = (0.0,) * order, 0.0, 0
    for size in (1, 2, 3, 5, 8, 64, 117):
        state, last = kernels.linear(block, four, state, last, signal[at : at + size], parts[at : at + size])
        at += size
    assert at == 200
    assert np.allclose(parts, whole, rtol=1e-12, atol=1e-12)
    assert np.allclose(state, end[0], rtol=1e-12, atol=1e-12)
    assert last == end[1]


def linear_by_hand(block, signal):
    rows, g0, g1, c, d = (np.array(part) for part in block)
    x, last, out = np.zeros(len(g0)), 0.0, []
    for value in signal:
        x = rows @ x + g0 * last + g1 * value
        last = value
        out.append(c @ x + d * value)
    return np.array(out), x


@pytest.mark.parametrize("order", [1, 2, 3, 5])
@pytest.mark.parametrize("count", [1, 3, 4, 200, 203])
def test_linear_is_the_recurrence_written_out(order, count):
    block, signal, out = block_of(order, order), np.random.default_rng(1).normal(size=count), np.empty(count)
    state, last = kernels.linear(block, Stepper(*block).four, (0.0,) * order, 0.0, signal, out)
    expected, x = linear_by_hand(block, signal)
    assert np.allclose(out, expected, rtol=1e-12, atol=1e-12)
    assert np.allclose(state, x, rtol=1e-12, atol=1e-12)
    assert last == signal[-1]


@QUICK
@given(BORDERS, SIGNALS, LEVELS)
def test_play_is_the_operator_written_out(borders, v, level):
    assert np.array_equal(play(borders, v, level), play_by_hand(borders, v, level))


@QUICK
@given(BORDERS, SIGNALS, st.data())
def test_play_does_not_depend_on_how_fast_its_input_comes(borders, v, data):
    """Stretches of any length between the same levels, and resting on them, change nothing (rate independence)."""
    counts = data.draw(st.lists(st.integers(1, 7), min_size=v.size, max_size=v.size))
    levels = np.concatenate([[0.0], v])
    slow = np.concatenate([np.linspace(a, b, n + 1)[1:] for a, b, n in zip(levels[:-1], v, counts, strict=True)])
    slow[np.cumsum(counts) - 1] = v  # linspace may miss its end by a rounding
    assert np.allclose(play(borders, slow)[np.cumsum(counts) - 1], play(borders, v), rtol=0, atol=1e-12)


@QUICK
@given(BORDERS, SIGNALS)
def test_play_stays_between_its_borders_and_holds_inside_them(borders, v):
    s_l, d_l, s_u, d_u = borders
    w = play(borders, v)
    lower, upper = s_l * (v - d_l), s_u * (v - d_u)
    proper = lower <= upper
    assert np.all(w[proper] >= lower[proper])
    assert np.all(w <= upper)
    inside = (w[1:] > lower[1:]) & (w[1:] < upper[1:])
    assert np.array_equal(w[1:][inside], w[:-1][inside])


def held(borders, v, hold):
    s_l, d_l, s_u, d_u = borders
    out = np.empty(v.size)
    state = altered_kernels.held_play(s_l * (v - d_l), s_u * (v - d_u), hold, (0.0, 0.0), out)
    return out, state


@QUICK
@given(BORDERS, SIGNALS, st.floats(0.5, 1.0), st.floats(-0.3, 0.3))
def test_a_held_level_moves_before_the_borders_act(borders, v, keep, lose):
    out, state = held(borders, v, (keep, -lose, 0.0, 0.0, 0.0))
    assert np.array_equal(out, play_by_hand(borders, v, 0.0, keep, lose))
    assert state[0] == out[-1]


def test_a_level_that_is_held_well_is_that_of_play():
    v, borders = 4.0 * np.sin(np.linspace(0.0, 30.0, 500)), (8.0, 1.25, 7.0, -1.0)
    assert np.array_equal(held(borders, v, altered_kernels.STILL)[0], play(borders, v))


def test_a_dielectric_shares_the_charge_that_is_held_and_keeps_none_back():
    """With C_a = C/4 behind R, w falls from 6 to 6 / (1 + 1/4), the time constant being R C_a C / (C + C_a)."""
    v, fraction, step = np.r_[2.0, np.full(400, 1.0)], 0.25, 0.02
    moved = -np.expm1(-(1.0 + fraction) * step) / (1.0 + fraction)
    w, (last, absorbed) = held((6.0, 1.0, 6.0, -1.0), v, (1.0, 0.0, 0.0, fraction * moved, moved))
    q = 0.5 * moved * 6.0  # taken while the border came to 6 V, half a step
    settled = (6.0 + fraction * q) / (1.0 + fraction)
    expected = settled + (6.0 - settled) * np.exp(-(1.0 + fraction) * step * np.arange(401))
    assert np.allclose(w, expected, rtol=0, atol=1e-12)
    assert last == pytest.approx(absorbed, abs=1e-3)


def test_a_level_creeps_between_its_borders_as_its_rate_at_it_says():
    """From 0 V, at 0.1 V an instant there and at none from 4 V on: 4 (1 - exp(-j / 40)); then a border takes it down.
    """
    wide, out = np.full(400, 9.0), np.empty(400)
    upper = np.where(np.arange(400) < 300, 9.0, 1.0)
    altered_kernels.creeping_play(-wide, upper, 0.0, 4.0, np.array([0.1, 0.0]), 0.0, out)
    assert out[:300] == pytest.approx(4.0 * (1.0 - (1.0 - 0.1 / 4.0) ** np.arange(1.0, 301.0)))
    assert np.all(out[300:] == 1.0)
    altered_kernels.creeping_play(-wide, wide, 0.0, 4.0, np.array([0.1, -0.2]), 6.0, out)
    assert out[:3] == pytest.approx([5.8, 5.6, 5.4])  # beyond the last level as at it


def test_a_level_that_leaks_across_the_gap_runs_to_its_middle_and_follows_it():
    """dw/dt = r (s v - w) between the borders, v running at a constant speed: w ends s speed / r behind s v."""
    r, speed, v = 0.05, 0.002, 0.5 + 0.002 * np.arange(600)
    w, _ = held((6.0, 3.0, 6.0, -3.0), v, (np.exp(-r), 0.0, -np.expm1(-r), 0.0, 0.0))
    j = np.arange(600)
    start = w[0] - 6.0 * v[0]
    behind = 6.0 * speed / r
    assert np.allclose(w, 6.0 * v - behind + (start + behind) * np.exp(-r * j), rtol=0, atol=2e-3 * behind)


def low_pass(tau, law, signal):
    """Return what a low-pass with a capacitor of ``law`` C makes of u, when with C alone it makes ``signal`` of it."""
    dt, v, out = 1e-4, 0.0, [0.0]
    slopes = np.diff(signal)
    for j, slope in enumerate(slopes):
        for k in range(round(1.0 / dt)):
            x = signal[j] + slope * (k + 0.5) * dt
            v += dt * (tau * slope + x - v) / (tau * law(v))
        out.append(v)
    return np.array(out)


@pytest.mark.parametrize(("k1", "k2"), [(0.0, 0.05), (0.0, -0.2), (0.12, 0.0), (-0.1, 0.04)])
def test_a_capacitor_that_depends_on_its_voltage_is_the_differential_equation_of_its_charge(k1, k2):
    signal, out, tau = 2.0 * np.sin(np.linspace(0.0, 9.0, 40)), np.empty(40), 3.0
    charging.charged(k1, k2, tau, (0.0, 0.0), signal, out)
    exact = low_pass(tau, lambda v: 1.0 - v * (k1 + v * k2), signal)
    assert np.max(np.abs(exact - signal)) > 0.05
    assert np.allclose(out, exact, rtol=0, atol=4e-3)  # c is straight within a step, the signal's curve is not


def test_a_capacitor_that_would_vanish_keeps_a_tenth_and_its_charge_goes_on_evenly():
    signal, out = np.linspace(0.0, 40.0, 200), np.empty(200)
    charging.charged(0.1, 0.3, 5.0, (0.0, 0.0), signal, out)
    assert np.all(np.diff(out) > 0.0)
    assert np.all(np.isfinite(out))


CUBES = np.array([[-1.0, 3.0, -3.0, 1.0], [0.0, 0.0, 0.0, 1.0], [1.0, 3.0, 0.0, 0.0]])  # s^3 from -1 to 1 V


@pytest.mark.parametrize(("share", "tau"), [(0.7, 12.0), (60.0, 12.0), (-0.4, 30.0)])
def test_a_current_over_the_level_is_the_differential_equation_of_the_filter_it_loads(share: float, tau: float) -> None:
    """A varistor across the capacitor of a low-pass that is driven by a sine: the level is what Kirchhoff leaves it."""
    at, rate = np.arange(400.0), 0.05
    turned = 1.0 + (rate * tau) ** 2
    whole = (np.sin(rate * at) - rate * tau * (np.cos(rate * at) - np.exp(-at / tau))) / turned  # without the varistor
    out = np.empty(at.size)
    loading.loaded(-1.0, 1.0, share * CUBES, tau, (0.0, 0.0), whole, out)

    def slope(t, s):
        return (np.sin(rate * t) - s - share * s**3) / tau

    exact = solve_ivp(slope, (0.0, at[-1]), [0.0], t_eval=at, rtol=1e-10, atol=1e-12).y[0]
    assert np.max(np.abs(exact - whole)) > 0.05
    assert np.max(np.abs(out - exact)) < 2e-3 * np.max(np.abs(exact - whole))


def test_beyond_its_last_knots_a_current_stays_as_it_is_there():
    out = np.empty(2000)
    loading.loaded(-1.0, 1.0, 0.5 * CUBES, 20.0, (0.0, 0.0), np.full(2000, -5.0), out)
    assert out[-1] == pytest.approx(-4.5)  # else -5 V would be left with 0.5 s^3 = -5 - s, at -1.8 V


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_no_number_is_looked_up_beyond_the_levels_that_are_there(wrong):
    """A search may lead to none, and a place in memory that is not the table's must not be read for it."""
    signal, out = np.array([0.0, wrong, 1.0]), np.empty(3)
    loading.loaded(-1.0, 1.0, 0.5 * CUBES, 20.0, (0.0, 0.0), signal, out)
    assert out[0] == 0.0
    assert loading.current(-1.0, 1.0, CUBES, wrong) == ((1.0 if wrong > 0.0 else -1.0), 0.0)
    altered_kernels.creeping_play(np.full(3, -9.0), np.full(3, 9.0), 0.0, 4.0, np.array([0.1, wrong]), 2.0, out)
    altered_kernels.creeping_play(np.full(3, -9.0), np.full(3, 9.0), 0.0, 4.0, np.array([0.1, 0.3]), wrong, out)
    assert np.all((np.abs(out) <= 9.0) | np.isnan(out))


def test_what_goes_on_after_impact_goes_with_how_fast_contact_was_made():
    v, step_s = 3.0 * np.sin(np.linspace(0.0, 30.0, 900)), 1e-3
    knots, after = np.array([2e-3, 5e-3, 0.05]), np.array([0.3, -0.1, 0.02])
    since, w = np.empty(v.size), np.empty(v.size)
    contact_kernels.timed_play(4.0 * (v - 1.0), 5.0 * (v + 1.0), (0.0, -1, 0.0), since, w)
    met = np.flatnonzero(np.abs(since) == 1.0)
    assert met.size > 6
    speed = np.where(since > 0.0, 4.0, 5.0) * np.abs(np.diff(v, prepend=v[0])) / step_s
    latest = np.array([speed[met[met <= j][-1]] if np.any(met <= j) else 0.0 for j in range(v.size)])
    expected = np.sign(since) * latest * np.interp((np.abs(since) - 1.0) * step_s, knots, after)
    out, state = np.zeros(v.size), (v[0], 0.0)
    for at in (slice(0, 333), slice(333, 900)):  # as blocks come
        state = contact_kernels.struck(since[at], v[at], (4.0, 5.0), step_s, knots, after, state, out[at])
    assert np.allclose(out, expected, rtol=1e-12, atol=1e-9)
    assert np.abs(out).max() > 1.0
    assert state == (v[-1], latest[-1])


def test_eight_capacitors_abreast_each_do_what_they_do_alone():
    t = np.arange(600.0)
    signals = np.array([3.0 * np.sin(t / (9.0 + 5.0 * i)) for i in range(8)])
    signals[5, 100] = np.nan  # which is its own affair
    laws = [(0.02 * i, 0.01 * (i - 2), 2.0 + 7.0 * i) for i in range(8)]
    laws[7] = (0.0, 0.2, 4.0)  # beyond its law's end
    found, alone, state = signals.copy(), np.empty((8, t.size)), np.zeros((2, 8))
    capacitors = np.array([charging.constants(*law) for law in laws]).T.copy()
    for at in (slice(0, 320), slice(320, 600)):  # as blocks come
        part = found[:, at].copy()
        charging.charged_abreast(capacitors, state, part)
        found[:, at] = part
    ends = [charging.charged(*law, (0.0, 0.0), s, out) for law, s, out in zip(laws, signals, alone, strict=True)]
    assert np.abs(alone - signals)[4:5].max() > 0.05
    assert np.isnan(found[5, 100:]).all()
    assert np.allclose(found, alone, rtol=0.0, atol=1e-12, equal_nan=True)
    assert np.allclose(state.T, ends, rtol=0.0, atol=1e-12, equal_nan=True)


@QUICK
@given(SIGNALS, st.floats(0.01, 5.0))
def test_a_slewed_signal_follows_as_fast_as_it_may(signal, most):
    out = np.empty(signal.size)
    assert slewed(most, 0.0, signal, out) == out[-1]
    level = 0.0
    for value, followed in zip(signal, out, strict=True):
        level = level + np.clip(value - level, -most, most)
        assert followed == level


def test_plain_chain_is_its_three_stages_one_after_the_other():
    one, two, borders = block_of(2, 5), block_of(3, 6), (8.0, 1.25, 7.0, -1.0)
    u, out = np.random.default_rng(7).normal(0.0, 2.0, 300), np.empty(300)
    kernels.plain_chain(*one, (0.0,) * 2, *borders, 0.0, *two, (0.0,) * 3, 0.0, u, out)
    w = play_by_hand(borders, linear_by_hand(one, u)[0])
    assert np.ptp(w) > 1.0
    assert np.allclose(out, linear_by_hand(two, w)[0], rtol=1e-12, atol=1e-10)


def test_waveform_is_a_sum_of_sines_without_drift_of_its_phasor():
    out, j = np.full(100_000, 2.0), np.arange(100_000)
    kernels.waveform(0.4, 0.0123, np.array([1, 3, 5]), np.array([0.3, 0.0, 0.1]), np.array([0.0, 1.0, -2.0]), out)
    turn = 0.4 + 0.0123 * j
    assert np.allclose(out, 2.0 + 0.3 * np.sin(turn) + 0.1 * np.sin(5.0 * turn - 2.0), rtol=0, atol=1e-11)


@pytest.mark.parametrize("knee", [0.3, 5.0, 22.0, 1000.0])
@pytest.mark.parametrize(("forward", "backward"), [(True, False), (False, True), (True, True)])
def test_a_clamp_solves_the_equation_of_its_diodes(knee, forward, backward):
    v = np.concatenate((np.linspace(-40.0, 60.0, 1001), (-3000.0, 3000.0, 0.0)))
    x = np.empty(v.size)
    diode.clamped(knee, forward, backward, v, x)
    on = np.exp(x - knee) - np.exp(-knee) if forward else 0.0
    off = np.exp(-x - knee) - np.exp(-knee) if backward else 0.0
    left = x + on - off - v
    assert np.abs(left / (1.0 + np.abs(v))).max() < 1e-11
    assert np.all(np.diff(x[:1001]) > 0.0)


@pytest.mark.parametrize("knee", [0.3, 5.0, 22.0])
@pytest.mark.parametrize(("forward", "backward"), [(True, False), (False, True), (True, True)])
def test_many_samples_are_read_between_those_that_are_solved(knee, forward, backward):
    v = np.random.default_rng(4).uniform(-40.0, 60.0, 20_000)
    v[:2] = -40.0, 60.0
    many, alone, one = np.empty(v.size), np.empty(v.size), np.empty(1)
    diode.clamped(knee, forward, backward, v, many)
    for j in range(v.size):
        diode.clamped(knee, forward, backward, v[j : j + 1], one)
        alone[j] = one[0]
    assert np.abs(many - alone).max() < 1e-13


@given(st.floats(-50.0, 800.0))
@settings(deadline=None, max_examples=300)
def test_omega_is_wrights(z):
    assert diode.omega(z) == pytest.approx(float(wrightomega(z)), rel=1e-13)


@pytest.mark.parametrize(("level", "slope"), [(0.5, 0.0), (3.0, 0.4), (60.0, 0.9)])
def test_a_softened_line_is_bent_by_the_integral_of_a_logistic_curve(level, slope):
    w = np.linspace(-80.0, 90.0, 341)
    out = np.empty(w.size)
    diode.softened(level, slope, w, out)
    assert np.allclose(out, w - (1.0 - slope) * (np.logaddexp(0.0, w - level) - np.logaddexp(0.0, -level)), atol=1e-13)
    diode.softened(level, slope, np.zeros(1), out)
    assert out[0] == 0.0


@pytest.mark.parametrize("step", [1.0, 1.0003, 0.97])
def test_readings_between_instants_lie_on_the_cubic_of_the_four_around(step):
    law = np.polynomial.Polynomial([0.3, -0.2, 0.05, 0.01])
    known, out = law(np.arange(-1.0, 39.0)), np.empty(37)
    kernels.drawn(known, 1.2, step, out)
    assert np.allclose(out, law(0.2 + step * np.arange(37)), rtol=1e-12, atol=1e-12)
    bent = np.where(np.arange(40) < 20, 0.0, 1.0)  # the four around are asked, and no others
    kernels.drawn(bent, 0.5, 1.0, out)
    assert np.count_nonzero((out != 0.0) & (np.abs(out - 1.0) > 1e-12)) == 3


def test_loops_are_for_compiled_code():
    with pytest.raises(NotImplementedError, match="compiled code only"):
        kernels.dot((1.0,), (1.0,))
    with pytest.raises(NotImplementedError, match="compiled code only"):
        kernels.advance(((1.0,),), (1.0,), (1.0,), (1.0,), 1.0, 1.0)


@pytest.mark.parametrize("lag", [0.02, 0.5, 5.0, 60.0])
@pytest.mark.parametrize("size", [1e-4, 1.0, 40.0])  # near: a lag; far: the rate alone
def test_a_soft_slew_limit_solves_its_equation_within_every_step(lag, size):
    signal, most = size * np.random.default_rng(2).normal(size=12), 1.0
    out, before, level = np.empty(signal.size), 0.0, 0.0
    assert slewed_softly(most, lag, 0.0, 0.0, signal, out) == out[-1]
    share = 1.0 / -np.expm1(-1.0 / lag) - lag
    for value, got in zip(signal, out, strict=True):
        there, before = before + share * (value - before), value
        law = lambda _, w, aim=there: most * np.tanh((aim - w) / (most * lag))  # noqa: E731
        level = float(solve_ivp(law, (0.0, 1.0), [level], method="Radau", rtol=1e-10, atol=1e-14 * size).y[0, -1])
        assert got == pytest.approx(level, rel=1e-7, abs=1e-8 * size)


@pytest.mark.parametrize("lag", [0.05, 0.25, 1.0, 20.0])
def test_a_soft_slew_limit_follows_what_is_near_as_a_pole_follows_straight_lines(lag):
    signal = 1e-6 * np.cumsum(np.random.default_rng(3).normal(size=40))
    out = np.empty(signal.size)
    slewed_softly(1.0, lag, 0.0, 0.0, signal, out)
    line = np.concatenate(([0.0], signal))
    _, exact, _ = lsim(([1.0], [lag, 1.0]), line, np.arange(line.size, dtype=float))
    assert np.allclose(out, exact[1:], rtol=0.0, atol=1e-11)


@pytest.mark.parametrize("lag", [0.2, 3.0, 25.0])
def test_a_contact_that_gives_way_follows_its_border_through_a_lag(lag):
    fine = 400
    v = 3.0 * np.sin(np.linspace(0.0, 14.0, 300)) + np.sin(np.linspace(0.0, 45.0, 300))
    nodes = np.interp(np.arange((v.size - 1) * fine + 1) / fine, np.arange(v.size), v)
    expected = integrator.giving_play(2.0 * (nodes - 0.7), 1.5 * (nodes + 0.9), 1.0 / (lag * fine))[::fine]
    lower, upper = 2.0 * (v - 0.7), 1.5 * (v + 0.9)
    out, state = np.empty(v.size), (lower[0], upper[0], 0.0)
    for part in np.array_split(np.arange(v.size), 3):
        state = contact_kernels.giving_play(lower[part], upper[part], 1.0 / lag, state, out[part[0] : part[-1] + 1])
    assert np.abs(out - expected).max() < 1e-3 * np.ptp(expected)
    assert np.abs(play((2.0, 0.7, 1.5, -0.9), v) - expected).max() > 0.01 * np.ptp(expected)


@pytest.mark.parametrize("kick", [0.0, 0.3, 40.0])
def test_a_contact_that_opens_kicks_by_what_hangs_on_the_level_there(kick):
    v = 3.0 * np.sin(np.linspace(0.0, 14.0, 300)) + np.sin(np.linspace(0.0, 45.0, 300))
    lower, upper, levels = 2.0 * (v - 0.7), 2.0 * (v + 0.9), np.array([-5.0, 5.0])
    out, state = np.empty(v.size), (0.0, -1)
    for part in np.array_split(np.arange(v.size), 3):
        span = slice(part[0], part[-1] + 1)
        state = contact_kernels.kicking_play(lower[span], upper[span], levels, np.full((2, 2), kick), state, out[span])
    assert np.allclose(out, integrator.kicking_play(lower, upper, kick), rtol=0.0, atol=1e-12)
    tilted = np.empty(v.size)
    kicks = np.array([[0.0, 0.2], [0.0, 0.0]])  # at the lower border alone, none at the lowest level
    contact_kernels.kicking_play(lower, upper, levels, kicks, (0.0, -1), tilted)
    plain = play((2.0, 0.7, 2.0, -0.9), v)
    opens = np.flatnonzero((plain[:-1] == lower[:-1]) & (plain[1:] > lower[1:])) + 1
    assert opens.size > 1
    assert np.allclose(tilted[opens] - plain[opens], np.interp(plain[opens], levels, kicks[0]), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(("volts", "steps"), [(0.02, 1.0), (0.3, 1.0), (0.3, 0.01)])
@pytest.mark.parametrize("leak", [0.0, 1e-3])
def test_a_contact_through_a_diode_solves_the_equation_of_its_currents(volts, steps, leak):
    v = 3.0 * np.sin(np.linspace(0.0, 14.0, 300)) + np.sin(np.linspace(0.0, 45.0, 300))
    lower, upper = 2.0 * (v - 0.7), 2.0 * (v + 0.9)
    out, state, at = np.empty(v.size), (0.0, 0.0, np.nan, np.nan), np.arange(v.size)
    hold = (np.exp(-leak), 0.0, 0.0, 0.0, 0.0)
    for part in np.array_split(at, 3):
        here = out[part[0] : part[-1] + 1]
        state = altered_kernels.conducting_play(lower[part], upper[part], (volts, volts), steps, hold, state, here)

    def law(t, w):
        pushed, pulled = (np.interp(t, at, border) for border in (lower, upper))
        return volts * steps * (np.exp((pushed - w) / volts) - np.exp((w - pulled) / volts)) - leak * w

    solved = solve_ivp(law, (0.0, at[-1]), [0.0], "LSODA", t_eval=at[1:], rtol=1e-8, atol=1e-10, max_step=0.25)
    assert np.abs(out[1:] - solved.y[0]).max() < 1e-3 * np.ptp(out)
    assert np.abs(play((2.0, 0.7, 2.0, -0.9), v) - out).max() > volts


@given(st.integers(4, 40), st.integers(1, 12), st.integers(0, 99))
@QUICK
def test_the_best_cut_is_the_one_that_lowers_the_sum_of_squares_most(size, longest, seed):
    rng = np.random.default_rng(seed)
    y, answer, use = rng.normal(size=size), rng.normal(size=size), rng.random(size) < 0.7
    gains = np.zeros(longest)
    kernels.best_cuts(y, answer, use, gains)
    for count in range(1, longest + 1):
        k = np.flatnonzero(use[: max(size - count, 0)])
        falls = np.square(y[k] - answer[k]) - np.square(y[k] - answer[k + count])
        sums = np.cumsum(falls[::-1])[::-1]
        best = float(np.max(sums, initial=0.0))
        assert gains[count - 1] == pytest.approx(best, abs=1e-9)
        if best > 0.0:
            assert _latest(_gains(y, answer, use, count)) == k[int(np.argmax(sums))]


def test_what_comes_sooner_or_later_goes_on_straight_and_was_straight_between() -> None:
    """Against numpy's interpolation of the past, and the last slope for what is ahead; 40 steps ago none is known."""
    rng, past = np.random.default_rng(6), 30
    known = rng.standard_normal(1030).cumsum()
    steps = np.concatenate([[-40.0, -np.inf, np.nan], rng.uniform(-29.0, 5.0, 995), [0.0, -1e-18]])
    out = np.full(steps.size, 7.0)
    kernels.led(known, past, steps, out)
    here, slope = np.arange(past, known.size), known[past:] - known[past - 1 : -1]
    was = np.interp(here + np.minimum(steps, 0.0), np.arange(known.size), known)
    expected = was + np.maximum(steps, 0.0) * slope
    assert out == pytest.approx(expected, abs=1e-12, nan_ok=True)
    assert out[[0, 1, -2, -1]].tolist() == [*known[[0, 0]], *known[-2:]]


def test_a_value_has_the_jump_and_the_bend_of_every_corner_it_is_beyond() -> None:
    signal, out = np.array([-3.0, -1.0, 0.0, 2.0, 2.5, np.nan]), np.empty(6)
    corners, sides, jumps, bends = np.array([2.0, -1.0]), np.array([1.0, -1.0]), np.array([10.0, 4.0]), np.ones(2)
    kernels.plus_corners(corners, sides, jumps, bends, signal, out)
    assert out[:-1].tolist() == [-3.0 + 4.0 - 2.0, -1.0, 0.0, 2.0, 2.5 + 10.0 + 0.5]
    assert np.isnan(out[-1])
