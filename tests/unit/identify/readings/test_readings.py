"""Are spikes, lost readings and steps of the ADC found where they are, and nowhere else?"""

import sys
from dataclasses import replace

import numpy as np
import pytest

from identify.chain import plain_chain, simulate
from identify.colour import Colour, whitening
from identify.effects import catalogue
from identify.effects.effect import Confusion, short
from identify.explain.explain import explain
from identify.explain.hidden import counts_another, hides_noise, loses, lost_no_more, suspected
from identify.explain.of_readings import finding
from identify.explain.plain import prepared
from identify.explain.readings import Look, read, reread
from identify.holdout import settling_s, split
from identify.interval import Interval
from identify.noise import good
from identify.readings import blemishes
from identify.readings.blemish import Blemish
from identify.readings.coloured_noise import (
    Coloured,
    ColouredNoise,
    against_repeats,
    coloured_noise,
    in_repeats,
    told_by,
)
from identify.readings.grid import COARSE, adc_steps
from identify.readings.mend import answer, mended
from identify.readings.missing_samples import MissingSamples, loss_in, with_gap
from identify.readings.outliers import FarOut, far_out, outliers
from identify.readings.spectra import lines_of, power_of, spectra
from identify.readings.spikes import Spikes, spikes
from identify.readings.stray import StrayReadings, stray
from identify.stage import Place
from identify.trace import Step, Trace
from tests.contract.test_effects import STAGES, UNITS
from tests.proof.ask import known_effects, parted
from tests.proof.bench import record
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.proof.trial import Key, drawn
from tests.trials import model_of, recorded

NOISE_V = OP_AMP.noise_v
SPIKED = {"rate": 20.0, "size": 0.2}
STAIRS = staircase("stairs", FIG13_LEVELS_V, 0.05, 2)
SINE = sine("sine", 10.0, 3.4, 5, 2)
CHAIN = plain_chain(model_of(OP_AMP))


def recording(*physics, stimulus=STAIRS, seed=5, start_s=3.0):
    trace = recorded(OP_AMP, stimulus, physics, NOISE_V, seed, start_s, 4)
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in stimulus.segments)
    return replace(trace, steps=steps)


def noise_of(trace):
    return trace.y - simulate(CHAIN, trace, 4)


@pytest.mark.parametrize("kind", blemishes().values(), ids=lambda kind: kind.id)
def test_a_blemish_tells_its_story_as_an_effect_does(kind: type[Blemish]):
    assert {place.label for place in kind.places} <= set(STAGES[kind.id].split())
    assert kind.sentence.format("4.2 mV").endswith(".")
    assert all(p.unit in UNITS and p.name.startswith(f"{kind.id}.") for p in kind.declared)
    assert all(short(p.name) in kind.equation for p in kind.declared)
    assert all(isinstance(c, Confusion) and c.id in STAGES for c in kind.confused_with)
    assert kind.confused_with


@pytest.mark.parametrize("stimulus", [STAIRS, SINE], ids=lambda stimulus: stimulus.name)
def test_clean_readings_have_no_blemish(stimulus):
    for seed in range(4):
        clean = recording(stimulus=stimulus, seed=seed)
        assert mended(CHAIN, [clean], [], NOISE_V).found == ()


def test_spikes_are_counted_measured_and_left_out():
    spiked = recording(Concealed("spikes", {"rate": 20.0, "size": 0.09}))
    (found,), threshold = spikes(far_out([outliers(spiked, noise_of(spiked))]), [])
    assert found.p_value < 1e-12
    assert found.values["rate"].low < 20.0 < found.values["rate"].high
    assert found.values["size"].low < 0.09 < found.values["size"].high
    assert found.values["size"].high - found.values["size"].low < 0.01
    told = mended(CHAIN, [spiked], [], NOISE_V)
    left_out = np.flatnonzero(~told.training[0].valid)
    assert left_out.size == outliers(spiked, noise_of(spiked)).beyond(threshold).size
    assert np.abs(noise_of(spiked)[left_out]).min() > 0.04


def test_the_tail_of_the_noise_does_not_make_large_spikes_smaller():
    def far(size, tail, sd_v):
        y = np.concatenate([np.full(40, size / sd_v), np.full(6, tail)])
        seen = outliers(recording(), np.zeros(recording().size))
        return replace(seen, off_v=_apart(y) * sd_v, far=_apart(y), sd_v=sd_v)

    def _apart(sizes):
        out = np.zeros(recording().size)
        out[563 * np.arange(sizes.size) + 3] = sizes
        return out

    (found,), _ = spikes(far_out([far(0.4, 4.6, 0.02), far(0.4, 4.6, 0.03)]), [])
    assert found.values["size"].value == pytest.approx(0.4, rel=6e-3)


def test_readings_lost_beside_physics_are_held_until_that_is_explained():
    """A sag of the source stands against a close look: the plain model is not in time on either side of the loss."""
    sag = Concealed("input_ac_coupling", {"tau": 20.0})
    runs = [recording(sag, seed=1), recording(sag, Concealed("missing_samples", {"position": 3.4, "count": 9.0}),
                                              stimulus=SINE, seed=2)]  # fmt: skip
    model = model_of(OP_AMP)
    _, plain = prepared(model, split(model, runs, []))
    assert mended(plain.fit.chain, runs, [], NOISE_V).found == ()
    doubted, held = (read(model, runs, [], lambda data: prepared(model, data), Look(held=h)) for h in (False, True))
    assert doubted.found == ()
    assert [loss.id for loss in doubted.doubtful] == ["missing_samples"]
    (loss,) = held.found
    assert loss.id == "missing_samples"
    assert loss.values["position"].value == pytest.approx(3.4, abs=0.05)  # half a period
    assert held.plain.misfit < 0.5 * plain.misfit
    sagging = catalogue()["input_ac_coupling"](Place.SOURCE).put_in(CHAIN, {"tau": 20.0})
    assert [loses(held, chain, ()) for chain in (plain.fit.chain, sagging)] == [False, True]
    assert not loses(held, sagging, ("missing_samples",))
    assert not counts_another(held, held)
    more = MissingSamples({**loss.values, "count": Interval(10.0, 10.0, 10.0)}, loss.p_value, loss.where)
    assert counts_another(held, replace(held, found=(more,)))
    assert counts_another(held, replace(held, found=()))
    law, fit = catalogue()["input_ac_coupling"](Place.SOURCE), replace(held.plain.fit, chain=sagging)
    told = replace(held.plain, effects=(law,), fit=fit, chi2=float(held.plain.count))
    assert not lost_no_more(held, told, ())
    whole = replace(held, traces=(runs[0], recording(sag, stimulus=SINE, seed=2)))
    assert lost_no_more(whole, told, ())  # what had looked like a loss to the plain model
    little = told.count + 0.2 * (held.plain.chi2 - told.count)
    assert not lost_no_more(whole, replace(told, chi2=little), ())
    assert not lost_no_more(whole, replace(told, effects=()), ())
    assert not lost_no_more(replace(whole, found=()), told, ())


def test_as_many_readings_are_put_back_as_were_lost_though_the_loss_has_led_the_model_astray():
    """Of six lost, a model that is late by half of them tells three, then of four tells five, and stays there."""
    case = drawn(Key(65, "single", "missing_samples", 1), known_effects())
    model = model_of(case.nominal)
    seen = read(model, *parted(record(case)), lambda data: prepared(model, data), Look())
    assert [loss.values["count"].value for loss in seen.found] == [case.expected[0].parameters["count"]] == [6.0]


def test_a_model_is_fitted_to_what_came_before_a_loss_where_that_is_half_of_all():
    lost = Concealed("missing_samples", {"position": 3.4, "count": 9.0})
    runs = [recording(seed=1), recording(lost, stimulus=SINE, seed=2)]
    rough = mended(CHAIN, runs, runs[1:], NOISE_V, rough=True)
    before = rough.in_time()
    counted = [int(np.count_nonzero(good(trace))) for trace in (*before.training, *before.proof)]
    at = round((3.4 - runs[1].start_s) * runs[1].rate_hz)
    assert counted == [runs[0].size, pytest.approx(at, abs=500), pytest.approx(at, abs=500)]  # half a period
    early = mended(CHAIN, runs[1:], [], NOISE_V, rough=True)
    assert early.found
    assert early.in_time() is early
    assert mended(CHAIN, runs[:1], [], NOISE_V).in_time().training[0].size == runs[0].size


def test_a_loss_before_the_last_edge_is_told_where_nothing_else_is_left():
    """One edge behind it is too little to be sure that both sides are in time; once mended, nothing is left."""
    run, model = recording(Concealed("missing_samples", {"position": 5.53, "count": 6.0})), model_of(OP_AMP)
    assert mended(CHAIN, [run], [], NOISE_V).found == ()
    seen = read(model, [run], [], lambda data: prepared(model, data), Look())
    told = [reread(seen, CHAIN, (), (), settled).found for settled in (True, False)]
    assert [[b.id for b in found] for found in told] == [["missing_samples"], []]
    assert told[0][0].values["count"].value == 6.0


def test_the_colour_of_a_noise_is_in_the_differences_of_repeats_and_that_of_physics_is_not():
    law, settle_s = Coloured(NOISE_V, 0.006, 1.2), settling_s(model_of(OP_AMP))
    noisy = recording(Concealed("coloured_noise", {"sd": 0.006, "slope": 1.2}), stimulus=SINE)
    sagging = recording(Concealed("leak", {"rate": 0.5}), stimulus=SINE)
    assert in_repeats(law, spectra([noisy], settle_s))
    assert not in_repeats(law, spectra([sagging], settle_s))
    assert not in_repeats(law, spectra([recording(stimulus=SINE)], settle_s))
    assert not in_repeats(law, [])
    assert against_repeats(law, spectra([recording(stimulus=SINE)], settle_s))
    assert not against_repeats(law, spectra([noisy], settle_s))
    assert not against_repeats(law, [])


@pytest.mark.parametrize(("sd_v", "hidden"), [(0.006, True), (0.0, False)])
def test_noise_that_a_model_leaves_is_hidden_in_it_where_repeats_have_its_colour(sd_v, hidden, monkeypatch):
    noise, model = Concealed("coloured_noise", {"sd": sd_v, "slope": 1.2}), model_of(OP_AMP)
    runs = [recording(noise, stimulus=stimulus, seed=seed) for seed, stimulus in enumerate((STAIRS, SINE))]
    seen = read(model, runs, [], lambda data: prepared(model, data), Look((ColouredNoise.id,)))
    assert hides_noise(seen, seen.bench, seen.plain, ()) is hidden
    assert not hides_noise(seen, seen.bench, seen.plain, (ColouredNoise.id,))
    assert (suspected(seen, ()) > 60.0) is hidden
    assert suspected(seen, (ColouredNoise.id,)) == 0.0
    monkeypatch.setattr("identify.explain.hidden.against_repeats", lambda noise, seen: True)
    assert suspected(seen, ()) == 0.0


def test_noise_that_repeats_are_too_few_to_tell_is_told_where_no_law_explains_as_much(monkeypatch):
    monkeypatch.setattr("identify.explain.readings.coloured_noise", lambda training, proof, settle_s: None)
    monkeypatch.setattr(sys.modules[explain.__module__], "hides_noise", lambda *told: False)
    noise = Concealed("coloured_noise", {"sd": 0.006, "slope": 1.2})
    runs = [recording(noise, stimulus=stimulus, seed=seed) for seed, stimulus in enumerate((STAIRS, SINE))]
    tried = {"offset_drift", "gain_drift", "hum", "process_noise", "ac_coupling", "feedthrough", "extra_pole",
             "saturation", "plateau_droop", *blemishes()}  # fmt: skip
    (finding,) = explain(model_of(OP_AMP), runs, leave_out=sorted(known_effects() - tried)).effects
    assert finding.id == "coloured_noise"
    assert finding.parameters["sd"][0].low < 0.006 < finding.parameters["sd"][0].high


@pytest.mark.parametrize(("drift_v", "told"), [(0.0, ["coloured_noise"]), (0.03, [])])
def test_noise_that_is_less_than_what_is_left_is_not_told(monkeypatch, drift_v, told):
    """Physics that goes on from repeat to repeat may pass for noise in their differences."""
    monkeypatch.setattr("identify.explain.readings._noisy", lambda readings, chain: True)
    run, model = recording(stimulus=SINE), model_of(OP_AMP)
    run = replace(run, y=run.y + drift_v * np.linspace(-1.0, 1.0, run.size))
    seen = read(model, [run], [], lambda data: prepared(model, data), Look((ColouredNoise.id,)))
    small = {"sd": Interval(1e-3, 5e-4, 2e-3), "slope": Interval(1.0, 0.8, 1.2)}
    noise = ColouredNoise(small, 1e-9)
    found = reread(replace(seen, found=(noise,)), CHAIN, (), (), False).found
    assert [blemish.id for blemish in found] == told


def test_noise_beside_an_unnamed_law_is_no_likelier_than_not_and_other_blemishes_are_what_they_are():
    """What makes the rest may have made what looks like noise; a spike is a spike."""
    noise = ColouredNoise({"sd": Interval(1e-3, 5e-4, 2e-3), "slope": Interval(1.0, 0.8, 1.2)}, 0.0)
    spike = Spikes({"rate": Interval(1.0, 0.5, 2.0), "size": Interval(0.1, 0.09, 0.11)}, 0.0)
    assert [finding(noise, beside).probability for beside in (False, True)] == [0.95, 0.5]
    assert [finding(spike, beside).probability for beside in (False, True)] == [0.95, 0.95]


def test_readings_that_stand_still_on_a_coarse_grid_have_no_noise_to_be_coloured():
    still = replace(recording(), y=np.zeros(STAIRS.u.size))
    assert coloured_noise([still], [], settling_s(model_of(OP_AMP))) is None


@pytest.mark.parametrize("rough", [False, True])
def test_a_delay_by_a_part_of_a_sample_is_no_loss_of_nine_periods(rough):
    at = np.arange(16000)
    rng, turn = np.random.default_rng(2), 2.0 * np.pi / (1000.0 / 13.0)
    answer, late = np.sin(turn * at), np.sin(turn * (at - 0.3))  # nine periods are 692.3 samples
    sine = Trace("fast", 1e4, answer, late + rng.normal(0.0, 0.01, at.size))
    assert loss_in(sine, answer, 0.01, rough) is None
    lost = replace(sine, y=np.concatenate((sine.y[:5000] - late[:5000] + answer[:5000], answer[5020:], answer[:20])))
    assert rough or loss_in(lost, answer, 0.01) is not None


def test_a_delay_that_comes_in_midway_is_no_loss_of_many_periods():
    """A part that warms: from the sample 7000 on a third of a sample later, as if 692 were lost there."""
    at = np.arange(16000)
    rng, turn = np.random.default_rng(2), 2.0 * np.pi / (1000.0 / 13.0)
    answer, late = np.sin(turn * at), np.sin(turn * (at - 0.3 * (at > 7000)))
    sine = Trace("fast", 1e4, answer, late + rng.normal(0.0, 0.01, at.size))
    assert loss_in(sine, answer, 0.01, rough=True) is None
    chirp = np.sin(turn * at * (1.0 + at / 16000.0))  # comes again nowhere: there a loss of as many is one
    lost = np.concatenate((chirp[:7000], chirp[7692:], np.full(692, chirp[-1]))) + rng.normal(0.0, 0.01, at.size)
    found = loss_in(Trace("chirp", 1e4, chirp, lost), chirp, 0.01, rough=True)
    assert found is not None
    assert found.count == 692


def test_what_a_coarse_adc_leaves_is_no_loss():
    """A few readings are off there, each by a whole step: moved by whole periods of the sine, fewer are."""
    case = drawn(Key(61, "single", "adc_quantisation", 1), known_effects())
    model = model_of(case.nominal)
    data = split(model, *parted(record(case)))
    bench, plain = prepared(model, data)
    traces = [o.trace for o in bench.observations]
    answers = [answer(plain.fit.chain, trace, data.noise.rms_v) for trace in traces]
    assert [loss_in(trace, own, data.noise.rms_v, rough=True) for trace, own in zip(traces, answers, strict=True)] == (
        [None] * len(traces)
    )


def test_one_spike_far_out_is_enough():
    once = recording()
    y = once.y.copy()
    y[4321] += 0.2
    told = mended(CHAIN, [replace(once, y=y)], [], NOISE_V)
    assert [b.id for b in told.found] == ["spikes"]
    assert not told.training[0].valid[4321]


@pytest.mark.parametrize(("seed", "without"), [
    (41, ()), (75, ("staircase_small", "sine_medium", "minor_loops", "sine_stuck", "staircase_again"))
])  # fmt: skip
def test_spikes_that_made_the_noise_look_larger_are_told_where_what_is_left_may_be_noise(seed, without):
    """Repeats of 4444 readings tell the variance to two per cent: as much is half of what the spike is without it.

    Of 3500 they told one that is four per cent too small (seed 75).
    """
    case = drawn(Key(seed, "single", "spikes", 0), known_effects())
    train, test = parted(record(case))
    told = explain(model_of(case.nominal), [trace for trace in train if trace.name not in without], test)
    assert (told.verdict, [finding.id for finding in told.effects]) == ("explained", ["spikes"])


def test_spikes_on_readings_that_rest_count_as_those_that_move_do():
    """How fast readings move is a running sum, whose rounding is no speed below zero."""
    trial = drawn(Key(105, "single", "spikes", 0))  # 16 standard deviations, 20 of them a second
    train, test = parted(record(trial))
    model = model_of(trial.nominal)
    chain = plain_chain(model_of(trial.rig))
    seen = [outliers(trace, trace.y - answer(chain, trace, trial.rig.noise_v)) for trace in (*train, *test)]
    assert min(float(np.min(one.moves)) for one in seen) == 0.0
    found = read(model, train, test, lambda data: prepared(model, data), Look())
    assert [blemish.id for blemish in found.found] == ["spikes"]


def test_spikes_that_are_in_the_repeats_wait_for_nothing_once_they_are_left_out():
    """They made the noise look larger than all that is left: nothing that they hid is worth waiting for."""
    trial = drawn(Key(106, "single", "spikes", 0))  # 46 standard deviations, 3 of them a second
    train, test = parted(record(trial))
    model = model_of(trial.nominal)
    found = read(model, train, test, lambda data: prepared(model, data), Look())
    assert found.before.misfit < 0.0
    assert [blemish.id for blemish in found.found] == ["spikes"]


def test_the_tail_of_a_louder_noise_is_no_spike_of_every_fifth_reading():
    """Most of such spikes would lie where nothing is seen of them: a scatter in time was told as one a reading."""
    seen = outliers(recording(), np.zeros(recording().size))
    far, out = np.zeros(recording().size), 563 * np.arange(25) + 3
    far[out] = 4.5 + np.random.default_rng(1).exponential(0.3, out.size)  # of noise three times as loud as elsewhere
    tail = FarOut([replace(seen, off_v=3.0 * 0.02 * far, far=far, sd_v=0.02)], 4.5, [out], far.size, 1e-12)
    assert spikes(tail, []) == ((), float("inf"))
    (found,), _ = spikes(replace(tail, runs=[replace(tail.runs[0], off_v=0.04 * far, far=2.0 * far)]), [])
    assert found.values["rate"].value < 0.01 * recording().rate_hz


def test_what_every_repeat_shows_is_no_spike():
    """A glitch of the DAC comes at the same place of every walk."""
    glitchy = recording()
    y = glitchy.y.copy()
    y[[777 + step.start for step in glitchy.steps]] += 0.3
    assert mended(CHAIN, [replace(glitchy, y=y)], [], NOISE_V).found == ()


def test_a_scatter_in_time_makes_no_spikes_and_hides_none():
    """What is read too early or too late by chance is far off where readings move fast, and nowhere else."""
    late, thrown = Concealed("jitter", {"sd": 1e-3}), Concealed("spikes", {"rate": 60.0, "size": 0.2})
    scattered, both = recording(late), recording(late, thrown)
    assert outliers(scattered, noise_of(scattered)).beyond(5.5).size > 3
    assert spikes(far_out([outliers(scattered, noise_of(scattered))]), []) == ((), float("inf"))
    (found,), _ = spikes(far_out([outliers(both, noise_of(both))]), [])
    assert found.values["size"].value == pytest.approx(0.2, rel=0.05)


def test_readings_that_are_the_one_before_once_more_are_off_by_a_sample():
    wave = sine("wave", 20.0, 5.0, 30, 2)
    stale = recording(Concealed("stale_reading", {"share": 0.003}), stimulus=wave)
    clean = recording(stimulus=wave, seed=6)
    seen, proof = (outliers(trace, noise_of(trace)) for trace in (stale, clean))
    (found,), threshold = stray(far_out([seen]), [seen])
    assert found.values["off"].low < 1.0 / stale.rate_hz < found.values["off"].high
    assert found.values["rate"].value < 0.003 * stale.rate_hz  # at rest none is seen
    first = np.arange(stale.size) == seen.beyond(threshold)[0]
    resting = replace(seen, moves=np.where(first, 0.0, seen.moves))  # how late it was taken nobody can say
    (found,), _ = stray(far_out([resting]), [resting])
    assert found.values["off"].low < 1.0 / stale.rate_hz < found.values["off"].high < np.inf
    assert stray(far_out([seen]), [proof]) == ((), float("inf"))
    assert spikes(far_out([seen]), [seen]) == ((), float("inf"))
    again = mended(CHAIN, [stale], [], NOISE_V)
    assert [type(one) for one in again.found] == [StrayReadings]
    assert np.count_nonzero(~good(again.training[0])) == seen.beyond(threshold).size
    assert mended(CHAIN, [stale], [], NOISE_V, ("unnamed",)).found == ()


def test_readings_that_are_the_one_before_once_more_are_told_though_none_move_faster():
    """By that each is as far off as the reading before it is; spikes of those sizes are so by no chance."""
    stale = recording(Concealed("stale_reading", {"share": 0.003}), stimulus=sine("wave", 20.0, 5.0, 30, 2))
    seen = outliers(stale, noise_of(stale))
    even = replace(seen, moves=np.full(stale.size, np.median(seen.moves)))
    (found,), threshold = stray(far_out([even]), [even])
    assert (found.form, threshold < np.inf) == ("stray readings", True)
    thrown = replace(even, off_v=even.off_v * np.where(np.arange(stale.size) % 2, 1.0, -1.0))
    assert stray(far_out([thrown]), [thrown]) == ((), float("inf"))
    (told,), _ = spikes(far_out([thrown]), [thrown])
    assert told.id == "spikes"


def test_a_loss_that_shows_to_a_rough_look_alone_is_told_where_it_is_all_that_is_left():
    """Six readings lost where little moves, beside steps of the DAC that hid them from the first looks."""
    trial = drawn(Key(95, "pair", "pair", 0))
    train, test = parted(record(trial))
    few = [trace for trace in train if trace.name in ("minor_loops", "sine_stuck", "staircase_small")]
    tried = {"dac_quantisation", "source_nonlinearity", "saturation", "extra_pole", "dead_time",
             "dielectric_absorption", "feedthrough", "hum", *blemishes()}  # fmt: skip
    told = explain(model_of(trial.nominal), few, test[:1], leave_out=sorted(known_effects() - tried))
    assert told.verdict == "explained"
    assert [f.id for f in told.effects] == ["dac_quantisation", "missing_samples"]
    assert told.effects[1].parameters["count"][0].value == 6.0


def test_lost_readings_beside_physics_are_told_once_that_is_known():
    """36,000 standard deviations of lost readings hide 15,000 of a coupling capacitor, and that hides them."""
    trial = drawn(Key(101, "pair", "pair", 1, (1e3, 5e4)), known_effects())
    train, test = parted(record(trial))
    few = [trace for trace in train if trace.name in ("staircase", "sine_medium")]
    told = explain(model_of(trial.nominal), few, test[:1])
    assert (told.verdict, {f.id for f in told.effects}) == ("explained", {"input_ac_coupling", "missing_samples"})


def test_spikes_come_at_any_speed_and_are_no_stray_readings():
    spiked = recording(Concealed("spikes", {"rate": 30.0, "size": 0.2}))
    assert stray(far_out([outliers(spiked, noise_of(spiked))]), []) == ((), float("inf"))


def test_stale_readings_are_told_and_hide_neither_the_noise_nor_that_nothing_else_is_missing():
    """Repeats differ by them, too: the noise is told too large with them in it, and the verdict was that all agree."""
    stale, wave = Concealed("stale_reading", {"share": 0.01}), sine("wave", 20.0, 5.0, 10, 4)
    walk, *waves = (
        recording(stale, stimulus=stimulus, seed=i, start_s=20.0 * i) for i, stimulus in enumerate((STAIRS, wave, wave))
    )
    told = explain(model_of(OP_AMP), [walk, waves[0]], waves[1:])
    assert told.verdict == "unexplained"
    assert [(f.id, f.form, f.stage) for f in told.effects] == [("unnamed", "stray readings", "sense")]
    assert told.noise.rms_v == pytest.approx(NOISE_V, rel=0.04)


def test_spikes_that_the_held_out_readings_contradict_are_not_told():
    spiked = recording(Concealed("spikes", {"rate": 30.0, "size": 0.2}))
    clean = recording(seed=6)
    seen, proof = (outliers(trace, noise_of(trace)) for trace in (spiked, clean))
    assert spikes(far_out([seen]), [seen])[0]
    assert spikes(far_out([seen]), [proof]) == ((), float("inf"))


@pytest.mark.parametrize("count", [1.0, 7.0, 60.0])
@pytest.mark.parametrize("stimulus", [STAIRS, SINE], ids=lambda stimulus: stimulus.name)
def test_lost_readings_are_counted_and_put_back_as_a_gap(stimulus, count):
    position_s = 3.0 + 0.4003
    short_of = recording(Concealed("missing_samples", {"position": position_s, "count": count}), stimulus=stimulus)
    told = mended(CHAIN, [short_of], [], NOISE_V)
    (found,) = told.found
    assert found.id == "missing_samples"
    assert found.values["count"].value == count
    assert found.values["position"].low <= position_s <= found.values["position"].high
    left = noise_of(told.training[0])[told.training[0].valid]
    assert np.sqrt(np.mean(left**2)) < 1.1 * NOISE_V


@pytest.mark.parametrize(
    ("what", "values"), [("clock_skew", {"ppm": 200.0}), ("dead_time", {"delay": 3e-4}), ("gain_drift", {"rate": 0.01})]
)
def test_what_is_no_step_of_the_time_axis_is_no_loss(what, values):
    trace = recording(Concealed(what, values))
    assert loss_in(trace, simulate(CHAIN, trace), NOISE_V) is None


def test_a_gap_keeps_length_and_stimulus():
    trace = Trace("a", 10.0, np.arange(6.0), np.arange(6.0), start_s=1.0)
    gap = with_gap(trace, 2, 3)
    assert gap.y.tolist() == [0.0, 1.0, 1.25, 1.5, 1.75, 2.0]
    assert gap.valid.tolist() == [True, True, False, False, False, True]
    assert (gap.u.tolist(), gap.start_s) == (trace.u.tolist(), 1.0)


LONG = sine("long", 10.0, 3.4, 20, 2)


@pytest.mark.parametrize(("sd_v", "slope"), [(0.02, 1.0), (0.03, 1.8)])
def test_coloured_noise_is_measured_and_made_white(sd_v, slope):
    settle_s = settling_s(model_of(OP_AMP))
    training, proof = (
        [recording(Concealed("coloured_noise", {"sd": sd_v, "slope": slope}), stimulus=LONG, seed=s, start_s=at)
         for s, at in pairs] for pairs in (((1, 0.0), (2, 9.0), (3, 18.0)), ((4, 30.0),))
    )  # fmt: skip
    noise = coloured_noise(training, proof, settle_s)
    told = noise.blemish.values
    assert told["sd"].low < sd_v < told["sd"].high
    assert told["slope"].low < slope < told["slope"].high
    assert noise.white_v == pytest.approx(NOISE_V, rel=0.05)
    white = whitening(noise.colour(training[0]))
    every = np.ones(1000, dtype=bool)
    pieces = [white(e / noise.rms_v, every) for e in np.split(noise_of(training[0]), LONG.u.size // 1000)]
    left = np.concatenate(pieces)
    assert np.std(left) == pytest.approx(1.0, abs=0.05)
    sums = left.reshape(-1, 100).sum(axis=1) / 10.0
    assert 0.6 < np.std(sums) < 1.4
    coloured_sums = noise_of(training[0]).reshape(-1, 100).sum(axis=1) / 10.0 / noise.rms_v
    assert np.std(coloured_sums) > 2.5


@pytest.mark.parametrize(
    "physics", [(), (Concealed("gain_drift", {"rate": 0.01}),), (Concealed("clock_skew", {"ppm": 200.0}),),
                (Concealed("process_noise", {"sd": 0.05, "bandwidth": 300.0}),)],
    ids=["white", "drift", "skew", "noise before the gap"],
)  # fmt: skip
def test_what_is_no_power_law_is_no_coloured_noise(physics):
    traces = [recording(*physics, stimulus=LONG, seed=seed, start_s=9.0 * seed) for seed in (1, 2)]
    assert coloured_noise(traces, [], settling_s(model_of(OP_AMP))) is None


def test_what_some_recordings_have_and_others_have_not_is_no_coloured_noise():
    settle_s, noise = settling_s(model_of(OP_AMP)), Concealed("coloured_noise", {"sd": 0.004, "slope": 1.0})
    every = [recording(noise, stimulus=LONG, seed=seed, start_s=9.0 * seed) for seed in (1, 2, 3)]
    some = [*every[:2], recording(stimulus=LONG, seed=3, start_s=27.0)]
    assert coloured_noise(every, [], settle_s) is not None
    assert told_by(spectra(some, settle_s), (), lambda noise: 0.0) is not None  # as one law it looks like such noise
    assert coloured_noise(some, [], settle_s) is None


def test_what_comes_in_bursts_is_no_coloured_noise_though_its_spectrum_looks_so():
    """A contact that opens at moments of its own: most of the time nothing is wrong."""
    lost = Concealed("lost_contact", {"rate": 20.0, "length": 3e-4})
    traces = [recording(lost, stimulus=LONG, seed=seed, start_s=9.0 * seed) for seed in (1, 2)]
    assert coloured_noise(traces, [], settling_s(model_of(OP_AMP))) is None


def test_a_ladder_is_run_piece_by_piece_as_in_one():
    colour = Colour(gain=1.3, ladder=((0.99, 0.9), (0.9, 0.5)))
    values, use = np.random.default_rng(1).normal(size=(60, 2)), np.arange(60) % 7 > 0
    whole = whitening(colour)(values, use)
    pieces = whitening(colour)
    assert np.allclose(whole, np.concatenate([pieces(values[:25], use[:25]), pieces(values[25:], use[25:])]))
    assert np.allclose(whole[:, 0], whitening(colour)(values[:, 0], use))
    assert not colour.white
    there, pieces = use & (np.abs(np.arange(60) - 30) > 10), whitening(colour)  # no reading at all in the middle one
    parts = [pieces(values[a:b], there[a:b]) for a, b in ((0, 20), (20, 41), (41, 60))]
    assert np.allclose(whitening(colour)(values, there), np.concatenate(parts))


def test_noise_that_a_run_begins_with_is_no_jump():
    """A level that was there before the run is as slow as noise can be, lost readings at the start or not."""
    colour, use = Colour(gain=1.3, ladder=((0.99, 0.9), (0.9, 0.5))), np.arange(60) > 4
    level = np.where(use, 3.0, 0.0)
    assert whitening(colour)(level, use) == pytest.approx(np.full(55, 3.0 / colour.slow))
    assert whitening(colour)(np.full((60, 2), 3.0), np.ones(60, dtype=bool)) == pytest.approx(3.0 / colour.slow)


@pytest.mark.parametrize(("sd_v", "slope"), [(0.3, 1.8), (0.02, 1.0)])
def test_a_run_that_begins_amid_noise_is_white_from_its_first_reading_on(sd_v, slope):
    """Whether the noise towers above the white one or drowns in it: neither's first reading tells the other's level."""
    noise, size = Coloured(0.1, sd_v, slope), 20_000
    run = Trace("run", 1e4, np.zeros(size), np.zeros(size))
    power = power_of(lines_of(run), lines_of(run), noise.white_v, noise.sd_v, noise.slope)
    begins = []
    for seed in range(40):
        lines = np.fft.rfft(np.random.default_rng(seed).normal(size=size))[1:] * np.sqrt(power)
        e = np.roll(np.fft.irfft(np.concatenate(([0.0], lines)), size), seed * 431)
        begins.append(whitening(noise.colour(run))(e / noise.rms_v, np.ones(size, dtype=bool))[:2000])
    assert np.mean(np.square(begins)) == pytest.approx(1.0, abs=0.1)
    levels = np.mean(np.array(begins).reshape(40, 10, 200), axis=2) * np.sqrt(200.0)
    assert np.mean(np.square(levels)) < 2.0


def test_where_readings_wander_from_one_to_the_next_none_is_thrown_off():
    """About a median that is mostly the reading itself all others seem far: 486 spikes beside noise at the gap."""
    wanders, thrown = Concealed("process_noise", {"sd": 0.3, "bandwidth": 3000.0}), Concealed("spikes", SPIKED)
    for physics, found in (((wanders,), 0), ((thrown,), 1)):
        trace = recording(*physics)
        assert len(spikes(far_out([outliers(trace, noise_of(trace))]), [])[0]) == found


def test_steps_of_the_adc_are_told_when_they_matter_against_the_noise():
    def rounded(lsb):
        return adc_steps([recording(Concealed("adc_quantisation", {"lsb": lsb}))], NOISE_V)

    (found,) = rounded(0.008)
    assert found.values["LSB"].value == pytest.approx(0.008, rel=1e-9)
    assert "they add 5.3 % to the power of the noise" in found.where  # 0.008^2 / 12 over 0.01^2
    assert len(rounded(0.1 * NOISE_V)) == 1
    assert rounded(0.9 * COARSE * NOISE_V) == ()
    assert adc_steps([recording()], NOISE_V) == ()


def test_what_is_left_out_of_the_catalogue_is_not_looked_for():
    spiked = recording(Concealed("spikes", {"rate": 20.0, "size": 0.2}))
    assert mended(CHAIN, [spiked], [], NOISE_V, ("spikes",)).found == ()


def test_how_far_noise_takes_readings_is_told_where_they_do_not_wander():
    """Where they follow each other they are their own median: with these in, the scatter was a tenth too small."""
    trace, rng = recording(), np.random.default_rng(4)
    wandering = np.arange(trace.size) % 2000 < 600
    level = 300.0 * NOISE_V * np.sin(2.0 * np.pi * np.arange(trace.size) / 600.0)
    residual = NOISE_V * rng.standard_normal(trace.size) + np.where(wandering, level, 0.0)
    seen = outliers(trace, residual)
    assert seen.sd_v == pytest.approx(NOISE_V, rel=0.03)
    assert np.mean(seen.looked_at & wandering) < 0.2 * np.mean(wandering)
    assert np.mean(seen.looked_at & ~wandering) > 0.7 * np.mean(~wandering)
