"""Is what recordings cannot tell found in them, said, and never given as a confident number?"""

from dataclasses import replace

import numpy as np
import pytest

from identify import chain as chain_module
from identify.chain import plain_chain, simulate
from identify.fit import fit
from identify.harmonic.sines import tones_of, untold_by_sines
from identify.identifiability.directions import likeness, mimics, together, undetermined
from identify.identifiability.probes import DELAYS, GAINS, OFFSETS, with_probes
from identify.joint import identify
from identify.model import LinearF, Model, Physics, Rational
from identify.trace import Trace
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP, RC, SKEWED
from tests.proof.stimuli import FIG13_LEVELS_V, Stimulus, multisine, sine, staircase
from tests.trials import model_of, noisy, observed, recorded

NOISE_V = 0.01
BORDERS = ("S_L", "D_L", "S_U", "D_U")
ALWAYS = {"delay shared between G1 and G2", "gain shared between G1, F and G2", "offset of u against D_L and D_U"}
WALK = staircase("walk", tuple(0.6 * level for level in FIG13_LEVELS_V), 0.03)
HALF = sine("10 Hz", 10.0, 2.6, 5, 2)
FULL = sine("10 Hz, louder", 10.0, 3.4, 5, 2)


def played(rig, *stimuli, physics=(), noise_v=NOISE_V):
    return [noisy(recorded(rig, s, physics), noise_v, [3, i]) for i, s in enumerate(stimuli)]


def answer(rig, *stimuli, model=None, physics=()):
    return identify(model or model_of(rig), played(rig, *stimuli, physics=physics))


def said(found):
    return {item.what: item for item in found.not_identifiable}


def starting(found, *words):
    """Return the one finding whose ``what`` starts with the words."""
    (item,) = [item for what, item in said(found).items() if what.startswith(" ".join(words))]
    return item


@pytest.fixture(scope="module")
def good():
    return answer(RC, WALK, HALF, FULL)


# --- what no recording tells ---------------------------------------------------------------------------------------


def test_a_rich_protocol_leaves_only_what_nothing_can_tell(good):
    assert set(said(good)) == ALWAYS
    assert "G1(0) = 1 and G2(0) = 1" in said(good)["gain shared between G1, F and G2"].fixed_by


@pytest.mark.parametrize("rig", [RC, SKEWED], ids=lambda rig: rig.name)
def test_probes_are_the_directions_in_which_the_answer_does_not_change(rig):
    traces = played(rig, WALK, HALF)
    found = fit(plain_chain(model_of(rig)), [observed(t, NOISE_V) for t in traces])
    seen = [observed(t, NOISE_V) for t in traces]
    told = {m.probe: set(m.by) for m in mimics(likeness(found, seen), dict.fromkeys(OFFSETS, 0.1))}
    assert set(told) == {DELAYS[0], *GAINS, OFFSETS[0]}
    assert told[DELAYS[0]] == {DELAYS[1]}
    assert told[OFFSETS[0]] == {"F.D_L", "F.D_U"}
    assert told["gain of G1"] >= {"F.D_L", "F.D_U"}
    assert {"gain of G2"} <= told["gain of F"] <= {"gain of G2", "F.S_L", "F.S_U"}


def test_what_is_held_in_the_rig_file_is_no_longer_open():
    held = answer(RC, WALK, HALF, FULL, model=replace(model_of(RC), fixed=("F",)))
    assert set(said(held)) == {"delay shared between G1 and G2", "gain shared between G1, F and G2"}


def test_an_offset_of_u_and_a_shift_of_both_borders_are_one():
    chain = with_probes(plain_chain(model_of(SKEWED)))
    trace = Trace("t", 1e4, WALK.u, WALK.u)
    moved = chain.with_values({"offset of u": 0.2})
    shifted = chain.with_values({"F.D_L": chain.values["F.D_L"] - 0.2, "F.D_U": chain.values["F.D_U"] - 0.2})
    assert np.abs(simulate(moved, trace) - simulate(chain, trace)).max() > 1.0
    assert np.allclose(simulate(moved, trace), simulate(shifted, trace), rtol=0, atol=1e-9)


@pytest.mark.parametrize("chunk", [1 << 16, 500])
def test_a_delay_before_f_and_one_behind_it_are_one(monkeypatch, chunk):
    monkeypatch.setattr(chain_module, "CHUNK", chunk)
    chain = with_probes(plain_chain(model_of(SKEWED)))
    trace = Trace("t", 1e4, WALK.u, WALK.u)
    before, behind = (simulate(chain.with_values({name: 1.0}), trace) for name in DELAYS)
    assert np.allclose(before, behind, rtol=0, atol=1e-12)
    assert np.allclose(before[1:], simulate(chain, trace)[:-1], rtol=0, atol=1e-12)


def test_an_offset_of_y_is_open_only_where_f_was_never_seen_at_rest():
    steady = [replace(t, from_rest=False) for t in played(RC, HALF, FULL)]
    found = identify(model_of(RC), steady)
    told = starting(found, "offset of y against")
    assert "D_L" in told.what
    assert "D_U" in told.what
    assert "starts at rest" in told.fixed_by
    assert not [what for what in said(answer(RC, WALK, HALF, FULL)) if what.startswith("offset of y")]


def test_a_straight_line_lets_blocks_change_places():
    model = Model("line", Rational((1.0,), (2e-2, 1.0)), LinearF(3.0), Rational((1.0,), (2e-3, 1.0)))
    trace = Trace("walk", 1e4, WALK.u, np.zeros(WALK.u.size))
    y = simulate(plain_chain(model), trace, 8) + NOISE_V * np.random.default_rng(1).standard_normal(trace.size)
    told = said(identify(replace(model, noise_v=NOISE_V), [replace(trace, y=y)]))
    assert "which poles are G1's and which G2's" in told
    assert "offset of u against that of F" in told
    assert "offset of y against that of F" in told


# --- what these recordings did not reach ---------------------------------------------------------------------------


def test_a_gap_that_is_never_crossed_leaves_the_borders_open_and_says_which_amplitude_crosses_it():
    quiet = staircase("quiet", tuple(0.3 * level for level in FIG13_LEVELS_V), 0.03)
    found = answer(RC, quiet, sine("faint", 50.0, 3.0, 10, 2))
    told = starting(found, "borders of F")
    assert "+-1.25 V" in told.fixed_by
    assert "50 Hz above 7.95 V" in told.fixed_by
    assert "fig13_staircase.yaml" in told.fixed_by
    assert "an amplitude above 7.95 V" in starting(found, "G1 and G2 at 50 Hz").fixed_by
    for name in BORDERS:
        interval = found.borders[name]
        assert interval.high - interval.low > 4.0 * abs(interval.value)
    assert "sines near 8 Hz above 1.8 V" in starting(found, "pole of G1").fixed_by
    assert [what for what in said(found) if what.startswith("pole of G2")]


def test_the_amplitude_that_was_named_settles_it():
    quiet = staircase("quiet", tuple(0.3 * level for level in FIG13_LEVELS_V), 0.03)
    told = said(answer(RC, quiet, sine("freed", 50.0, 9.5, 10, 2)))
    assert not [what for what in told if what.startswith(("borders of F", "G1 and G2", "pole"))]


def test_a_border_that_is_never_touched_is_open_and_the_other_is_not():
    found = answer(RC, staircase("up", (0.5, 1.0, 1.5, 2.0, 2.5), 0.03))
    told = starting(found, "unloading border")
    assert "never touched" in told.because
    assert "below" in told.fixed_by
    assert not [what for what in said(found) if "S_L" in what]
    narrow, wide = found.borders["D_L"], found.borders["D_U"]
    assert narrow.high - narrow.low < 0.02
    assert wide.high - wide.low > 4.0


def test_a_border_met_at_one_settled_level_rests_on_transients():
    found = answer(RC, staircase("peak", (0.5, 1.0, 2.0, 0.5, -1.0, -1.2, 0.0), 0.25))
    assert "only the level 2 V" in starting(found, "S_L against D_L").because


def test_a_border_touched_over_a_short_stretch_confounds_its_slope_and_its_place():
    """The level lies 3 mV beyond the gap."""
    found = answer(RC, staircase("just", (1.253,), 0.25))
    told = starting(found, "S_L against D_L")
    assert "2 levels of u above" in told.fixed_by
    interval = found.borders["S_L"]
    assert interval.high - interval.low > 2.0 * interval.value


def test_points_on_the_rails_are_counted_and_the_levels_clear_of_them_named():
    rails = (Concealed("saturation", {"upper": 10.0, "lower": -10.0}),)
    model = model_of(OP_AMP, [Physics("saturation", {"upper": 10.0, "lower": -10.0})])
    found = answer(OP_AMP, staircase("Fig. 13", FIG13_LEVELS_V, 0.25), model=model, physics=rails)
    told = starting(found, "borders beyond the rails")
    assert "18 of 26 points" in told.what
    assert "+-2.5 V" in told.fixed_by
    assert "scale: 0.71" in told.fixed_by
    assert set(said(found)) >= ALWAYS  # although +-2.5 V rest on the corner of a rail, where slopes differ to each side


def test_a_pole_above_the_band_is_open_and_the_rest_of_its_block_is_not():
    found = answer(OP_AMP, WALK, HALF, FULL)
    told = starting(found, "pole of G2")
    assert "above half the sample rate, 5 kHz" in told.because
    assert set(said(found)) == {*ALWAYS, told.what}


def test_a_pole_too_slow_for_the_record_is_open():
    slow = replace(RC, g1_den=(20.0 * 40_000.0, 1000.0))
    up = Stimulus("up", np.repeat([6_000.0, 9_000.0], 2000), ())
    found = answer(slow, up)
    told = starting(found, "pole of G1")
    assert "long against the longest run" in told.because
    assert "one level held for" in told.fixed_by
    interval = found.borders["D_L"]
    assert interval.high - interval.low > interval.value


def test_values_that_move_together_are_named_together(good):
    fitted = good.fit
    names = [c.name for c in fitted.coordinates]
    both = [names.index("F.S_L"), names.index("F.D_L")]
    covariance = fitted.covariance.copy()
    covariance[np.ix_(both, both)] += 50.0
    open_ = replace(fitted, covariance=covariance)
    assert undetermined(fitted) == ()
    assert set(undetermined(open_)) == {"F.S_L", "F.D_L"}
    assert [set(members) for members in together(open_, ["F.S_L"])] == [{"F.S_L", "F.D_L"}]


def test_a_zero_beside_a_pole_is_named_with_it_in_words():
    """1 + 0.01 / (s + 5) of eq. (38a): the two all but cancel, and the walk cannot tell."""
    model = replace(model_of(RC), g1=Rational((0.2, 10.02), (20e-3 * 0.2, 20e-3 * 10.0 + 0.2, 10.0)))
    traces = played(RC, WALK)
    told = said(identify(model, traces))
    assert [what for what in told if "numerator of G1, coefficient of s" in what]
    assert not [what for what in told if "G1.num" in what or "G1.den" in what]


def test_a_rig_with_physics_beyond_the_plain_model_is_told_of_too():
    pieces = [Physics("plateau_droop", {"rate": 2.0}), Physics("feedthrough", {"k": 0.02})]
    known = model_of(RC, [*pieces, Physics("saturation", {"upper": 500.0}, form="upper")])
    concealed = (Concealed("leak", {"rate": 2.0}), Concealed("feedthrough", {"k": 0.02}))
    told = said(answer(RC, WALK, model=known, physics=concealed))
    assert set(told) >= ALWAYS
    assert told["saturation.upper"].because == "no run excites it"


# --- what sines leave open -----------------------------------------------------------------------------------------


def test_sines_are_found_in_recordings_and_nothing_else_is():
    traces = played(RC, WALK, HALF, multisine("many", 5.6, 2), FULL)
    tones = [tone for trace in traces for tone in tones_of(trace, NOISE_V)]
    assert [(t.frequency_hz, t.amplitude_v) for t in tones] == [
        (10.0, pytest.approx(2.6, rel=1e-6)), (10.0, pytest.approx(3.4, rel=1e-6)),
    ]  # fmt: skip
    assert [t.samples for t in tones] == [HALF.u.size, FULL.u.size]


def test_one_amplitude_and_its_double_frequency_are_said_not_to_separate_the_gains():
    found = answer(RC, WALK, FULL, sine("20 Hz", 20.0, 5.0, 10, 2))
    told = starting(found, "|G1| against |G2| at 10 Hz and 20 Hz")
    assert "10 Hz also at" in told.fixed_by
    assert "sine_ladder.yaml" in told.fixed_by
    assert "20 Hz against that at 10 Hz" in starting(found, "phase of G1").what
    assert starting(found, "phase of G1").fixed_by.endswith("10 Hz and 30 Hz")


def test_three_times_the_frequency_is_said_to_separate_them():
    found = answer(RC, WALK, FULL, sine("31 Hz", 31.25, 8.0, 10, 2))
    assert [what for what in said(found) if what.startswith("|G1| against |G2|")]
    thirds = answer(RC, WALK, sine("12 Hz", 12.5, 3.6, 5, 2), sine("37 Hz", 37.5, 9.0, 15, 2))
    assert set(said(thirds)) == ALWAYS


def test_one_frequency_at_one_amplitude_separates_them_where_the_slopes_differ():
    assert [what for what in said(answer(RC, WALK, FULL)) if what.startswith("|G1| against |G2|")]
    assert not [what for what in said(answer(SKEWED, WALK, FULL)) if what.startswith("|G1| against |G2|")]


def test_a_plan_is_asked_without_recordings():
    tones = tones_of(Trace("plan", FULL.rate_hz, FULL.u, np.zeros(FULL.u.size)), NOISE_V)
    assert [item.what for item in untold_by_sines(model_of(RC), tones)] == ["|G1| against |G2| at 10 Hz"]
    assert untold_by_sines(model_of(RC), ()) == ()
    assert untold_by_sines(replace(model_of(RC), f=LinearF()), tones) == ()
