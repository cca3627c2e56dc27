"""Is what a candidate would leave of the residual what a refit confirms, with the plain parameters projected out?"""

from types import SimpleNamespace

import numpy as np
import pytest

from identify.candidates import Candidate, candidates, evidence_starts
from identify.chain import plain_chain, simulate
from identify.effects import catalogue
from identify.evidence import Evidence
from identify.explain.promise import promised
from identify.first_order import FirstOrder
from identify.fit import fit
from identify.stage import Place
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
PLAYED = (staircase("stairs", FIG13_LEVELS_V, 0.05), sine("sine", 31.25, 8.0, 8, 1))
DRIFT = Concealed("offset_drift", {"rate": 0.013})
KINDS = list(catalogue().values())


def best_of(seen, effect):
    """Return the chain of an effect at the values that promise most from its first start."""
    start = effect.starts(seen)[0]
    return promised(seen, Candidate(effect, start, seen.gain(effect, start))).chain


def evidence_of(*physics, fixed=()):
    traces = [recorded(OP_AMP, s, physics, NOISE_V, seed=3, start_s=4.0 * i) for i, s in enumerate(PLAYED)]
    seen = [observed(trace, NOISE_V, 1) for trace in traces]
    return Evidence(fit(plain_chain(model_of(OP_AMP)), seen, fixed=fixed), seen)


@pytest.fixture(scope="module")
def drifting():
    return evidence_of(DRIFT)


@pytest.fixture(scope="module")
def clean():
    return evidence_of()


def test_the_promise_of_an_effect_is_kept_by_a_refit(drifting):
    effect = catalogue()["offset_drift"](Place.SENSE)
    promised = drifting.gain(effect, {"rate": 0.013})
    fixed = (effect.put_in(drifting.chain, {"rate": 0.013}), drifting.observations, drifting.chain.values)
    refitted = fit(*fixed, fixed=("offset_drift",))
    assert promised > 1000.0
    assert drifting.fitted.cost - refitted.cost == pytest.approx(promised, rel=0.02)


def test_where_nothing_gains_a_search_begins_from_what_changes_least(clean):
    """A resonance of 3 Hz, the first that was tried, was begun with where a fast one was concealed beside a hum."""
    effect = catalogue()["resonance"](Place.G1)
    options = [{"w_n": w, "zeta": 0.1} for w in (20.0, 20_000.0, 200.0)]
    assert [clean.merit(effect, option) for option in options] == [0.0, 0.0, 0.0]
    assert clean.best(effect, options) == options[1]


def test_what_the_plain_parameters_can_mimic_is_no_gain(drifting):
    moved = drifting.chain.with_values({"F.D_L": drifting.chain.values["F.D_L"] + 1e-4})
    change = drifting.change(moved)
    assert np.linalg.norm(change) > 1.0
    assert drifting.left_by(drifting.residual + change) == pytest.approx(drifting.left, rel=1e-3)
    assert np.linalg.norm(drifting.without_plain(change[None, :])) < 0.05 * np.linalg.norm(change)


def test_left_is_what_least_squares_with_the_prior_leaves(drifting):
    noise = np.random.default_rng(0).normal(size=drifting.residual.size)
    prior = np.diag([1.0 / c.prior_sd for c in drifting.fitted.coordinates])
    rows = np.concatenate([drifting.slopes.T, prior])
    target = np.concatenate([noise, np.zeros(len(prior))])
    moved = np.linalg.lstsq(rows, target, rcond=None)[0]
    assert drifting.left_by(noise) == pytest.approx(np.sum((target - rows @ moved) ** 2), rel=1e-7)
    assert np.allclose(drifting.without_plain(noise[None, :])[0], (target - rows @ moved)[: noise.size], atol=1e-4)
    assert 0.0 < noise @ noise - drifting.left_by(noise) < 40.0  # as many degrees of freedom as parameters


def test_without_parameters_nothing_is_projected_out():
    rigid = evidence_of(fixed=("G1", "F", "G2"))
    rows = np.ones((1, rigid.residual.size))
    assert rigid.without_plain(rows) is rows
    matrices, rights = np.ones((2, 1, 1)), np.ones((2, 1))
    assert rigid.less_plain_each(matrices, rights, np.zeros((2, 0, 1))) == (matrices, rights)
    assert rigid.left == pytest.approx(rigid.residual @ rigid.residual)


def test_the_right_effect_promises_most(drifting):
    found = candidates(drifting, KINDS)
    assert found[0].effect.id == "offset_drift"
    assert found[0].values["rate"] == pytest.approx(0.013, rel=0.5)
    assert [c.gain for c in found] == sorted((c.gain for c in found), reverse=True)


def test_effects_that_cannot_be_put_in_are_no_candidates(clean):
    taken = Evidence(clean.fitted, clean.observations)
    taken.chain = catalogue()["feedthrough"](Place.SENSE).put_in(clean.chain, {"k": 0.0})
    found = candidates(taken, [catalogue()["feedthrough"], catalogue()["offset_drift"]])
    assert {c.effect.id for c in found} == {"offset_drift"}
    assert all(np.isfinite(c.gain) for c in found)


def test_what_cannot_be_simulated_leaves_everything(clean):
    assert clean.left_by(np.full(clean.residual.size, np.nan)) == np.inf


def test_ranges_are_those_of_the_taps(clean):
    low, high = clean.range(Place.F)
    assert low == pytest.approx(8.0 * (-3.5 + 1.25), rel=0.05)  # the lowest level of the staircase, nearly settled
    assert high == pytest.approx(8.0 * (3.0 - 1.25), rel=0.05)
    assert clean.range(Place.SENSE) == clean.range(Place.G2)


def test_rates_are_symmetric_and_hold_zero(clean):
    rates = clean.rates(Place.G1)
    assert 0.0 in rates
    assert list(rates) == sorted(rates)
    assert np.allclose(rates, -np.array(rates)[::-1])


def test_a_line_in_the_residual_is_found_between_the_bins():
    hum = Concealed("hum at sense", {"frequency": 50.37, "amplitude": 0.05, "third": 0.0, "fifth": 0.0})
    assert evidence_of(hum).strongest_line_hz == pytest.approx(50.37, abs=0.2)


def test_residual_is_joined_over_runs_and_in_units_of_the_noise(clean):
    expected = np.concatenate([
        (o.trace.y - simulate(clean.chain, o.trace, o.substeps)) / NOISE_V for o in clean.observations
    ])  # fmt: skip
    assert np.allclose(clean.residual, expected, rtol=0, atol=1e-9)
    assert [part.stop - part.start for _, part in clean.parts()] == [o.count for o in clean.observations]
    assert np.std(clean.residual) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("size", [1e-5, 1e-3, 0.3])
def test_what_is_proportional_is_solved_whatever_size_it_is_tried_with(drifting, size):
    effect = catalogue()["offset_drift"](Place.SENSE)
    start = drifting.proportion(effect, "rate", size)
    assert start["rate"] == pytest.approx(0.013, rel=0.02)
    beside = [drifting.gain(effect, {"rate": start["rate"] * factor}) for factor in (0.9, 1.1)]
    assert drifting.gain(effect, start) > max(beside)


@pytest.mark.parametrize(
    ("concealed", "name", "tolerance"),
    [
        (Concealed("absorption", {"fraction": 0.013, "tau": 0.04}), "dielectric_absorption", 0.3),
        (Concealed("second_play", {"gap": 3.25, "weight": 0.02}), "second_play", 0.1),
    ],
)
def test_a_share_of_w_that_goes_another_way_has_a_start_that_is_about_right(concealed, name, tolerance):
    seen = evidence_of(concealed)
    effect = next(catalogue()[name].variants())
    (start,) = effect.starts(seen)
    share = "weight" if name == "second_play" else "fraction"
    assert start[share] == pytest.approx(concealed.values[share], rel=tolerance)
    assert seen.gain(effect, start) > 0.8 * seen.gain(effect, concealed.values)


def test_a_share_below_zero_is_no_start():
    seen = evidence_of(Concealed("absorption", {"fraction": -0.013, "tau": 0.04}))
    options = [{"fraction": 0.01, "tau": tau} for tau in (0.03, 0.1)]
    assert seen.best_share(catalogue()["dielectric_absorption"](Place.F, "every step"), "fraction", options) == {}


@pytest.mark.parametrize("level", [150.0, 1200.0])  # nine times the range of w, and seventy times
@pytest.mark.parametrize("form", ["tanh both", "tanh upper", "tanh lower"])
def test_a_weak_compression_has_a_start_that_gains(form, level):
    w = "soft_saturation, upper" if form == "tanh upper" else "soft_saturation"
    seen = evidence_of(Concealed(w, {"level": level}))
    effect = catalogue()["soft_saturation"](Place.F, form)
    (start,) = effect.starts(seen)
    assert seen.gain(effect, start) > 0.0
    if form != "tanh lower":
        assert best_of(seen, effect).values["soft_saturation.level"] == pytest.approx(level, rel=0.3)


@pytest.mark.parametrize("current", [-3e-3, 3e-3])
def test_a_bias_current_far_below_what_is_tried_has_a_start(current):
    seen = evidence_of(Concealed("bias current", {"current": current}))
    (start,) = catalogue()["plateau_droop"](Place.F, "bias").starts(seen)
    assert start["current"] == pytest.approx(current, rel=0.5)


def test_a_pole_far_below_a_sample_has_a_start_that_is_about_right():
    """From a tenth of a sample, twenty times as much, nothing gains: a delay and a gap were sure of what was a pole."""
    late, noise_v = Concealed("extra_pole in G2", {"tau": 5e-7}), 2e-4
    traces = [recorded(OP_AMP, s, (late,), noise_v, seed=3, start_s=4.0 * i) for i, s in enumerate(PLAYED)]
    seen = [observed(trace, noise_v, 1) for trace in traces]
    evidence = Evidence(fit(plain_chain(model_of(OP_AMP)), seen), seen)
    (start,) = catalogue()["extra_pole"](Place.G2).starts(evidence)
    assert start["tau"] == pytest.approx(5e-7, rel=0.5)


@pytest.mark.parametrize("depth", [2e-3, 8e-3, 0.1])
def test_a_rail_that_is_only_just_met_has_a_start_that_leads_to_it(clean, depth):
    upper = clean.range(Place.F)[1] * (1.0 - depth)
    seen = evidence_of(Concealed("saturation", {"upper": upper, "lower": float("-inf")}))
    effect = catalogue()["saturation"](Place.F, "upper")
    (start,) = effect.starts(seen)
    assert seen.gain(effect, start) > 0.0
    found = fit(effect.put_in(seen.chain, start), seen.observations)
    assert found.chain.values["saturation.upper"] == pytest.approx(upper, rel=2e-3)


def test_a_parameter_at_its_bound_mimics_nothing():
    seen = evidence_of(Concealed("dead_time", {"delay": 45e-6}))
    found = seen.fitted
    assert any(c.at_bound(float(t)) for t, c in zip(found.theta, found.coordinates, strict=True))
    effect = catalogue()["dead_time"](Place.G2)
    promise = seen.gain(effect, {"delay": 45e-6})
    refitted = fit(effect.put_in(seen.chain, {"delay": 45e-6}), seen.observations, seen.chain.values)
    assert promise > 0.5 * (seen.fitted.cost - refitted.cost) > 100.0


@pytest.mark.parametrize(("drop", "law", "form"), [
    (3e-6, "soft_saturation", "diode upper"), (3e-5, "soft_saturation", "diode upper"), (3e-5, "diode_clamp", "upper"),
])
def test_a_diode_has_a_start_from_which_its_promise_is_most_of_what_a_fit_finds(drop, law, form):
    seen = evidence_of(Concealed("diode_clamp", {"drop": drop, "knee": 1.4}))
    effect = catalogue()[law](Place.F, form)
    (start,) = effect.starts(seen)
    promise = promised(seen, Candidate(effect, start, seen.gain(effect, start)))
    refitted = fit(promise.chain, seen.observations, seen.chain.values)
    assert promise.gain > 0.8 * (seen.fitted.cost - refitted.cost) > 100.0


@pytest.mark.parametrize(("concealed", "kind", "place"), [
    (Concealed("feedthrough", {"k": 5e-4}), "feedthrough", Place.SENSE),
    (Concealed("leak", {"rate": 8e-4}), "plateau_droop", Place.F),
    (Concealed("hum at sense", {"frequency": 50.01, "amplitude": 1e-3, "third": 2e-4, "fifth": 0.0}), "hum",
     Place.SENSE),
])  # fmt: skip
def test_where_an_effect_is_small_its_promise_is_its_fit(concealed, kind, place):
    seen = evidence_of(concealed)
    effect = next(e for e in catalogue()[kind].variants() if e.place == place)
    start = max(evidence_starts(seen, effect), key=lambda values: seen.gain(effect, values))
    promise = promised(seen, Candidate(effect, start, seen.gain(effect, start)))
    refitted = fit(promise.chain, seen.observations, seen.chain.values)
    assert promise.gain > 10.0
    assert seen.fitted.cost - refitted.cost == pytest.approx(promise.gain, abs=4.0)


def test_what_two_coefficients_gain_together_is_solved_from_one_look_at_each(drifting):
    bent, small = catalogue()["adc_nonlinearity"](Place.SENSE, "square and cube"), {"k2": 1e-5, "k3": 1e-6}
    both, gain = drifting.proportions_beside(bent, {}, small, ["k2", "k3"])
    one, less = drifting.proportions_beside(bent, {}, small, ["k3"])
    assert drifting.gain(bent, both) == pytest.approx(gain, rel=1e-3)
    assert drifting.gain(bent, {"k2": 0.0, **one}) == pytest.approx(less, rel=1e-3)
    assert 0.0 < less < gain
    for name in small:
        for factor in (0.9, 1.1):
            assert drifting.gain(bent, {**both, name: factor * both[name]}) < gain


def test_every_form_of_a_capacitor_begins_with_the_law_that_is_there():
    seen = evidence_of(Concealed("nonlinear capacitor in G2", {"k2": 2e-3, "tau": 2e-3}))
    for form in ("square", "straight and square"):
        effect = catalogue()["capacitor_nonlinearity"](Place.G2, form)
        (start,) = effect.starts(seen)
        assert start["k2"] == pytest.approx(2e-3, rel=0.5)
        assert 0.3 < start["tau"] / 2e-3 < 3.0


def test_many_sets_of_rows_are_freed_of_the_plain_values_as_each_alone(drifting):
    rng = np.random.default_rng(0)
    sets = [drifting.products_of(rng.normal(size=(3, drifting.residual.size))) for _ in range(4)]
    stacked = (np.array([getattr(one, name) for one in sets]) for name in ("square", "along", "mimic"))
    matrices, rights = drifting.less_plain_each(*stacked)
    for one, matrix, right in zip(sets, matrices, rights, strict=True):
        alone = drifting.less_plain(one)
        assert np.allclose(matrix, alone[0], rtol=1e-9)
        assert np.allclose(right, alone[1], rtol=1e-9)


@pytest.mark.parametrize("sizes", [(1.0, 1.0, 1e9), (1.0, 1.0 / 3.0, 1e-9)])
def test_parameters_that_rounding_does_not_tell_apart_are_moved_as_one(sizes):
    """Of a corrected chain two were: what it left was asked of a matrix without an inverse, which ended the answer."""
    shapes = np.random.default_rng(5).normal(size=(2, 500))

    class Alike(FirstOrder):
        fitted = SimpleNamespace(coordinates=[SimpleNamespace(prior_sd=np.inf)] * 3)
        residual = shapes[0] + shapes[1]
        slopes = np.array(sizes)[:, None] * shapes[[0, 0, 1]]

    assert Alike().left < 1e-6 * float(Alike.residual @ Alike.residual)
    assert Alike().without_plain(shapes) == pytest.approx(np.zeros((2, 500)), abs=1e-4)
