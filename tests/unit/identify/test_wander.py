"""Is what noise in front of the gap leaves by chance told from physics that comes back with what is played?"""

import sys
from dataclasses import replace

import numpy as np
import pytest

from identify.chain import simulate
from identify.effects import catalogue, chain_of
from identify.evidence import Evidence
from identify.explain import screen
from identify.explain.bench import Bench
from identify.explain.chance import as_large, scatter_of
from identify.explain.confirm import CERTAIN_FALL
from identify.explain.explain import confirmed, explain
from identify.explain.hypothesis import Hypothesis
from identify.explain.locate import Located, located
from identify.explain.neighbours import settled, spanning
from identify.explain.wander import NEARLY, all_wanders, by_chance, sizing, unrepeated, without_chance
from identify.explain.warrant import Warranted
from identify.fit import chi_squared, fit
from identify.stage import Place
from identify.trace import Step
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

WAY = sys.modules[explain.__module__]  # the package has the function under its name
NOISE_V, SD_V, BANDWIDTH_HZ = 0.01, 0.03, 30.0
WAVE = sine("wave", 10.0, 3.0, 5, 2)
NOISY = catalogue()["process_noise"](Place.G1, "white")
PRESENT = Concealed("process_noise", {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})


def steps_of(segments):
    """Return the steps that a recording says it was played in."""
    return tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in segments)


def seen(physics, segments=WAVE.segments):
    """Return what a wave shows, its periods marked as repeats."""
    return observed(replace(recorded(OP_AMP, WAVE, physics, NOISE_V, fine=8), steps=steps_of(segments)), NOISE_V, 4)


def believed(effects, physics, segments=WAVE.segments) -> bool:
    """Return whether all that is left beside ``effects``, the borders fitted, is taken for chance."""
    run = seen(physics, segments)
    chain = chain_of(model_of(OP_AMP))
    for effect in effects:
        chain = effect.put_in(chain, {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})
    found = fit(chain, [run], fixed=[p.name for p in chain.parameters() if p.name not in ("F.D_L", "F.D_U")])
    chi2 = chi_squared(found.chain, run)
    return all_wanders(Hypothesis(tuple(effects), found, chi2, run.count), (run,))


def test_what_noise_in_front_of_the_gap_leaves_is_its_own_chance():
    assert believed((NOISY,), (PRESENT,))
    assert not believed((), (PRESENT,))  # nothing in the model acts by chance


@pytest.mark.parametrize(("physics", "segments", "may"), [
    pytest.param(Concealed("curved_border", {"k3": 0.01}), WAVE.segments, False, id="repeats tell"),
    pytest.param(Concealed("curved_border", {"k3": 0.01}), (), True, id="nothing tells"),
    pytest.param(Concealed("feedthrough", {"k": 0.04}), WAVE.segments, False, id="repeats and rest tell"),
    pytest.param(Concealed("feedthrough", {"k": 0.04}), (), False, id="rest tells"),
])
def test_what_comes_back_with_the_stimulus_or_drifts_while_f_rests_is_not_chance(physics, segments, may):
    """Each is within what such noise would scatter."""
    assert believed((NOISY,), (physics,), segments) is may


@pytest.mark.parametrize(("physics", "may"), [
    (Concealed("process_noise", {"sd": SD_V, "bandwidth": 300.0}), True),
    (Concealed("scattered_gap", {"sd": SD_V}), False),
], ids=["noise", "turns"])  # fmt: skip
def test_what_no_repeat_brings_back_has_to_drift_as_the_law_makes_it(physics, may):
    """A gap that is another after every turn differs from repeat to repeat, too, but for a whole branch alike."""
    walk = staircase("walk", FIG13_LEVELS_V, 0.05, 2)
    trace = replace(recorded(OP_AMP, walk, (physics,), NOISE_V, fine=8), steps=steps_of(walk.segments))
    run, plain = observed(trace, NOISE_V, 4), chain_of(model_of(OP_AMP))
    held = [p.name for p in plain.parameters() if p.name not in ("F.D_L", "F.D_U")]
    plain = fit(plain, [run], fixed=held).chain
    chain = NOISY.put_in(plain, {"sd": SD_V, "bandwidth": 300.0})
    chain = as_large(chain, NOISY, (run,), chi_squared(plain, run) - run.count)
    chain = fit(chain, [run], fixed=[*held, "process_noise.sd", "process_noise.bandwidth"]).chain
    assert (by_chance(chain, (NOISY,), (run,)) > 0.0) is may


@pytest.fixture(scope="module")
def noisy() -> Bench:
    chain = chain_of(model_of(OP_AMP))
    held = tuple(p.name for p in chain.parameters() if p.name not in ("F.D_L", "F.D_U"))
    return Bench(chain, (seen((PRESENT,)),), held, (type(NOISY),))


def beside(bench: Bench, effect, values) -> Hypothesis:
    """Fit the borders beside an effect that has these values."""
    held = (*bench.fixed, *(p.name for p in effect.parameters()))
    return replace(bench, fixed=held).fitted(effect.put_in(bench.plain, values), (effect,))


def test_what_a_law_makes_by_chance_is_not_held_against_it_and_doubts_what_it_lies_beside(noisy):
    plain = noisy.fitted(noisy.plain, ())
    found = beside(noisy, NOISY, {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})
    raw = sum(chi_squared(found.fit.chain, o) for o in noisy.observations)
    assert raw - found.count > 3.0 * found.count  # its mean is right, and by far not all
    assert found.misfit < 0.3 * (raw / found.count - 1.0)
    assert plain.swell == 1.0 < found.swell
    further = replace(found, chi2=0.9 * found.chi2)
    assert further.fall(found) == pytest.approx(replace(further, swell=1.0).fall(found) / found.swell)
    sized = [NOISY.put_in(found.fit.chain, {"sd": k * SD_V, "bandwidth": BANDWIDTH_HZ}) for k in (0.2, 0.55, 0.65)]
    made = [by_chance(chain, (NOISY,), noisy.observations) for chain in sized]
    assert made[:2] == [0.0, 0.0]  # a law that makes not nearly all of it, three in ten here, is not the one
    assert made[2] > NEARLY * (raw - found.count)
    assert not located(noisy, found).significant
    assert located(noisy, plain).significant
    chi2 = sum(chi_squared(found.fit.chain, o) for o in noisy.observations)
    assert without_chance(found.fit.chain, (NOISY,), noisy.observations, 1e-3)[0] < 0.9 * chi2
    doubt = 0.51 * (chi2 / found.count - 1.0)  # of the noise's variance: all that is left may be noise
    assert without_chance(found.fit.chain, (NOISY,), noisy.observations, doubt) == (chi2, 1.0)


def dropped(noisy, hypothesis, physics):
    """Return what held-out data drop that speak against a hypothesis by five standard errors."""
    return confirmed(noisy, Warranted(hypothesis, Located(hypothesis, (), 1.0)), (seen(physics),))[1]


def test_held_out_data_confirm_chance_where_they_scatter_so_or_cannot_tell_its_mean(noisy, monkeypatch):
    monkeypatch.setattr(WAY, "improvement", lambda better, worse, test: -5.0)
    monkeypatch.setattr(WAY, "would_tell", lambda better, worse, test: 10.0)
    monkeypatch.setattr(WAY, "settled", lambda bench, hypothesis: (hypothesis, ()))
    found = replace(beside(noisy, NOISY, {"sd": SD_V, "bandwidth": BANDWIDTH_HZ}), swell=1.0)
    assert dropped(noisy, found, (PRESENT,)) == ()
    monkeypatch.setattr("identify.explain.carried.by_chance_elsewhere", lambda *given: 0.0)
    assert dropped(noisy, found, (PRESENT,)) == (NOISY,)
    assert dropped(noisy, replace(found, swell=1e3), (PRESENT,)) == ()


def test_what_is_found_beside_chance_has_to_be_seen_again(noisy, monkeypatch):
    """Chance looks like anything once: that held-out data are too few to tell is no excuse there."""
    monkeypatch.setattr(WAY, "would_tell", lambda better, worse, test: 1.0)
    monkeypatch.setattr(WAY, "settled", lambda bench, hypothesis: (hypothesis, ()))
    bypass = catalogue()["feedthrough"](Place.SENSE)
    chain = bypass.put_in(NOISY.put_in(noisy.plain, {"sd": SD_V, "bandwidth": BANDWIDTH_HZ}), {"k": 0.01})
    found = noisy.fitted(chain, (NOISY, bypass))
    for side, swell, lost in ((1.0, 1.0, ()), (1.0, 9.0, (bypass,)), (7.0, 9.0, ())):
        monkeypatch.setattr(WAY, "improvement", lambda better, worse, test, side=side: side)
        assert dropped(noisy, replace(found, swell=swell), (PRESENT,)) == lost
    monkeypatch.setattr(WAY, "improvement", lambda better, worse, test: 1.0)
    for fallen, lost in ((0.9 * CERTAIN_FALL, (bypass,)), (1.1 * CERTAIN_FALL, ())):  # more than chance can make
        monkeypatch.setattr(Hypothesis, "fall", lambda self, other, fallen=fallen: fallen)
        assert dropped(noisy, replace(found, swell=9.0), (PRESENT,)) == lost


def test_no_more_is_chance_than_differs_from_repeat_to_repeat():
    chain = chain_of(model_of(OP_AMP))
    bypass = Concealed("feedthrough", {"k": 0.04})  # comes back with the stimulus, within what such noise would scatter
    bench = Bench(chain, (seen((bypass,)),), tuple(p.name for p in chain.parameters()), (type(NOISY),))
    found = beside(bench, NOISY, {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})
    raw = sum(chi_squared(found.fit.chain, o) for o in bench.observations)
    assert raw - found.chi2 < 0.05 * (raw - found.count)


@pytest.mark.parametrize(("anew", "least", "most"), [(False, 0.0, 0.2), (True, 0.7, 1.3)], ids=["alike", "anew"])
def test_what_hangs_together_alike_in_every_repeat_makes_no_larger_noise_chance(anew, least, most):
    """The noise is 4 % larger than it was taken for, and a line is beside it that repeats have alike or upside down."""
    chain = NOISY.put_in(chain_of(model_of(OP_AMP)), {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})
    trace = seen(()).trace
    late = np.arange(trace.size) >= trace.size // 2
    line = 0.5 * NOISE_V * np.sin(2.0 * np.pi * 20.0 * np.arange(trace.size) / trace.rate_hz)
    noise = 1.04 * NOISE_V * np.random.default_rng(5).standard_normal(trace.size)
    y = simulate(chain, trace, 4) + np.where(late & anew, -line, line) + noise
    run = observed(replace(trace, y=y), NOISE_V, 4)
    left, _ = without_chance(chain, (NOISY,), (run,), 1e-3)
    chi2 = chi_squared(chain, run)
    assert least * (chi2 - run.count) <= chi2 - left <= most * (chi2 - run.count)


@pytest.mark.parametrize("stimulus", [
    pytest.param(staircase("walk", FIG13_LEVELS_V, 0.05), id="while F rests"),
    pytest.param(sine("stuck", 10.0, 0.1, 2, 4), id="where F never moves"),
])
def test_what_the_readings_do_by_themselves_is_no_chance_in_front_of_the_gap(stimulus):
    quiet = recorded(OP_AMP, stimulus, (), NOISE_V, fine=8)
    line = 0.05 * np.sin(2.0 * np.pi * 80.7 * np.arange(quiet.size) / quiet.rate_hz)
    run = observed(replace(quiet, y=quiet.y[:] + line), NOISE_V, 4)
    left = float(np.sum(np.square(line / NOISE_V)))
    chain = NOISY.put_in(chain_of(model_of(OP_AMP)), {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})
    large = as_large(chain, NOISY, (run,), left)
    assert by_chance(large, (NOISY,), (run,)) < NEARLY * left
    noise = Concealed("process_noise", {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})
    shaken = observed(recorded(OP_AMP, stimulus, (noise,), NOISE_V, fine=8), NOISE_V, 4)
    wanders = chi_squared(chain, shaken) - shaken.count
    assert stimulus.name == "stuck" or by_chance(chain, (NOISY,), (shaken,)) > NEARLY * wanders


def test_a_zero_that_jumps_now_and_then_is_no_chance_in_front_of_the_gap():
    """Its jumps are few: nearly all of it lies in the level a dwell has, as with noise that has moved F before."""
    stimulus = staircase("walk", FIG13_LEVELS_V, 0.05)
    quiet = recorded(OP_AMP, stimulus, (), NOISE_V, fine=8)
    jumps = np.random.default_rng(2).random(quiet.size) < 6.0 / quiet.rate_hz
    run = observed(replace(quiet, y=quiet.y[:] + 0.05 * (np.cumsum(jumps) % 2)), NOISE_V, 4)
    noise = {"sd": SD_V, "bandwidth": BANDWIDTH_HZ}
    shaken = observed(recorded(OP_AMP, stimulus, (Concealed("process_noise", noise),), NOISE_V, fine=8), NOISE_V, 4)
    plain = chain_of(model_of(OP_AMP))
    for seen_of, credited in ((run, False), (shaken, True)):
        left = chi_squared(plain, seen_of) - seen_of.count
        chain = as_large(NOISY.put_in(plain, noise), NOISY, (seen_of,), left)
        assert (by_chance(chain, (NOISY,), (seen_of,)) > 0.5 * left) is credited


def test_where_the_mean_tells_little_the_fit_begins_with_all_that_differs_between_repeats(noisy):
    (run,) = noisy.observations
    told = scatter_of(NOISY.put_in(noisy.plain, {"sd": SD_V, "bandwidth": BANDWIDTH_HZ}), (NOISY,), (run,))
    for begun_v in (1e-3 * SD_V, 30.0 * SD_V):
        small = NOISY.put_in(noisy.plain, {"sd": begun_v, "bandwidth": BANDWIDTH_HZ})
        assert as_large(small, NOISY, (run,), told).values["process_noise.sd"] == pytest.approx(SD_V, rel=0.1)
    resting = NOISY.put_in(noisy.plain, {"sd": 0.0, "bandwidth": BANDWIDTH_HZ})
    assert as_large(resting, NOISY, (run,), told) is resting


def test_the_size_of_what_acts_by_chance_is_told_by_its_scatter_too(noisy):
    held = tuple(p.name for p in noisy.plain.parameters())
    apart = {"F.D_L": 1.1, "F.D_U": -1.1}  # wider borders shaken more: to the mean the same, nearly
    chain = NOISY.put_in(noisy.plain.with_values(apart), {"sd": 3.0 * SD_V, "bandwidth": BANDWIDTH_HZ})
    bench = replace(noisy, fixed=(*held, "process_noise.bandwidth"))
    told = bench.fitted(chain, (NOISY,)).fit.chain.values["process_noise.sd"]
    mean = fit(chain, bench.observations, fixed=bench.fixed).chain.values["process_noise.sd"]
    assert abs(told / SD_V - 1.0) < 0.4 < abs(mean / SD_V - 1.0)
    assert sizing(noisy.plain, (), noisy.observations) is None


def test_an_interval_holds_what_another_form_of_the_noise_says_where_the_data_do_not_exclude_it(noisy):
    held = tuple(p.name for p in noisy.plain.parameters())
    chain = NOISY.put_in(noisy.plain, {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})
    best, (other,) = settled(replace(noisy, fixed=held), replace(noisy, fixed=held).fitted(chain, (NOISY,)))
    told = spanning("process_noise.bandwidth", 1.0, best.fit, (other,))
    own = [f.ci95("process_noise.bandwidth") for f in (best.fit, other)]
    assert (told.low, told.high) == (min(low for low, _ in own), max(high for _, high in own))
    assert other.chain.values["process_noise.bandwidth"] < 0.8 * best.fit.chain.values["process_noise.bandwidth"]


def test_what_is_left_beside_noise_in_front_of_the_gap_is_told_as_its_chance():
    stimuli = (staircase("walk", FIG13_LEVELS_V, 0.02), sine("wave", 10.0, 3.0, 2, 4), sine("fast", 40.0, 3.0, 4, 4))
    noise = Concealed("process_noise", {"sd": 0.1, "bandwidth": 300.0})
    runs = [
        replace(recorded(OP_AMP, stimulus, (noise,), NOISE_V, seed), steps=steps_of(stimulus.segments))
        for seed, stimulus in enumerate(stimuli)
    ]
    answer = explain(model_of(OP_AMP), runs)
    (found,) = answer.effects
    assert (found.id, found.stage, answer.verdict) == ("process_noise", "G1", "partly_explained")
    assert found.parameters["sd"][0].low < 0.1 < found.parameters["sd"][0].high
    assert answer.remaining.stage is None
    assert "chance" in answer.remaining.sentence
    assert found.probability > 0.9
    assert answer.held_out.residuals.after_v > 1.1 * NOISE_V  # as much as no model can foretell


def test_noise_that_first_order_does_not_ask_for_is_begun_with_all_the_same(noisy, monkeypatch):
    evidence = noisy.evidence(noisy.fitted(noisy.plain, ()))
    monkeypatch.setattr(Evidence, "sized", lambda self, effect, name, options: [{**o, name: -o[name]} for o in options])
    (start,) = NOISY.starts(evidence)
    assert start["sd"] > 0.0


def test_a_fit_of_what_acts_by_chance_begins_as_large_as_makes_what_differs(noisy, monkeypatch):
    promises = []
    monkeypatch.setattr(screen, "hopeful", lambda screened, runs: [])
    monkeypatch.setattr(screen, "raced", lambda bench, base, worth, *known: promises.extend(worth) or [])
    base = noisy.fitted(noisy.plain, ())
    noisy.round(base)
    (begun,) = promises
    made = scatter_of(begun.chain, (begun.candidate.effect,), noisy.observations)
    changed = unrepeated(base.fit.chain, noisy.observations) * (base.chi2 - base.count)
    assert made == pytest.approx(changed, rel=0.1)
    assert begun.chain.values["process_noise.sd"] != pytest.approx(begun.candidate.values["sd"], rel=0.1)


def test_no_grid_is_made_finer_than_chance_lets_anybody_see(noisy):
    coarse = replace(noisy, observations=tuple(replace(o, substeps=1, noise_v=1e-5) for o in noisy.observations))
    found = coarse.fitted(coarse.plain, ())
    assert coarse.fine_enough(found) is not coarse
    assert coarse.fine_enough(replace(found, swell=2.0)) is coarse
