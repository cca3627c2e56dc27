"""Are the trials of the study what they promise: all physics, random rigs, the sizes drawn, sealed truths?"""

import json
from dataclasses import replace
from itertools import islice

import numpy as np
import pytest

from identify.effects import catalogue
from identify.effects.effect import short
from identify.readings import blemishes
from tests.proof import operators
from tests.proof.bench import LAWS, SUBSTEPS, answer, record
from tests.proof.cases import Concealed
from tests.proof.composed import COMPOSED, WHAT
from tests.proof.composing import STAGES
from tests.proof.detect import Sensed, strength
from tests.proof.integrator import Grid, linear_block
from tests.proof.kinds import LIBRARY, UNHEARD
from tests.proof.rigs import RC, drawn_rig, toleranced
from tests.proof.seal import Sealed, sealed
from tests.proof.standard import SOURCE_V, protocol
from tests.proof.stimuli import sine, staircase
from tests.proof.trial import ROUND, STRATA, Key, Trial, _hidden, _pieces, drawn, plan

KNOWN = {**blemishes(), **catalogue()}
IDS = sorted({kind.id for kind in LIBRARY})


def test_every_physics_of_the_catalogue_and_eight_outside_it_can_be_concealed():
    assert len(IDS) == 39
    assert set(KNOWN) <= set(IDS)
    assert len(UNHEARD) >= 8
    assert not {kind.id for kind in UNHEARD} & set(IDS)
    assert {kind.law for kind in (*LIBRARY, *UNHEARD)} | set(COMPOSED) == set(LAWS)


@pytest.mark.parametrize("kind", [kind for kind in LIBRARY if kind.id in KNOWN], ids=lambda kind: kind.law)
def test_what_is_concealed_is_told_in_the_catalogue_s_own_words(kind):
    effect = KNOWN[kind.id]
    assert kind.stage in {place.label for place in effect.places}
    told = kind.told(kind.draw(np.random.default_rng(1), SMALL.reach)(0.5))
    assert set(told) <= {short(p.name) for p in effect.declared}


def test_a_round_has_every_effect_once_and_the_shares_of_the_rest():
    size = sum(ROUND.values()) + 3
    keys = list(islice(plan(5, STRATA, ("hum", "dead_time", "spikes")), 3 * size))
    assert len(set(keys)) == len(keys)
    for first in range(0, len(keys), size):
        turn = keys[first : first + size]
        assert sorted(k.about for k in turn if k.stratum == "single") == ["dead_time", "hum", "spikes"]
        assert {s: sum(k.stratum == s for k in turn) for s in ROUND} == ROUND
        assert {k.about for k in turn if k.stratum == "below"} == {"dead_time", "hum"}


def test_rigs_differ_widely_and_every_one_is_well_excited():
    rigs = [drawn_rig(np.random.default_rng(seed)) for seed in range(60)]
    assert {len(rig.g1_den) for rig in rigs} == {len(rig.g2_den) for rig in rigs} == {2, 3}
    assert sum(rig.s_l != rig.s_u for rig in rigs) == pytest.approx(20, abs=10)
    assert sum(rig.dead_time_s > 0.0 for rig in rigs) == pytest.approx(10, abs=8)
    assert all(0.001 <= rig.noise_v <= 0.030 for rig in rigs)
    for rig in rigs[:20]:
        training, held_out = protocol(rig, np.random.default_rng(3))
        peaks = [
            np.abs(linear_block(s.u, rig.g1_num, rig.g1_den, 1e-4)[s.u.size // 2 :]).max() / rig.half_gap_v
            for s in (*training, *held_out)
        ]
        moving = [peak for s, peak in zip((*training, *held_out), peaks, strict=True) if s.name != "sine_stuck"]
        assert 1.1 < min(moving) <= max(moving) < 4.5
        assert max(np.abs(s.u).max() for s in (*training, *held_out)) <= SOURCE_V
        assert 120_000 < sum(s.u.size for s in training) < 270_000


def test_operators_play_one_to_four_runs_of_any_kind_at_any_rate_and_may_hold_none_out():
    rng = np.random.default_rng(1)
    played = [operators.protocol(drawn_rig(rng), rng) for _ in range(80)]
    runs = [run for training, held_out in played for run in (*training, *held_out)]
    assert {len(training) for training, _ in played} == {1, 2, 3, 4}
    assert {len(held_out) for _, held_out in played} == {0, 1}
    assert {run.segments[0].kind for run in runs} == set(operators.SHAPES)
    assert {run.rate_hz for run in runs} == set(operators.RATES_HZ)
    assert all(len({run.rate_hz for run in (*training, *held_out)}) == 1 for training, held_out in played)
    assert {len(run.segments) for run in runs} == {1, 2, 3}
    assert all(run.segments[-1].stop == run.u.size for run in runs)
    assert max(np.abs(run.u).max() for run in runs) <= SOURCE_V


def test_what_is_concealed_under_runs_that_an_operator_chose_shows():
    shown = [drawn(Key(5, "free", about, 0)) for about in ("hum", "saturation", "dead_time")]
    assert all(trial.z[0] > 5.0 and len(trial.expected) == 1 for trial in shown)
    nothing = drawn(Key(5, "free_null", "free_null", 0))
    assert (nothing.physics, nothing.expected, nothing.z) == ((), (), ())
    assert len(nothing.training) <= 4 < len(drawn(Key(5, "null", "null", 0)).training)


def test_a_stuck_sine_leaves_the_gap_stuck():
    rig = drawn_rig(np.random.default_rng(4))
    stuck = next(s for s in protocol(rig, np.random.default_rng(3))[0] if s.name == "sine_stuck")
    v = linear_block(stuck.u, rig.g1_num, rig.g1_den, 1e-4)
    assert np.abs(v[v.size // 2 :]).max() < 0.8 * rig.half_gap_v


@pytest.mark.parametrize("flag", ["linear", "tied"])
def test_a_rig_file_that_knows_less_stays_so_when_its_parts_are_off(flag):
    rig = replace(RC, d_u_v=RC.d_l_v if flag == "linear" else RC.d_u_v, **{flag: True})
    off = toleranced(rig, 7, 0.05)
    assert off.s_l == off.s_u != rig.s_l
    assert (off.d_l_v == off.d_u_v) is (flag == "linear")


# --- how clearly it shows -----------------------------------------------------------------------------------------

PLAYED = (staircase("stairs", (3.0, -3.0, 1.0), 0.05), sine("sine", 10.0, 3.4, 2, 1))
SMALL = Sensed(Trial(Key(1, "single", "hum", 0), RC, 9, PLAYED, ()))


def test_physics_that_the_plain_values_can_copy_does_not_show_and_other_physics_does():
    hidden = next(kind for kind in LIBRARY if kind.law == "unequal_slopes")
    slopes = hidden.draw(np.random.default_rng(1), SMALL.reach)(0.01)
    hidden_there = Concealed("unequal_slopes", slopes)
    change = SMALL.answers(RC, (hidden_there,)) - SMALL.answers(RC)
    assert SMALL.z(hidden_there) < 0.01 * np.linalg.norm(change) / RC.noise_v
    assert SMALL.z(Concealed("feedthrough", {"k": 0.01})) > 50.0


def test_z_of_an_addition_is_its_norm_over_the_noise_less_what_is_projected_out():
    z = SMALL.z(Concealed("hum at sense", {"frequency": 60.0, "amplitude": 0.02, "third": 0.0, "fifth": 0.0}))
    assert z == pytest.approx(np.sqrt(0.5 * sum(s.u.size for s in PLAYED)) * 0.02 / RC.noise_v, rel=0.1)


def test_white_noise_shows_nothing_in_its_spectrum_and_flicker_noise_does():
    flat = SMALL.z_of_spectrum(Concealed("coloured_noise", {"sd": 0.2 * RC.noise_v, "slope": 0.0}))
    red = SMALL.z_of_spectrum(Concealed("coloured_noise", {"sd": 0.2 * RC.noise_v, "slope": 2.0}))
    assert red > 3.0 * flat


def test_what_is_concealed_beside_noise_must_show_in_both_together():
    tone = {"frequency": 900.0, "amplitude": 0.02, "third": 0.0, "fifth": 0.0}
    quick, slow = Concealed("hum at sense", tone), Concealed("offset_drift", {"rate": 0.1})
    white = replace(SMALL, beside=(Concealed("coloured_noise", {"sd": RC.noise_v, "slope": 0.0}),))
    red = replace(SMALL, beside=(Concealed("coloured_noise", {"sd": 10.0 * RC.noise_v, "slope": 2.0}),))
    assert [white.z(c) / SMALL.z(c) for c in (quick, slow)] == pytest.approx([0.5**0.5] * 2, rel=0.1)
    assert red.z(slow) < 0.1 * SMALL.z(slow)
    assert red.z(quick) > 0.3 * SMALL.z(quick)


def test_what_is_concealed_beside_noise_in_front_of_the_gap_must_show_in_what_that_makes_of_w():
    """Its mean is a law, and hides nothing; its courses hide what is slow, as w keeps where they pushed it."""
    tone = {"frequency": 900.0, "amplitude": 0.02, "third": 0.0, "fifth": 0.0}
    quick, slow = Concealed("hum at sense", tone), Concealed("feedthrough", {"k": 0.01})
    red = Concealed("coloured_noise", {"sd": RC.noise_v, "slope": 2.0})
    shaken = replace(SMALL, beside=(Concealed("process_noise, low-passed", {"sd": 0.1, "bandwidth": 1000.0}),))
    assert shaken.z(slow) < 0.3 * SMALL.z(slow)
    assert shaken.z(slow) / SMALL.z(slow) < 0.5 * shaken.z(quick) / SMALL.z(quick)
    assert shaken.z_of_spectrum(red) < 0.5 * SMALL.z_of_spectrum(red)
    still = replace(SMALL, beside=(Concealed("offset_drift", {"rate": 10.0}),))
    assert still.z(slow) == pytest.approx(SMALL.z(slow))


def test_every_piece_is_sized_in_all_noise_that_is_drawn_before_it(monkeypatch):
    kinds = [next(k for k in LIBRARY if k.law == law) for law in ("feedthrough", "process_noise", "coloured_noise")]
    beside = {}

    def sized(sensed, kind, rng, bounds):
        beside[kind.law] = [concealed.name for concealed in sensed.beside]
        return Concealed(kind.law, {}), 50.0

    monkeypatch.setattr("tests.proof.trial._piece", sized)
    monkeypatch.setattr("tests.proof.trial._hidden", lambda *those: False)
    _pieces(SMALL.case, kinds, np.random.default_rng(1))
    assert beside == {
        "coloured_noise": [], "process_noise": ["coloured_noise"], "feedthrough": ["coloured_noise", "process_noise"]
    }  # fmt: skip


def test_noise_of_the_reading_that_the_noise_in_front_of_the_gap_hides_is_drawn_again():
    shaking, red = (next(k for k in LIBRARY if k.law == law) for law in ("process_noise", "coloured_noise"))
    beside, faint = ({"sd": 0.1, "bandwidth": 1000.0}, {"sd": 0.1 * RC.noise_v, "slope": 2.0})
    found = {red: (Concealed("coloured_noise", faint), 30.0), shaking: (Concealed("process_noise", beside), 30.0)}
    assert _hidden(SMALL.case, red, found, 30.0)
    assert not _hidden(SMALL.case, red, {red: found[red]}, 30.0)
    assert not _hidden(SMALL.case, shaking, found, 30.0)


@pytest.mark.parametrize("law", [lambda s: 900 * s, lambda s: 4e4 * s**2.2, lambda s: 900 * max(s - 0.3, 0.0) ** 1.5])
def test_a_strength_is_found_whatever_the_law(law):
    at, z = strength(law, 60.0)
    assert z == pytest.approx(60.0, rel=0.08)
    assert z == law(at)


def test_what_cannot_be_made_strong_enough_is_as_strong_as_it_can_be():
    assert strength(lambda s: 5.0 * s, 60.0) == (1.0, 5.0)


# --- truth --------------------------------------------------------------------------------------------------------


def test_a_trial_has_the_z_that_was_drawn_for_it_and_is_the_same_every_time():
    trial, again = (drawn(Key(3, "below", "feedthrough", 1)) for _ in range(2))
    assert 0.25 < trial.z[0] < 3.3
    assert trial.expected[0].parameters == trial.physics[0].values
    assert (again.rig, again.physics, again.z, again.seed) == (trial.rig, trial.physics, trial.z, trial.seed)
    assert np.array_equal(again.training[0].u, trial.training[0].u)


def test_a_law_too_fast_for_a_coarse_grid_has_its_z_on_that_of_the_recordings():
    """On two steps a sample this one seemed to show with z 27 where its poles are far above the rate."""
    trial = drawn(Key(25, "single", "resonance", 0))
    there = Sensed(trial, steps=SUBSTEPS).z(trial.physics[0])
    assert there == pytest.approx(trial.z[0], rel=0.01)
    assert trial.physics[0].values["w_n"] < 3e5


def test_physics_outside_the_library_has_a_stage_and_no_name():
    trial = drawn(Key(3, "outside", "echo", 0))
    assert trial.expected == ()
    assert [(finding.id, finding.stage) for finding in trial.unheard] == [("echo", "G2")]


def test_physics_glares_where_that_is_asked_for():
    """The same rig and the same runs as without, and its key tells."""
    usual, glaring = Key(3, "single", "feedthrough", 0), Key(3, "single", "feedthrough", 0, (3e3, 1e4))
    faint, bright = drawn(usual), drawn(glaring)
    assert 2.8e3 < bright.z[0] < 1.1e4
    assert bright.rig == faint.rig
    assert np.array_equal(bright.training[0].u, faint.training[0].u)
    assert glaring.text == "3/single/feedthrough/0/z=3000..10000"


def test_a_pair_has_two_stages_and_can_be_recorded():
    trial = drawn(Key(3, "pair", "pair", 0), ("feedthrough", "saturation", "dead_time"))
    assert len({finding.stage for finding in trial.expected}) == 2
    short_trial = replace(trial, training=trial.training[3:4], held_out=())
    assert all(np.all(np.isfinite(run.y)) for run in record(short_trial, 4))


def test_no_piece_of_a_pair_keeps_readings_from_where_the_other_would_show():
    """A border that bends inward kept all readings from a clipped range but one: both are drawn again."""
    trial = drawn(Key(25, "pair", "pair", 9))
    clipped, bent = trial.physics
    assert [finding.id for finding in trial.expected] == ["adc_clipping", "curved_border"]
    assert Sensed(trial).z_with((bent,), clipped) > 15.0
    assert Sensed(trial).z_with((clipped,), bent) > 15.0


def test_a_seal_fixes_the_truth_and_does_not_tell_it():
    trial = drawn(Key(3, "null", "null", 0))
    truth, other = sealed(trial), sealed(trial)
    assert truth.text == other.text
    assert truth.seal != other.seal
    assert Sealed(truth.text, truth.salt).seal == truth.seal
    assert Sealed(truth.text.replace("null", "pair"), truth.salt).seal != truth.seal
    assert json.loads(truth.text)["laws"] == []


def test_readings_are_the_same_on_the_grid_of_the_sizes_as_far_as_z_goes():
    u, noise_v = PLAYED[1].u, 1e-3
    coarse, fine = (answer(RC, u, Grid(1e4, u.size, n)) for n in (2, 32))
    assert np.sqrt(np.mean((coarse - fine) ** 2)) < noise_v


def test_what_chance_puts_together_is_of_its_stage_and_clear_and_the_same_when_drawn_again():
    for stage in STAGES:
        trial = drawn(Key(7, "composed", stage, 0))
        (finding,), (law,), (z,) = trial.unheard, trial.physics, trial.z
        assert finding.stage == stage
        assert finding.id == law.name
        assert WHAT[law.name.partition(" by ")[0]][0] == stage
        assert 30.0 < z < 3300.0
        assert drawn(trial.key).physics == trial.physics
    assert {k.about for k in islice(plan(7, ("composed",), ()), 2 * len(STAGES))} == set(STAGES)
