"""Does the fit find what an independent integrator was given, and does it know how sure it is?"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import minimize
from scipy.stats import binom, chi2

from identify import chain as chain_module
from identify.chain import as_promised, local_name, plain_chain, simulate
from identify.coordinate import Coordinate, coordinates_of
from identify.derivatives.sensitivities import sensitivities
from identify.effects import catalogue, chain_of
from identify.fit import _Problem, chi_squared, fit, total_chi_squared
from identify.model import Backlash, LinearF, Model, Physics, Rational
from identify.quadratic import boxed_step, inverse
from identify.stage import Parameter, Place, is_fixed
from identify.starts.search import on_bound
from identify.trace import Trace
from tests.proof.cases import Concealed
from tests.proof.rigs import ONE_SLOPE, OP_AMP, RC, SKEWED, toleranced
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, noisy, observed, recorded

NOISE_V = 0.01
STAIRS = staircase("stairs", FIG13_LEVELS_V[::2], 0.015)
SINE = sine("sine", 25.0, 6.0, 4, 1)
TRUE_RC = plain_chain(model_of(RC)).values


@pytest.fixture(scope="module")
def rc():
    """Return the two runs of the RC rig without noise."""
    return [recorded(RC, stimulus) for stimulus in (STAIRS, SINE)]


def observations(traces, noise_v=NOISE_V, seed=0):
    return [observed(noisy(trace, noise_v, [seed, i]), noise_v) for i, trace in enumerate(traces)]


@pytest.fixture(scope="module")
def found(rc):
    return fit(plain_chain(model_of(toleranced(RC, 5, 0.2))), observations(rc))


def test_a_search_ends_where_three_steps_gain_less_than_is_asked_for(rc, monkeypatch):
    chain, seen = plain_chain(model_of(toleranced(RC, 5, 0.6))), observations(rc)
    slopes, normal = [], _Problem.normal
    monkeypatch.setattr(_Problem, "normal", lambda problem, theta: slopes.append(theta) or normal(problem, theta))
    whole, looks = fit(chain, seen), len(slopes)
    slopes.clear()
    short = fit(chain, seen, enough=1e12)
    assert looks > len(slopes) == 4  # where it began, and after each of three steps
    assert short.converged
    assert short.cost > whole.cost


def test_a_search_that_begins_near_its_end_stops_after_a_step_that_promises_little(rc, found, monkeypatch):
    seen, slopes, normal = observations(rc), [], _Problem.normal
    monkeypatch.setattr(_Problem, "normal", lambda problem, theta: slopes.append(theta) or normal(problem, theta))
    moved = found.chain.with_values({"G1.den.s1": found.chain.values["G1.den.s1"] + 0.03 * found.sd("G1.den.s1")})
    assert 0.01 < total_chi_squared(moved, seen) - total_chi_squared(found.chain, seen) < 0.3
    centre = plain_chain(model_of(toleranced(RC, 5, 0.2))).values
    near = fit(moved, seen, centre, enough=0.3, near=True)
    assert len(slopes) == 1
    assert near.converged
    assert near.cost == pytest.approx(found.cost, abs=0.01)
    assert near.beyond < 0.01
    slopes.clear()
    far = fit(plain_chain(model_of(toleranced(RC, 5, 0.2))), seen, centre, enough=0.3, near=True)
    assert len(slopes) > 2  # a step that promises much is not the last
    assert far.cost == pytest.approx(found.cost, abs=0.01)


@pytest.mark.parametrize("rig", [OP_AMP, SKEWED, RC], ids=lambda rig: rig.name)
def test_parts_off_by_a_fifth_are_found_again(rig):
    seen = observations([recorded(rig, stimulus) for stimulus in (STAIRS, SINE)])
    found = fit(plain_chain(model_of(toleranced(rig, 5, 0.2))), seen)
    truth = plain_chain(model_of(rig)).values
    assert (found.converged, found.sentence) == (True, "converged")
    for name in ("G1.den.s1", "F.S_L", "F.D_L", "F.S_U", "F.D_U", "G2.den.s1"):
        assert abs(found.chain.values[name] - truth[name]) < 4.0 * found.sd(name)
        assert found.sd(name) < 0.01 * abs(truth[name])
    count = sum(o.count for o in seen)
    assert abs(found.cost - count) < 4.0 * np.sqrt(2.0 * count)


def test_95_per_cent_intervals_cover_the_truth_95_times_in_a_hundred(rc):
    """A Monte Carlo over the noise; a right interval fails this in one of a thousand choices of the seeds."""
    trials = 120
    fits = [fit(plain_chain(model_of(RC)), observations(rc, seed=seed)) for seed in range(trials)]
    names = [c.name for c in fits[0].coordinates]
    assert len(names) == 6
    least = binom.ppf(1e-3 / len(names), trials, 0.95)
    for name in names:
        ends = [f.ci95(name) for f in fits]
        assert sum(low <= TRUE_RC[name] <= high for low, high in ends) >= least
        z = np.array([(f.chain.values[name] - TRUE_RC[name]) / f.sd(name) for f in fits])
        assert chi2.ppf(1e-4, trials) < z @ z < chi2.ppf(1.0 - 1e-4, trials)


def test_interval_is_196_standard_deviations_either_side(found):
    low, high = found.ci95("F.D_L")
    assert high - low == pytest.approx(2 * 1.96 * found.sd("F.D_L"))
    assert 0.5 * (low + high) == pytest.approx(found.chain.values["F.D_L"])
    wide = found.ci95("F.D_L", inflation=3.0)
    assert wide[1] - wide[0] == pytest.approx(3.0 * (high - low))


def test_interval_of_a_log_parameter_is_even_in_the_logarithm(found):
    low, high = found.ci95("G1.den.s1", inflation=100.0)
    value = found.chain.values["G1.den.s1"]
    assert low > 0.0
    assert high / value == pytest.approx(value / low)


def test_four_times_the_data_halves_the_standard_deviation(rc):
    one = fit(plain_chain(model_of(RC)), observations(rc))
    four = fit(plain_chain(model_of(RC)), [o for seed in range(4) for o in observations(rc, seed=seed)])
    for name in ("F.S_L", "F.D_L", "G2.den.s1"):
        assert four.sd(name) == pytest.approx(0.5 * one.sd(name), rel=0.02)


def test_fixed_parameters_stay_and_have_no_width(rc):
    start = plain_chain(model_of(toleranced(RC, 5, 0.2)))
    found = fit(start, observations(rc), fixed=("G1", "F.D_L"))
    for name in ("G1.den.s1", "F.D_L"):
        value = start.values[name]
        assert found.chain.values[name] == value
        assert (found.sd(name), found.ci95(name)) == (0.0, (value, value))
    assert found.chain.values["F.D_U"] != start.values["F.D_U"]


def test_nothing_to_search_is_a_fit_too(rc):
    found = fit(plain_chain(model_of(RC)), observations(rc), fixed=("G1", "F", "G2"))
    assert found.converged
    assert found.theta.size == 0
    assert found.cost == pytest.approx(sum(chi_squared(found.chain, o) for o in observations(rc)))


def test_an_owner_fixes_its_own_parameters_only():
    assert is_fixed("G1.den.s1", ["G1"])
    assert is_fixed("G1.den.s1", ["G1.den.s1"])
    assert not is_fixed("G1.den.s1", ["G", "G1.den.s", "F"])
    assert not is_fixed("G10.den.s1", ["G1"])


@pytest.mark.parametrize(
    ("piece", "name"),
    [
        (Physics("saturation", {"upper": 5.0}), "saturation.lower"),
        (Physics("dead_time", {"delay": 0.0}), "dead_time.delay"),
        (Physics("extra_pole", {"tau": 0.0}), "extra_pole.tau"),
    ],
)
def test_what_is_absent_stays_absent(rc, piece, name):
    start = chain_of(model_of(RC, (piece,)))
    found = fit(start, observations(rc), fixed=("saturation.upper",))
    assert found.chain.values[name] == start.values[name]
    assert name not in [c.name for c in found.coordinates]


def test_what_the_data_say_nothing_about_stays_at_its_centre_with_the_prior_s_width(rc):
    """A rail at 500 V is never met."""
    found = fit(chain_of(model_of(RC, (Physics("saturation", {"upper": 500.0}, form="upper"),))), observations(rc))
    i = [c.name for c in found.coordinates].index("saturation.upper")
    assert found.converged
    assert found.chain.values["saturation.upper"] == 500.0
    assert np.sqrt(found.covariance[i, i]) == pytest.approx(found.coordinates[i].prior_sd)


@pytest.mark.parametrize("noise_v", [1e-4, 1e-6])
def test_a_low_noise_does_not_make_the_unknown_certain(rc, noise_v):
    """Beside curvatures of 1e14 the prior's own must not be lost."""
    chain = chain_of(model_of(RC, (Physics("saturation", {"upper": 500.0}, form="upper"),)))
    found = fit(chain, observations(rc, noise_v), iterations=3)
    i = [c.name for c in found.coordinates].index("saturation.upper")
    assert np.sqrt(found.covariance[i, i]) == pytest.approx(found.coordinates[i].prior_sd)


def test_two_parameters_that_do_the_same_are_both_uncertain():
    """A gain before and a gain behind a linear F: only their product is told, however low the noise is."""
    matrix = 1e18 * np.array([[1.0, 1.0], [1.0, 1.0]]) + np.diag([0.01, 0.01])
    step = boxed_step(matrix, np.array([1e18, 1e18]), np.full(2, -3.0), np.full(2, 3.0))
    assert step.sum() == pytest.approx(1.0, rel=1e-6)
    assert np.all(np.sqrt(np.diag(inverse(matrix))) > 1e-3)


def test_the_prior_sits_at_the_centre_and_not_at_the_start(rc):
    """A dead sine tells nothing of F: D_L goes back to the centre."""
    still = [observed(Trace("still", 1e4, np.zeros(200), np.zeros(200)), NOISE_V)]
    start = plain_chain(model_of(RC)).with_values({"F.D_L": 1.4})
    found = fit(start, still, centre=plain_chain(model_of(RC)).values)
    assert found.chain.values["F.D_L"] == pytest.approx(1.25, abs=1e-6)


def test_a_coefficient_of_a_block_stays_within_its_factor(rc):
    start = plain_chain(model_of(RC)).with_values({"G2.den.s1": 2e-3 / 10.0})
    found = fit(start, observations(rc), fixed=("G1", "F"))
    assert found.chain.values["G2.den.s1"] == pytest.approx(3.0 * 2e-4)


def test_every_run_has_its_own_phase_of_the_mains():
    true = {"frequency": 50.0, "amplitude": 0.2, "third": 0.0, "fifth": 0.0}
    hum = (Concealed("hum at sense", true),)
    traces = [recorded(RC, STAIRS, hum, start_s=0.0), recorded(RC, SINE, hum, start_s=1.234)]
    start = chain_of(model_of(RC, (Physics("hum", {"frequency": 50.0, "amplitude": 0.1}),)))
    fixed = ("hum.frequency", "hum.third", "hum.fifth", "hum.third_phase", "hum.fifth_phase")
    found = fit(start, observations(traces), fixed=fixed)
    phases = [found.chain.values[local_name("hum.phase", name)] for name in ("stairs", "sine")]
    expected = 2.0 * np.pi * 50.0 * 1.234
    turn = np.exp(1j * (phases[1] - phases[0] - expected))
    sign = np.sign(found.chain.values["hum.amplitude"])
    assert sign * found.chain.values["hum.amplitude"] == pytest.approx(0.2, abs=4.0 * found.sd("hum.amplitude"))
    assert abs(turn - 1.0) < 0.02


def test_a_chain_that_cannot_be_simulated_says_so(rc):
    found = fit(plain_chain(model_of(RC)).with_values({"G1.den.s1": -1e-6}), observations(rc))
    assert not found.converged
    assert found.sentence == "the model cannot be simulated at its starting values"
    assert found.cost == np.inf


def test_too_few_iterations_are_admitted(rc):
    found = fit(plain_chain(model_of(toleranced(RC, 5, 0.2))), observations(rc), iterations=1)
    assert (found.converged, found.sentence) == (False, "no minimum within 1 iterations")


def test_a_linear_rig_is_fitted_too():
    model = Model("linear", Rational((1.0,), (1e-3, 1.0)), LinearF(3.0, 0.1), Rational((1.0,), (1.0,)))
    t = 1e-4 * np.arange(400)
    trace = Trace("step", 1e4, np.ones(400), 0.1 + 3.0 * -np.expm1(-t / 1e-3))
    start = plain_chain(model).with_values({"G1.den.s1": 2e-3, "F.gain": 2.0, "F.offset": 0.0})
    found = fit(start, observations([trace]))
    for name, true in {"G1.den.s1": 1e-3, "F.gain": 3.0, "F.offset": 0.1}.items():
        assert abs(found.chain.values[name] - true) < 4.0 * found.sd(name)


def test_samples_that_do_not_count_do_not_count(rc):
    spoiled = observations(rc)[0]
    y = spoiled.trace.y.copy()
    y[500:700] = 1e3
    use = np.ones(y.size, dtype=bool)
    use[500:700] = False
    trace = Trace("stairs", 1e4, spoiled.trace.u, y)
    found = fit(plain_chain(model_of(RC)), [type(spoiled)(trace, use, NOISE_V, 2)])
    assert abs(found.chain.values["F.D_L"] - 1.25) < 4.0 * found.sd("F.D_L")


def test_cutting_a_run_into_chunks_changes_neither_cost_nor_fit(rc, monkeypatch):
    start, seen = plain_chain(model_of(toleranced(RC, 5, 0.2))), observations(rc)
    whole = fit(start, seen)
    residual = seen[0].residual(start) / NOISE_V
    monkeypatch.setattr(chain_module, "CHUNK", 500)
    assert chi_squared(start, seen[0]) == pytest.approx(residual @ residual, rel=1e-9)
    cut = fit(start, seen)
    assert cut.cost == pytest.approx(whole.cost, rel=1e-6)
    assert cut.sd("F.D_L") == pytest.approx(whole.sd("F.D_L"), rel=1e-3)


def test_chi_squared_is_infinite_where_the_chain_cannot_be(rc):
    improper = Model("m", Rational((1.0, 1.0), (1.0,)), Backlash(1.0, 1.0, 1.0, -1.0), Rational((1.0,), (1.0,)))
    chain = plain_chain(improper)
    assert chi_squared(chain, observations(rc)[0]) == np.inf


COORDINATES = st.one_of(
    st.builds(lambda c: Coordinate("a", Parameter("a", "s", "log"), c), st.floats(1e-6, 1e6)),
    st.builds(lambda c: Coordinate("a", Parameter("a", "s", "log"), -c), st.floats(1e-6, 1e6)),
    st.builds(lambda c, s: Coordinate("a", Parameter("a", "V", scale=s), c), st.floats(-9.0, 9.0), st.floats(0.1, 9.0)),
)


@settings(max_examples=60)
@given(COORDINATES, st.floats(-5.0, 5.0))
def test_a_coordinate_and_its_value_are_one(coordinate, theta):
    value = coordinate.value(theta)
    assert coordinate.theta(value) == pytest.approx(theta, abs=1e-6)
    slope = (coordinate.value(theta + 1e-6) - coordinate.value(theta - 1e-6)) / 2e-6
    assert coordinate.slope(theta) == pytest.approx(slope, rel=1e-4)
    assert coordinate.value(0.0) == coordinate.centre
    assert value * coordinate.centre > 0.0 or coordinate.parameter.coordinate == "linear"


def test_coordinates_of_local_parameters_come_once_a_run():
    chain = chain_of(model_of(RC, (Physics("hum", {"amplitude": 0.1}),)))
    names = [c.name for c in coordinates_of(chain, chain.values, ["a", "b"], fixed=("G1", "F", "G2"))]
    assert names[:4] == ["hum.frequency", "hum.amplitude", "hum.third", "hum.fifth"]
    assert {"hum.phase[a]", "hum.phase[b]"} < set(names)
    assert "hum.phase" not in names


def problem(seed, size):
    """Return a positive definite matrix, spread over decades, and a right side."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(size + 3, size)) * 10.0 ** rng.uniform(-2.0, 2.0, size)
    return rows.T @ rows, rows.T @ rng.normal(size=size + 3)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(1, 6), st.floats(1e-3, 10.0))
def test_a_boxed_step_satisfies_the_conditions_of_a_minimum(seed, size, radius):
    matrix, right = problem(seed, size)
    low, high = np.full(size, -radius), np.full(size, 0.5 * radius)
    step = boxed_step(matrix, right, low, high)
    assert np.all(step >= low)
    assert np.all(step <= high)
    downhill = (right - matrix @ step) / np.sqrt(np.diag(matrix))
    tolerance = 1e-7 * np.linalg.norm(right / np.sqrt(np.diag(matrix)))
    edge = 1e-12 * radius  # the scaling of the box may miss a bound by a rounding
    assert np.all(downhill[step < high - edge] < tolerance)
    assert np.all(downhill[step > low + edge] > -tolerance)


def test_a_boxed_step_that_has_room_solves_the_normal_equations():
    matrix, right = problem(4, 5)
    free = np.linalg.solve(matrix, right)
    assert np.allclose(boxed_step(matrix, right, np.full(5, -1e9), np.full(5, 1e9)), free, rtol=1e-6)


def test_a_boxed_step_is_what_a_general_minimiser_finds():
    matrix, right = problem(7, 4)
    low, high = -0.3 * np.ones(4), 0.2 * np.ones(4)
    scale = 1.0 / np.sqrt(np.diag(matrix))
    scaled, pull = matrix * np.outer(scale, scale), right * scale
    found = minimize(
        lambda x: 0.5 * x @ scaled @ x - pull @ x, np.zeros(4), jac=lambda x: scaled @ x - pull,
        bounds=list(zip(low / scale, high / scale, strict=True)), method="L-BFGS-B",
        options={"ftol": 1e-15, "gtol": 1e-12},
    )  # fmt: skip
    assert np.allclose(boxed_step(matrix, right, low, high), found.x * scale, rtol=0, atol=1e-5)


def test_a_value_searched_in_its_log_moves_straight_and_stays_positive():
    """Poles far above all that is played act through the sum of their time constants: a straight valley."""
    chain = plain_chain(model_of(OP_AMP))
    coordinates = coordinates_of(chain, chain.values, ["run"])
    problem = _Problem(chain, (), coordinates)
    step = np.array([0.25 if c.parameter.coordinate == "log" else 0.1 for c in coordinates])
    before, after = chain.values, problem.at(problem.moved(np.zeros(step.size), step)).values
    for c, s in zip(coordinates, step, strict=True):
        assert after[c.name] == pytest.approx(before[c.name] + s * c.slope(0.0), rel=1e-12)
    down = problem.at(problem.moved(np.zeros(step.size), np.full(step.size, -30.0))).values
    in_log = [c.name for c in coordinates if c.parameter.coordinate == "log"]
    assert [down[name] for name in in_log] == pytest.approx([0.5 * before[name] for name in in_log])


def test_what_lies_behind_a_bound_is_told(rc):
    near = plain_chain(model_of(RC)).with_values({"G2.den.s1": TRUE_RC["G2.den.s1"] * 3.3})
    pressed = fit(near, observations(rc), fixed=("G1", "F"))
    assert on_bound(pressed) == ("G2.den.s1",)
    assert pressed.beyond > 100.0
    assert fit(plain_chain(model_of(RC)), observations(rc)).beyond < 1e-3


def test_one_slope_for_both_borders_is_searched_as_one_and_its_derivative_is_that_of_both():
    model = model_of(ONE_SLOPE)
    chain = as_promised(plain_chain(model), model)
    seen = observed(recorded(ONE_SLOPE, SINE), NOISE_V, 1)
    found = fit(chain.with_values({"F.S_L": 7.0}), [seen])
    assert "F.S_U" not in [c.name for c in found.coordinates]
    assert found.chain.values["F.S_U"] == found.chain.values["F.S_L"] == pytest.approx(8.0, rel=1e-3)
    rows = sensitivities(chain, {"F.D_L": 1.0, "F.S_L": 2.0}, seen).slopes()
    moved = (simulate(chain.with_values({"F.S_L": 8.0 + s}), seen.trace) for s in (1e-4, -1e-4))
    by_hand = 2.0 * np.subtract(*moved) / 2e-4 / NOISE_V
    assert np.allclose(rows[1], by_hand, rtol=0, atol=1e-6 * np.abs(by_hand).max())


def test_slopes_of_a_rougher_grid_lead_to_the_same_values():
    bent = chain_of(model_of(toleranced(RC, 5, 0.2), (Physics("feedthrough", {"k": 1e-3}),)))
    seen = [replace(o, substeps=8) for o in observations([recorded(RC, stimulus) for stimulus in (STAIRS, SINE)])]
    whole, rough = (fit(bent, seen, rougher=n) for n in (1, 4))
    assert rough.converged
    assert rough.cost - whole.cost < 0.05
    assert 0.0 < rough.distance(whole) < 0.2


def test_a_slope_that_no_circuit_has_is_not_fitted():
    clamp = catalogue()["diode_clamp"](Place.F, "upper, resistor")
    wide = recorded(RC, sine("sine", 31.25, 8.0, 8, 1))
    more = replace(wide, y=wide.y + 0.05 * np.maximum(wide.y - 5.0, 0.0))  # a gain that grows with the level
    chain = clamp.put_in(plain_chain(model_of(RC)), {"knee": 5.0, "n_vt": 0.1, "slope": 0.9})
    found = fit(chain, [observed(more, 1e-3)], fixed=("G1", "F", "G2"))
    assert 0.9 < found.chain.values["diode_clamp.slope"] <= 0.97
    slope = next(c for c in found.coordinates if c.name == "diode_clamp.slope")
    assert [slope.value(end) for end in slope.bounds] == pytest.approx([0.0, 0.97])
    assert slope.at_bound(slope.theta(0.97))
    assert not slope.at_bound(slope.theta(0.5))


def test_a_start_beyond_what_is_allowed_begins_at_the_bound():
    clamp = catalogue()["diode_clamp"](Place.F, "upper, resistor")
    run = [observed(noisy(recorded(RC, SINE), NOISE_V, 1), NOISE_V)]
    chain = clamp.put_in(plain_chain(model_of(RC)), {"knee": 5.0, "n_vt": 0.1, "slope": 1.2})
    found = fit(chain, run, fixed=("G1", "F", "G2"))
    assert found.chain.values["diode_clamp.slope"] <= 0.97


def test_a_fit_that_is_to_be_continued_does_not_ask_how_sure_it_is(rc, monkeypatch):
    """It ends where it would have ended, and sums the normal equations once less."""
    start = chain_of(model_of(RC)).with_values({"G1.den.s1": 1.5 * chain_of(model_of(RC)).values["G1.den.s1"]})
    summed, normal = [], _Problem.normal
    monkeypatch.setattr(_Problem, "normal", lambda problem, theta: summed.append(1) or normal(problem, theta))
    told = fit(start, observations(rc), iterations=2)
    once = len(summed)
    left = fit(start, observations(rc), iterations=2, told=False)
    assert len(summed) - once == once - 1 == 2
    assert (left.theta.tolist(), left.cost, left.converged) == (told.theta.tolist(), told.cost, False)
    assert np.all(np.isinf(left.covariance))
    assert np.all(np.isfinite(told.covariance))
    ended = fit(start, observations(rc), iterations=40, told=False)
    assert ended.converged
    assert np.all(np.isfinite(ended.covariance))  # a search that comes to its end knows
