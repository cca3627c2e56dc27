"""Does each effect do to the signals what an independent derivation of the same physics does?"""

from dataclasses import replace
from importlib.metadata import EntryPoint
from typing import final

import numpy as np
import pytest

from identify import diode, effects
from identify.chain import Chain, as_promised, local_name, plain_chain, signals, simulate
from identify.effects import catalogue, chain_of, effect_of, physics_in, with_physics
from identify.effects.adc_averaging import running_mean
from identify.effects.inside_play import InsidePlay
from identify.effects.offset_drift import OffsetDrift
from identify.effects.plateau_droop import PlateauDroop
from identify.effects.saturation import Saturation
from identify.effects.soft_saturation import SoftSaturation
from identify.evidence import Evidence
from identify.fit import fit
from identify.model import LinearF, Model, Physics, Rational
from identify.stage import Block, Grid, Place, Ramp
from identify.trace import Trace
from tests.proof.cases import Concealed
from tests.proof.integrator import play
from tests.proof.physics import Scene, diode_clamp
from tests.proof.rigs import LINEAR, ONE_SLOPE, OP_AMP, RC, SKEWED
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

STAIRS = staircase("stairs", FIG13_LEVELS_V[::2], 0.03)
SINE = sine("sine", 31.25, 8.0, 4, 1)
RAILS = {"upper": 9.3, "lower": -11.2}
SERIES = {"drop": 2e-5, "knee": 0.8, "series": 0.15}  # the bench's words for R I_s, n V_T and the series resistance
SHUNT = {"n_vt": 0.8, "knee": 0.8 * float(np.log(0.8 / (1.15 * 2e-5))), "slope": 0.15 / 1.15}
TWINS = {
    "saturation": (OP_AMP, Concealed("saturation", RAILS), Physics("saturation", RAILS)),
    "tanh": (OP_AMP, Concealed("soft_saturation", {"level": 17.3}), Physics("soft_saturation", {"level": 17.3})),
    "tanh upper": (
        SKEWED, Concealed("soft_saturation, upper", {"level": 17.3}),
        Physics("soft_saturation", {"level": 17.3}, form="tanh upper"),
    ),
    "diode": (
        OP_AMP, Concealed("diode_clamp", SERIES), Physics("diode_clamp", SHUNT, form="upper, resistor"),
    ),
    "diode below": (
        OP_AMP, Concealed("diode_clamp, lower", SERIES), Physics("diode_clamp", SHUNT, form="lower, resistor"),
    ),
    "diodes": (
        OP_AMP, Concealed("diode_clamp, both", SERIES), Physics("diode_clamp", SHUNT, form="both, resistor"),
    ),
    "bare diode": (
        OP_AMP, Concealed("diode_clamp", {"drop": 2e-5, "knee": 0.8}),
        Physics("diode_clamp", {"n_vt": 0.8, "knee": 0.8 * float(np.log(0.8 / 2e-5))}),
    ),
    "gap": (
        LINEAR, Concealed("backlash", {"D_L": 0.7, "D_U": -0.4}),
        Physics("backlash", {"S": 8.0, "D_L": 0.7, "D_U": -0.4}),
    ),
    "slopes": (ONE_SLOPE, Concealed("unequal_slopes", {"ratio": 1.13}), Physics("unequal_slopes", {"ratio": 1.13})),
    "bend": (
        SKEWED, Concealed("curved_border", {"k2": 0.21, "k3": -0.07}),
        Physics("curved_border", {"k2": 0.21, "k3": -0.07}),
    ),
    "knee": (SKEWED, Concealed("soft_knee", {"width": 0.08}), Physics("soft_knee", {"width": 0.08})),
    "bypass": (OP_AMP, Concealed("plateau_tilt", {"k": 0.13}), Physics("plateau_tilt", {"k": 0.13})),
    "leak": (OP_AMP, Concealed("leak", {"rate": 3.7}), Physics("plateau_droop", {"rate": 3.7})),
    "bias": (
        OP_AMP, Concealed("bias current", {"current": 21.0}), Physics("plateau_droop", {"current": 21.0}, form="bias"),
    ),
    "leak across": (
        ONE_SLOPE, Concealed("leak across", {"rate": 3.7}), Physics("plateau_droop", {"rate": 3.7}, form="across"),
    ),
    "leak across, uneven": (  # the bench's pulls to where the rising border's slope alone would have w
        SKEWED, Concealed("leak across", {"rate": 3.7}),
        Physics(
            "plateau_droop", {"rate": 3.7, "target": 2.0 * SKEWED.s_l / (SKEWED.s_l + SKEWED.s_u)},
            form="unevenly across",
        ),
    ),
    "dead time": (RC, Concealed("dead_time", {"delay": 3.7e-4}), Physics("dead_time", {"delay": 3.7e-4})),
    "pole at G1": (RC, Concealed("extra_pole in G1", {"tau": 1.3e-3}), Physics("extra_pole", {"tau": 1.3e-3}, "G1")),
    "pole at G2": (RC, Concealed("extra_pole in G2", {"tau": 1.3e-3}), Physics("extra_pole", {"tau": 1.3e-3}, "G2")),
    "absorption": (
        OP_AMP, Concealed("absorption", {"fraction": 0.13, "tau": 0.037}),
        Physics("dielectric_absorption", {"fraction": 0.13, "tau": 0.037}),
    ),
    "absorption on plateaus": (
        SKEWED, Concealed("absorption on plateaus", {"fraction": 0.13, "tau": 0.017}),
        Physics("dielectric_absorption", {"fraction": 0.13, "tau": 0.017}, form="on plateaus"),
    ),
    "second play": (
        SKEWED, Concealed("second_play", {"gap": 3.1, "weight": 0.17}),
        Physics("second_play", {"gap": 3.1, "weight": 0.17}),
    ),
    "rate-dependent gap": (
        OP_AMP, Concealed("rate_dependent_gap", {"k": 2.3e-4}), Physics("rate_dependent_gap", {"k": 2.3e-4}),
    ),
    "contact through a diode": (
        OP_AMP, Concealed("diode_contact", {"n_vt": 0.031}), Physics("diode_contact", {"n_vt": 0.031}),
    ),
    "slew limit": (OP_AMP, Concealed("slew_limit", {"rate": 1130.0}), Physics("slew_limit", {"rate": 1130.0})),
    "rounded slew": (
        OP_AMP, Concealed("slew_limit, rounded", {"rate": 1130.0, "lag": 4e-4}),
        Physics("slew_limit", {"rate": 1130.0, "lag": 4e-4}, form="rounded"),
    ),
    "feedthrough": (OP_AMP, Concealed("feedthrough", {"k": 0.037}), Physics("feedthrough", {"k": 0.037})),
    "steps of the DAC": (
        OP_AMP, Concealed("dac_quantisation", {"lsb": 0.0471}), Physics("dac_quantisation", {"lsb": 0.0471}),
    ),
    "source pole": (RC, Concealed("source_pole", {"tau": 1.3e-3}), Physics("source_pole", {"tau": 1.3e-3})),
    "short source pole": (RC, Concealed("source_pole", {"tau": 2e-5}), Physics("source_pole", {"tau": 2e-5})),
    "curved source": (
        OP_AMP, Concealed("source_nonlinearity", {"k": 7e-4}), Physics("source_nonlinearity", {"k": 7e-4}),
    ),
    "coupled source": (OP_AMP, Concealed("input_ac_coupling", {"tau": 0.7}), Physics("input_ac_coupling", {"T": 0.7})),
    "clipped source": (
        OP_AMP, Concealed("input_clipping", {"upper": 2.7, "lower": -2.6}),
        Physics("input_clipping", {"upper": 2.7, "lower": -2.6}),
    ),
    "resonance at G1": (
        RC, Concealed("resonance in G1", {"w_n": 900.0, "zeta": 0.3}),
        Physics("resonance", {"w_n": 900.0, "zeta": 0.3}, "G1"),
    ),
    "resonance at G2": (
        OP_AMP, Concealed("resonance in G2", {"w_n": 900.0, "zeta": 0.3}),
        Physics("resonance", {"w_n": 900.0, "zeta": 0.3}, "G2"),
    ),
    "averaging": (
        OP_AMP, Concealed("adc_averaging", {"length": 1.37e-3}), Physics("adc_averaging", {"length": 1.37e-3})
    ),
    "fast ADC": (OP_AMP, Concealed("clock_skew", {"ppm": 700.0}), Physics("clock_skew", {"ppm": 700.0})),
    "slow ADC": (OP_AMP, Concealed("clock_skew", {"ppm": -700.0}), Physics("clock_skew", {"ppm": -700.0})),
    "drift": (OP_AMP, Concealed("offset_drift", {"rate": 0.13}), Physics("offset_drift", {"rate": 0.13})),
    "scale": (OP_AMP, Concealed("gain_drift", {"rate": 0.017}), Physics("gain_drift", {"rate": 0.017})),
    "rectifier": (
        SKEWED, Concealed("rectifying_sensor", {"lost": 0.83}), Physics("rectifying_sensor", {"lost": 0.83})
    ),
    "AC coupling": (OP_AMP, Concealed("ac_coupling", {"tau": 0.057}), Physics("ac_coupling", {"T": 0.057})),
    "range": (SKEWED, Concealed("adc_clipping", RAILS), Physics("adc_clipping", RAILS)),
    "bent scale": (
        OP_AMP, Concealed("adc_nonlinearity", {"k2": 1.7e-3, "k3": -2.9e-5}),
        Physics("adc_nonlinearity", {"k2": 1.7e-3, "k3": -2.9e-5}),
    ),
}


@pytest.mark.parametrize("stimulus", [STAIRS, SINE], ids=lambda stimulus: stimulus.name)
@pytest.mark.parametrize("name", TWINS)
def test_an_effect_does_what_the_trial_bench_derives_on_its_own(name, stimulus):
    rig, concealed, piece = TWINS[name]
    trace = recorded(rig, stimulus, (concealed,), start_s=3.0)
    chain = chain_of(model_of(rig, (piece,)))
    without = np.abs(simulate(plain_chain(model_of(rig)), trace, 32) - trace.y).max()
    assert np.abs(simulate(chain, trace, 32) - trace.y).max() < min(4e-4, 0.02 * max(without, 1e-2))


@pytest.mark.parametrize(("place", "concealed"), [("sense", "hum at sense"), ("G1", "hum at G1")])
def test_the_ripple_of_a_rectifier_is_that_of_the_trial_bench(place, concealed):
    values = {"frequency": 60.01, "second": 0.21, "fourth": 0.08}
    seed, start_s = 4, 1.7
    trace = recorded(OP_AMP, SINE, (Concealed(concealed, values),), seed=seed, start_s=start_s)
    drawn = np.random.default_rng([seed, 4242]).uniform(0.0, 2.0 * np.pi, 2)
    second, fourth = drawn + 2.0 * np.pi * np.array([2, 4]) * values["frequency"] * start_s
    phases = {"phase": 0.5 * second, "fourth_phase": fourth - 2.0 * second}
    chain = chain_of(model_of(OP_AMP, (Physics("hum", {**values, **phases}, place, "rectified"),)))
    assert np.abs(simulate(chain, trace, 32) - trace.y).max() < 4e-4


@pytest.mark.parametrize(("place", "concealed"), [("sense", "hum at sense"), ("G1", "hum at G1")])
def test_hum_is_the_line_of_the_trial_bench_once_its_phases_are_the_same(place, concealed):
    values = {"frequency": 50.02, "amplitude": 0.31, "third": 0.12, "fifth": 0.06}
    seed, start_s = 4, 1.7
    trace = recorded(OP_AMP, SINE, (Concealed(concealed, values),), seed=seed, start_s=start_s)
    drawn = np.random.default_rng([seed, 4242]).uniform(0.0, 2.0 * np.pi, 3)
    first, third, fifth = drawn + 2.0 * np.pi * np.array([1, 3, 5]) * values["frequency"] * start_s
    phases = {"phase": first, "third_phase": third - 3.0 * first, "fifth_phase": fifth - 5.0 * first}
    chain = chain_of(model_of(OP_AMP, (Physics("hum", {**values, **phases}, place),)))
    assert np.abs(simulate(chain, trace, 32) - trace.y).max() < 4e-4


def test_twice_the_strength_is_a_lag_twice_as_long_or_a_corner_half_as_high():
    plain = chain_of(model_of(OP_AMP))
    lag, ring, bypass = (catalogue()[name] for name in ("source_pole", "resonance", "feedthrough"))
    for kind, place, once, twice in (
        (lag, Place.SOURCE, {"tau": 1e-3}, {"tau": 2e-3}),
        (ring, Place.G1, {"w_n": 900.0, "zeta": 0.3}, {"w_n": 450.0, "zeta": 0.3}),
    ):
        stronger = kind(place).doubled(kind(place).put_in(plain, once))
        assert stronger.values == kind(place).put_in(plain, twice).values
    bypassed = bypass(Place.SENSE).put_in(plain, {"k": 0.01})
    assert bypass(Place.SENSE).doubled(bypassed) is bypassed


def test_a_diode_however_sharp_keeps_a_slope_to_be_widened_along_and_one_that_is_not_keeps_its_law():
    clamp, w = catalogue()["diode_clamp"](Place.F, "upper"), np.linspace(5.0, 7.0, 2001)
    knee = 6.0
    for share in (0.0003, 0.0015):
        here, wider = (clamp.law(w, knee, share * knee * factor) for factor in (1.0, 1.2))
        assert np.abs(wider - here).max() > 1e-4
    n_vt, x = 0.003 * knee, np.empty_like(w)
    diode.clamped(knee / n_vt, True, False, w / n_vt, x)
    assert np.abs(clamp.law(w, knee, n_vt) - n_vt * x).max() < 1e-4 * knee


def test_a_limit_that_was_sharp_is_rounded_from_a_lag_that_is_not_none():
    seen = observed(recorded(RC, SINE), 1e-3)
    plain = fit(chain_of(model_of(RC)), [seen])
    rounded = catalogue()["slew_limit"](Place.F, "rounded")
    sharp = rounded.put_in(plain.chain, {"rate": 900.0})
    begun = rounded.completed(sharp, Evidence(plain, (seen,)))
    assert (sharp.values["slew_limit.lag"], begun.values["slew_limit.lag"]) == (0.0, pytest.approx(1e-5))
    assert begun.values["slew_limit.rate"] == 900.0
    assert rounded.completed(begun, Evidence(plain, (seen,))).values == begun.values


def test_a_limit_that_was_missing_begins_where_it_explains_most():
    chain = chain_of(model_of(OP_AMP))
    w_top = float(np.max(signals(chain, recorded(OP_AMP, SINE))[chain.index(Place.F) - 1]))
    rails = {"upper": 0.999 * w_top, "lower": -11.2}
    seen = observed(recorded(OP_AMP, SINE, (Concealed("saturation", rails),)), 1e-4)
    values = {"lower": rails["lower"]}
    lower, both = (Saturation(Place.F, form).put_in(chain, values) for form in ("lower", "both"))
    begun = Saturation(Place.F, "both").completed(both, Evidence(fit(lower, [seen], iterations=0), (seen,)))
    assert begun.values["saturation.upper"] == pytest.approx(rails["upper"], rel=3e-4)
    assert begun.values["saturation.lower"] == rails["lower"]


def test_what_is_damped_beyond_ringing_is_no_resonance():
    trace = recorded(RC, SINE, (Concealed("extra_pole in G1", {"tau": 2e-3}),))
    ring = catalogue()["resonance"](Place.G1)
    chain = ring.put_in(chain_of(model_of(RC)), {"w_n": 3e3, "zeta": 0.9})
    found = fit(chain, [observed(trace, 1e-3)], fixed=tuple(model_of(RC).fixed))
    assert found.chain.values["resonance.zeta"] <= 1.0


def test_a_gap_that_widens_with_speed_is_told_right_where_a_block_of_first_order_makes_speed_leap():
    fast, k = sine("fast", 100.0, 9.0, 10, 1), 7e-4
    trace = recorded(RC, fast, (Concealed("rate_dependent_gap", {"k": k}),), fine=128)
    chain = chain_of(model_of(RC, (Physics("rate_dependent_gap", {"k": k}),)))
    effect = np.std(simulate(plain_chain(model_of(RC)), trace, 32) - trace.y)
    off = [np.std(simulate(chain, trace, substeps) - trace.y) for substeps in (8, 16, 32)]
    assert off[1] < 0.6 * off[0]
    assert off[2] < 0.6 * off[1]
    assert off[2] < 0.01 * effect


def law(effect, values, signal):
    run, _ = effect.begin(values, Grid("a", 1e-4), Ramp())
    return run(Block(signal, signal, 0, Grid("a", 1e-4)))


W = np.linspace(-30.0, 30.0, 601)


@pytest.mark.parametrize(
    ("form", "values", "low", "high"),
    [("both", (9.0, -7.0), -7.0, 9.0), ("upper", (9.0,), -np.inf, 9.0), ("lower", (-7.0,), -np.inf, np.inf)],
)
def test_a_rail_stops_its_own_side_only(form, values, low, high):
    expected = np.clip(W, -7.0 if form == "lower" else low, high)
    assert np.array_equal(law(Saturation(Place.F, form), values, W), expected)


def test_rails_in_front_of_the_gap_give_the_data_of_rails_behind_it():
    """So says the sentence of them: of a v that stops where the border of that side has its rail w stops there, too."""
    rig, low, high = SKEWED, -7.0, 9.0
    v = np.linspace(1.0, 8.0, 20000) * np.sin(np.linspace(0.0, 60.0, 20000)) + np.sin(np.linspace(0.0, 400.0, 20000))
    rails = rig.d_u_v + low / rig.s_u, rig.d_l_v + high / rig.s_l

    def played(v):
        return play(rig.s_l * (v - rig.d_l_v), rig.s_u * (v - rig.d_u_v), 0.0, 1.0, 0.0)

    behind = np.clip(played(v), low, high)
    assert (behind.min(), behind.max()) == (low, high)
    assert np.abs(played(np.clip(v, *rails)) - behind).max() < 1e-9
    assert np.abs(played(v) - behind).max() > 1.0


def test_tanh_is_one_sided_when_its_form_is():
    upper, lower = (law(SoftSaturation(Place.F, f"tanh {side}"), (10.0,), W) for side in ("upper", "lower"))
    assert np.array_equal(upper[W < 0.0], W[W < 0.0])
    assert np.allclose(upper[W > 0.0], 10.0 * np.tanh(W[W > 0.0] / 10.0), rtol=1e-14)
    assert np.allclose(lower, -upper[::-1], rtol=0, atol=1e-12)


def test_a_diode_leaves_zero_alone_and_bends_to_its_slope():
    level, knee, slope = 12.0, 0.8, 0.15
    upper = law(SoftSaturation(Place.F, "diode upper"), (level, knee, slope), W)
    assert upper[W == 0.0] == 0.0
    assert np.all(np.diff(upper) > 0.0)
    step = np.diff(upper) / np.diff(W)
    assert step[0] == pytest.approx(1.0, abs=1e-9)
    assert step[-1] == pytest.approx(slope, abs=1e-6)
    middle = np.argmin(np.abs(W - level))
    assert 0.5 * (step[middle - 1] + step[middle]) == pytest.approx(0.5 * (1.0 + slope), abs=1e-3)
    lower = law(SoftSaturation(Place.F, "diode lower"), (level, knee, slope), W)
    assert np.allclose(lower, -upper[::-1], rtol=0, atol=1e-12)


def test_a_diode_comes_close_to_a_clamp_solved_from_shockley_s_equation():
    """The law is not the clamp's own, yet within 2 % of the swing with three numbers (found by a coarse search)."""
    scene = Scene(None, OP_AMP, None, {"drop": 1.3e-5, "knee": 1.27}, 0)
    w = np.linspace(0.0, 22.0, 200)
    true = diode_clamp(w, scene)
    best = min(
        np.abs(law(SoftSaturation(Place.F, "diode upper"), (level, knee, slope), w) - true).max()
        for level in np.linspace(10.0, 20.0, 11) for knee in (0.5, 1.0, 1.5, 2.0) for slope in (0.05, 0.1, 0.2, 0.3)
    )
    assert best < 0.02 * np.ptp(true)


def test_leak_and_bias_together_run_to_the_level_where_they_balance():
    """dw/dt = current - rate w settles at current / rate."""
    model = Model("m", Rational((1.0,), (1.0,)), model_of(OP_AMP).f, Rational((1.0,), (1.0,)))
    chain = chain_of(Model(model.title, model.g1, model.f, model.g2, physics=(
        Physics("plateau_droop", {"rate": 40.0, "current": 120.0}, form="leak and bias"),
    )))
    t = 1e-4 * np.arange(4000)
    y = simulate(chain, Trace("still", 1e4, np.zeros(4000), np.zeros(4000)))
    assert np.allclose(y, 3.0 * -np.expm1(-40.0 * (t + 1e-4)), rtol=0, atol=1e-9)


def test_droop_needs_a_gap_and_a_dead_time_a_source_of_its_own():
    linear = plain_chain(Model("m", Rational((1.0,), (1.0,)), LinearF(), Rational((1.0,), (1.0,))))
    droop = PlateauDroop(Place.F, "leak")
    assert not droop.applicable(linear)
    with pytest.raises(ValueError, match="plateau_droop needs a backlash in F"):
        droop.put_in(linear, {"rate": 1.0})
    late = plain_chain(Model("m", Rational((1.0,), (1.0,)), LinearF(), Rational((1.0,), (1.0,), 1e-3)))
    assert not catalogue()["dead_time"](Place.G2).applicable(late)
    assert catalogue()["dead_time"](Place.G2).applicable(linear)


@pytest.mark.parametrize("effect", [PlateauDroop(Place.F, "leak"), catalogue()["dead_time"](Place.G2)])
def test_an_effect_that_lives_in_another_stage_is_none_of_its_own(effect):
    with pytest.raises(NotImplementedError, match="there is no stage of its own"):
        effect.begin((1.0,), Grid("a", 1e-4), Ramp())


def test_a_lag_of_the_source_needs_a_g1():
    with pytest.raises(ValueError, match="the chain has no G1"):
        catalogue()["source_pole"](Place.SOURCE).put_in(Chain((), {}), {"tau": 1e-3})


def test_a_lag_before_g1_and_one_behind_it_are_the_same():
    """Linear blocks commute: no recording of the rig tells them apart, and both say so."""
    trace = recorded(OP_AMP, SINE)
    one, other = (
        chain_of(model_of(OP_AMP, (Physics(name, {"tau": 7e-4}, stage),)))
        for name, stage in (("source_pole", "source"), ("extra_pole", "G1"))
    )
    assert np.array_equal(simulate(one, trace), simulate(other, trace))
    exact = {(kind.id, c.id, c.here, c.there) for kind in catalogue().values() for c in kind.confused_with if c.exact}
    assert {("source_pole", "extra_pole", None, Place.G1), ("extra_pole", "source_pole", Place.G1, None)} <= exact


def test_a_measured_source_has_its_steps_already():
    steps = catalogue()["dac_quantisation"](Place.SOURCE)
    assert steps.applicable(plain_chain(model_of(OP_AMP)))
    assert not steps.applicable(plain_chain(model_of(OP_AMP), "linear"))


@pytest.mark.parametrize("ppm", [300.0, -300.0])
def test_skewed_clocks_play_the_same_in_blocks_of_any_size(ppm):
    """Only readings past the end of a block are guessed, by the last cubic: here up to six samples on."""
    skew = catalogue()["clock_skew"](Place.SENSE)
    grid = Grid("a", 1e-4)
    t = 1e-4 * np.arange(20000)
    x = np.sin(2.0 * np.pi * 40.0 * t)
    run, _ = skew.begin((ppm,), grid, Ramp())
    parts = [run(Block(x[i : i + 700], x[i : i + 700], i, grid)) for i in range(0, t.size, 700)]
    assert np.allclose(np.concatenate(parts), np.sin(2.0 * np.pi * 40.0 * t * (1.0 - 1e-6 * ppm)), rtol=0, atol=2e-4)


def test_a_gap_takes_the_place_of_a_line_with_its_offset_whichever_way_that_runs():
    line = plain_chain(Model("m", Rational((1.0,), (1.0,)), LinearF(-3.0, 0.6), Rational((1.0,), (1.0,))))
    gap = catalogue()["backlash"](Place.F)
    assert not gap.applicable(chain_of(model_of(OP_AMP)))
    with pytest.raises(ValueError, match="backlash takes the place of a straight line, and F is none"):
        gap.put_in(chain_of(model_of(OP_AMP)), {})
    v = np.concatenate(([0.0], np.linspace(0.0, 2.0, 50), np.linspace(2.0, 0.0, 50)))
    trace = Trace("there and back", 1e3, v, v, "linear")
    wide = gap.put_in(line, {"D_L": 0.7, "D_U": -0.3})
    w = simulate(wide, trace)
    assert w[50] == pytest.approx(-3.0 * (2.0 - 0.7))  # D_L is crossed on the way up
    assert w[-1] == pytest.approx(-3.0 * 0.3)
    turned = wide.with_values({"backlash.D_L": -0.3, "backlash.D_U": 0.7})
    assert np.array_equal(simulate(turned, trace), w)
    assert gap.upright(turned).values == wide.values
    assert gap.upright(wide) is wide


def test_slopes_are_unequal_only_where_one_slope_was_promised():
    slopes = catalogue()["unequal_slopes"](Place.F)
    assert not slopes.applicable(plain_chain(model_of(ONE_SLOPE)))
    assert slopes.applicable(as_promised(plain_chain(model_of(ONE_SLOPE)), model_of(ONE_SLOPE)))
    assert not slopes.applicable(as_promised(plain_chain(model_of(OP_AMP)), model_of(OP_AMP)))


def test_a_spread_contact_shaken_by_noise_is_the_mean_of_contacts_that_shake():
    knee, noise = (Physics("soft_knee", {"width": 0.4}), Physics("process_noise", {"sd": 0.03, "bandwidth": 1e3}))
    trace = Trace("sine", SINE.rate_hz, SINE.u, np.zeros(SINE.u.size))

    def answer(*physics, apart_v=0.0):
        rig = replace(OP_AMP, d_l_v=OP_AMP.d_l_v + apart_v, d_u_v=OP_AMP.d_u_v - apart_v)
        return simulate(chain_of(model_of(rig, physics)), trace)

    contacts = [answer(noise, apart_v=0.4 * share) for share in (-0.375, -0.125, 0.125, 0.375)]
    assert np.allclose(answer(knee, noise), np.mean(contacts, axis=0), rtol=0, atol=1e-12)
    assert np.allclose(answer(noise, knee), answer(knee, noise), rtol=0, atol=1e-12)


INSIDE = [e for kind in catalogue().values() if issubclass(kind, InsidePlay) for e in kind.variants()]


@pytest.mark.parametrize("effect", INSIDE, ids=lambda effect: f"{effect.id} {effect.form}")
def test_physics_inside_the_play_acts_beside_any_other(effect):
    trace = Trace("sine", SINE.rate_hz, SINE.u[:640], np.zeros(640))
    plain = plain_chain(model_of(OP_AMP))
    for other in (o for o in INSIDE if o.id != effect.id and effect.fits([o])):
        both = effect.put_in(other.put_in(plain, valued(other)), valued(effect))
        alone = simulate(other.put_in(plain, valued(other)), trace)
        assert np.all(np.isfinite(simulate(both, trace)))
        assert not np.allclose(simulate(both, trace), alone, rtol=0, atol=1e-6), other.id


def test_what_makes_contact_soft_excludes_what_else_does():
    diode, others = catalogue()["diode_contact"](Place.F), {"process_noise": Place.G1, "soft_knee": Place.F}
    plain = plain_chain(model_of(OP_AMP))
    for id_, place in others.items():
        other = catalogue()[id_](place)
        assert not diode.applicable(other.put_in(plain, valued(other)))
        assert not other.applicable(diode.put_in(plain, valued(diode)))
        assert other.applicable(plain)
        both = Physics(id_, valued(other), place.label), Physics("diode_contact", valued(diode))
        for pieces in (both, both[::-1]):
            with pytest.raises(ValueError, match=f"{pieces[1].id} beside {pieces[0].id}: .* give one"):
                with_physics(plain, pieces)


def valued(effect):
    own = {p.name.rpartition(".")[2]: 0.3 * p.scale for p in effect.parameters()}
    return own | {name: value for name, value in effect.example.items() if name in own}


def test_a_dead_time_needs_g2():
    with pytest.raises(ValueError, match="the chain has no G2"):
        catalogue()["dead_time"](Place.G2).put_in(Chain((), {}), {"delay": 1e-3})


def test_a_pole_behind_a_jump_answers_the_held_level_exactly():
    model = Model("m", Rational((1.0,), (1.0,)), LinearF(), Rational((1.0,), (1.0,)))
    chain = with_physics(plain_chain(model), (Physics("extra_pole", {"tau": 3e-4}, "G1"),))
    y = simulate(chain, Trace("step", 1e4, np.ones(30), np.ones(30)))
    assert np.allclose(y, -np.expm1(-1e-4 * np.arange(30) / 3e-4), rtol=0, atol=1e-12)


def test_an_effect_is_not_applicable_twice():
    chain = chain_of(model_of(OP_AMP, (Physics("feedthrough", {"k": 0.01}),)))
    assert not catalogue()["feedthrough"](Place.SENSE).applicable(chain)
    assert catalogue()["hum"](Place.SENSE).applicable(chain)


def test_unknown_physics_stages_and_forms_are_refused_with_what_there_is():
    with pytest.raises(ValueError, match=r"no effect 'gremlins' in the catalogue \(.*dead_time.*, extra_pole"):
        effect_of(Physics("gremlins", {}))
    with pytest.raises(ValueError, match="no form 'both' at G1; stages: F; forms: both, upper, lower"):
        effect_of(Physics("saturation", {}, "G1"))
    with pytest.raises(ValueError, match="no form 'sideways' at F; stages: F; forms: both, upper, lower"):
        effect_of(Physics("saturation", {}, form="sideways"))
    with pytest.raises(ValueError, match="no stage 'G3'"):
        effect_of(Physics("saturation", {}, "G3"))


@pytest.mark.parametrize(
    ("piece", "message"),
    [
        (Physics("saturation", {"uper": 9.0}), "saturation has no value 'uper'; its values: upper, lower"),
        (Physics("saturation", {"lower": -9.0}, form="upper"), "saturation has no value 'lower'; its values: upper"),
    ],
)
def test_values_an_effect_does_not_have_are_refused(piece, message):
    with pytest.raises(ValueError, match=message):
        chain_of(model_of(OP_AMP, (piece,)))


def test_without_stage_and_form_the_first_is_meant():
    assert effect_of(Physics("hum", {})).place == Place.SENSE
    assert effect_of(Physics("saturation", {})).form == "both"


def test_physics_of_a_chain_keeps_the_values_of_single_runs():
    piece = Physics("hum", {"frequency": 50.0, "amplitude": 0.2, local_name("phase", "run.one"): 1.25}, "sense", "")
    chain = with_physics(plain_chain(model_of(OP_AMP)), (piece,))
    (found,) = physics_in(chain)
    assert found.values[local_name("phase", "run.one")] == 1.25
    again = with_physics(plain_chain(model_of(OP_AMP)), (found,))
    trace = Trace("run.one", 1e4, np.zeros(300), np.zeros(300))
    assert simulate(again, trace)[0] == pytest.approx(0.2 * np.sin(1.25))


class Impostor:
    """Not an effect."""

    id = "impostor"


@pytest.mark.parametrize("name", ["impostor", "saturated"])
def test_a_plug_in_that_is_no_effect_or_has_another_s_name_is_refused(monkeypatch, name):
    target = "identify.effects.saturation:Saturation" if name == "saturated" else f"{__name__}:Impostor"
    monkeypatch.setattr(effects, "entry_points", lambda group: [EntryPoint(name, target, group)])
    catalogue.cache_clear()
    try:
        with pytest.raises(ValueError, match=f"entry point {name} of group identify.effects is "):
            catalogue()
    finally:
        catalogue.cache_clear()


@final
class Unheard(OffsetDrift):  # type: ignore[misc]  # what it does is not what this is about
    """An effect of another package."""

    id = "unheard"


def test_the_catalogue_is_a_plug_in_point(monkeypatch):
    """An effect from another package is in the catalogue by being installed, beside those of this one."""
    found = [EntryPoint("unheard", f"{__name__}:Unheard", effects.GROUP)]
    monkeypatch.setattr(effects, "entry_points", lambda group: found)
    catalogue.cache_clear()
    try:
        assert catalogue()["unheard"] is Unheard
        assert catalogue()["saturation"] is Saturation
    finally:
        catalogue.cache_clear()


def test_a_plug_in_cannot_take_the_place_of_an_effect(monkeypatch):
    found = [EntryPoint("saturation", "identify.effects.saturation:Saturation", effects.GROUP)]
    monkeypatch.setattr(effects, "entry_points", lambda group: found)
    catalogue.cache_clear()
    try:
        with pytest.raises(ValueError, match=r"entry point saturation .* has an effect of that id"):
            catalogue()
    finally:
        catalogue.cache_clear()


@pytest.mark.parametrize(
    ("form", "values"),
    [
        ("", {"amplitude": -0.3, "third": -0.1, "fifth": 0.05, "third_phase": 0.4}),
        ("rectified", {"second": -0.3, "fourth": -0.1, "fourth_phase": 0.4}),
    ],
    ids=["odd", "rectified"],
)
def test_hum_with_negative_amplitudes_is_told_upright_and_plays_the_same(form, values):
    hum = effect_of(Physics("hum", {}, "sense", form))
    chain = hum.put_in(chain_of(model_of(OP_AMP)), {"frequency": 50.0, "phase": 1.1, "phase[sine]": 0.7, **values})
    upright = hum.upright(chain)
    assert all(upright.values[p.name] >= 0.0 for p in hum.parameters() if p.unit == "V")
    trace = Trace("sine", SINE.rate_hz, SINE.u, np.zeros(SINE.u.size))
    assert np.allclose(simulate(upright, trace), simulate(chain, trace), rtol=0, atol=1e-12)
    assert hum.upright(upright) is upright


@pytest.mark.parametrize(
    ("values", "plausible"),
    [({"k2": 0.01}, True), ({"k2": -0.01}, True), ({"k2": -1.0}, False), ({"k2": 1.0}, True)],
    ids=["ceramic", "grows a little", "grows ten times", "is lost"],
)
def test_no_capacitor_grows_to_many_times_its_size_where_the_recordings_go(values, plausible):
    law = catalogue()["capacitor_nonlinearity"](Place.G1, "square")
    run = observed(recorded(OP_AMP, STAIRS, (), 1e-3), 1e-3)
    chain = law.put_in(chain_of(model_of(OP_AMP)), {**values, "tau": 1e-3})
    assert law.plausible(chain, (run,)) is plausible
    assert OffsetDrift(Place.SENSE).plausible(chain, (run,))


@pytest.mark.parametrize(("tau", "plausible"), [(1e-4, False), (0.05, True)])
def test_what_follows_its_load_at_once_is_no_heat(tau, plausible):
    law = catalogue()["self_heating"](Place.G1)
    chain = law.put_in(chain_of(model_of(OP_AMP)), {"k": 1e-3, "tau": tau})
    assert law.plausible(chain, ()) is plausible


def test_the_width_of_a_knee_comes_out_as_it_is():
    """As many plays as the law has side by side are few to a width that a run tells to a thousandth."""
    knee, chain, width = catalogue()["soft_knee"](Place.F), chain_of(model_of(OP_AMP)), 0.8
    run = recorded(OP_AMP, sine("large", 10.0, 3.4, 2, 1), (Concealed("soft_knee", {"width": width}),), 0.0, 3)

    def answer(value):
        return simulate(knee.put_in(chain, {"width": value}), run, 8)

    slope = (answer(1.001 * width) - answer(0.999 * width)) / (0.002 * width)
    off = float(slope @ (run.y - answer(width)) / (slope @ slope))
    assert abs(off) < 1.5e-4 * width  # 2.8e-4 of sixteen plays, 0.5e-4 of the hundred of the bench


@pytest.mark.parametrize(("steps", "late"), [(0.3, None), (2.6, None), (7.0, None), (0.3, 0.4), (2.9, 0.4), (3.0, 0.0)])
def test_averaging_takes_the_mean_of_what_is_straight_or_held_between_instants(steps, late):
    """Summed up on a grid a thousand times finer."""
    y, finer = np.cumsum(np.random.default_rng(3).normal(size=40)), 1000
    inside = np.arange(1, 39 * finer + 1) / finer
    if late is None:
        fine = np.interp(inside - 0.5 / finer, np.arange(40), y)
    else:
        fine = y[np.ceil(inside - late - 1e-9).astype(int)]
    gathered = np.concatenate(([0.0], np.cumsum(fine))) / finer
    run, whole = running_mean(steps, late), running_mean(steps, late)
    block = Block(y, y, 0, Grid("run", 1e-4))
    out = np.concatenate([run(replace(block, signal=part)) for part in (y[:5], y[5:6], y[6:])])
    assert np.allclose(out, whole(block), rtol=0, atol=1e-12)
    at = np.arange(10, 40)
    mean = (gathered[at * finer] - np.interp((at - steps) * finer, np.arange(gathered.size), gathered)) / steps
    assert np.allclose(out[at], mean, rtol=0, atol=5e-3)


@pytest.mark.parametrize("steps", [50.0, 1e12, np.inf])
def test_averaging_over_more_than_a_run_is_of_what_was_before_it_too(steps):
    y = np.linspace(2.0, 3.0, 21)
    out = running_mean(steps, None)(Block(y, y, 0, Grid("run", 1e-4)))
    assert out == pytest.approx(2.0 + np.concatenate(([0.0], np.cumsum(0.5 * (y[1:] + y[:-1]) - 2.0))) / steps)
