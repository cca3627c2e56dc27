"""Where does a mismatch enter, when what makes it is no matter?"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

import identify.explain.bench as bench_module
from identify.chain import signals
from identify.effects import chain_of
from identify.evidence import Evidence
from identify.explain.bench import Bench
from identify.explain.contact import still
from identify.explain.free_form import (
    NEARLY,
    Begun,
    FirstFit,
    GoneOn,
    begun,
    ended,
    slid_on,
    untried,
    with_corners,
)
from identify.explain.frequencies import ripple_hz
from identify.explain.locate import BEHIND, EASILY, NEARER, Located, located, told_by_one, within_reach
from identify.explain.moments import where
from identify.explain.phrases import described
from identify.explain.prove import proven
from identify.explain.rivals import left_to_explain
from identify.explain.shape import shape_of
from identify.explain.side_by_side import LAST, fitted_from, raced
from identify.explain.sought import relevelled, retuned
from identify.explain.survey import surveyed
from identify.explain.suspect import LARGE, MOST, Suspect, contenders, overlooked, suspect
from identify.explain.wander import unrepeated
from identify.phases import turned_sines
from identify.stage import Place
from identify.trace import Array, Step, Trace
from identify.unnamed.contact import Giving
from identify.unnamed.correction import Correction
from identify.unnamed.hysteresis import Relays
from identify.unnamed.linear import Bypass, Filter, OneWay
from identify.unnamed.lines import GapRipple
from identify.unnamed.maps import LevelMap, LevelTable
from identify.unnamed.rates import RateMap, Trailing
from identify.unnamed.timed import OffsetOverClock
from tests.proof.cases import Concealed
from tests.proof.integrator import play, slewed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, noisy, observed, recorded

NOISE_V = 0.01
WALK, WAVE = staircase("walk", FIG13_LEVELS_V, 0.02), sine("wave", 20.0, 3.0, 3, 1)
WHISTLE = Concealed("source_line", {"amplitude": 0.5, "frequency": 438.2})
BENT = Concealed("curved_border", {"k2": 0.0, "k3": 0.03})


def bench(*physics: Concealed) -> Bench:
    """Return two short recordings of the op-amp rig with physics concealed in it."""
    runs = [recorded(OP_AMP, s, physics, NOISE_V, i, 3.0 * i, 8) for i, s in enumerate((WALK, WAVE))]
    return Bench(chain_of(model_of(OP_AMP)), tuple(observed(run, NOISE_V, 1) for run in runs), (), ())


def found(there: Bench) -> Located:
    return located(there, there.fitted(there.plain, ()))


def test_nothing_is_located_where_nothing_is_missing() -> None:
    clean = found(bench())
    assert not clean.significant
    assert clean.p_value > 0.01


def test_on_finer_grids_the_same_corrections_are_fitted_and_none_is_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    there = bench(BENT)
    plain = there.fitted(there.plain, ())
    told = located(there, plain)
    finer = tuple(replace(o, substeps=2 * o.substeps) for o in there.observations)
    fine = replace(there, observations=finer, known={}, asked={}, coarser=there)
    asked: list[object] = []
    monkeypatch.setattr(bench_module, "suspects", lambda evidence: asked.append(evidence) or [])
    again = located(fine, fine.again(plain))
    assert not asked
    assert [c for c, _ in again.fitted] == [c for c, _ in told.fitted]
    assert all(h.data is finer for c, h in again.fitted)
    assert again.share == pytest.approx(told.share, rel=1e-3)
    other = fine.fitted(fine.plain.with_values({"F.D_L": 2.0}), (), 0)
    assert not located(fine, other).significant  # at other values they are looked for
    assert len(asked) == 1


def test_of_two_corrections_at_a_place_that_are_asked_for_both_are_fitted(monkeypatch: pytest.MonkeyPatch) -> None:
    """To first order a law that is nearly the right one may promise a little more."""
    there = bench(BENT)
    plain = there.fitted(there.plain, ())
    at_f = [s for s in there.suspects(plain) if s.correction.place is Place.F]
    asked = [at_f[0], next(s for s in at_f if s.correction.form == "map of the rate")]
    monkeypatch.setattr(Bench, "suspects", lambda *_: asked)
    monkeypatch.setattr("identify.explain.free_form.contenders", lambda *_: asked)
    monkeypatch.setattr("identify.explain.free_form.NEXT", -np.inf)
    assert {c.form for c, _ in begun(there, plain).fitted} >= {s.correction.form for s in asked}


def test_a_correction_far_behind_names_after_a_first_fit_is_not_gone_after(monkeypatch: pytest.MonkeyPatch) -> None:
    there = bench(BENT)
    plain = there.fitted(there.plain, ())
    best = min(h.chi2 for _, h in begun(there, plain).fitted)
    told = replace(plain, chi2=best + 2.0 * EASILY)
    monkeypatch.setattr("identify.explain.locate.begun", lambda *_: begun(there, plain))
    assert within_reach(there, told, best - 0.9 * BEHIND)
    assert not within_reach(there, told, best - 1.1 * BEHIND)
    left = 3.0 * BEHIND
    much = plain.count + left  # where as much is left by names, a first fit may be behind by some of it
    told = replace(plain, chi2=much + 2.0 * EASILY)
    behind = much + NEARER * left - best
    fits = [(c, replace(h, chi2=h.chi2 + behind)) for c, h in begun(there, plain).fitted]
    for more, reached in ((-1.0, True), (1.0, False)):
        moved = [(c, replace(h, chi2=h.chi2 + more)) for c, h in fits]
        monkeypatch.setattr("identify.explain.locate.begun", lambda *_, fits=moved: Begun(0.0, fitted=fits))
        assert within_reach(replace(there, asked={}), told, much) is reached
    little = replace(plain, chi2=much + 0.9 * EASILY)
    assert within_reach(there, little, much)  # other laws might make that little


@pytest.mark.parametrize(
    ("promised", "there", "law", "free", "one"),
    [
        (1.0, 1.0, 0.8, 0.005, True),
        (0.01, 1.0, 0.8, 0.005, True),  # far above the noise first order promises little
        (0.04, 0.05, 0.035, 0.002, True),  # what the noise's variance is known to may hide it
        (1.0, 1.0, 0.3, 0.005, False),  # the larger of two laws: a delay and its drift are one correction
        (0.05, 0.05, 0.005, 0.002, False),  # the law leaves none but noise
        (1.0, 1.0, 0.8, 0.028, True),  # of so much a first fit leaves a little
        (1.0, 1.0, 0.8, 0.032, False),  # the correction leaves more than that
        (1.0, 1.0, 0.8, 0.05, False),
    ],
)
def test_it_is_one_thing_where_one_correction_makes_what_laws_hardly_tell(
    promised: float, there: float, law: float, free: float, one: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    on = bench()
    plain = on.fitted(on.plain, ())
    start, laws, told = (replace(plain, chi2=(1.0 + misfit) * plain.count) for misfit in (there, law, free))
    promise = Suspect(LevelMap(Place.F, (-5.0, 0.0, 5.0)), np.ones(1), np.array([promised * plain.count]), {})
    monkeypatch.setattr(Bench, "suspects_near", lambda *_: (start.chi2, [promise]))
    monkeypatch.setattr("identify.explain.locate.first_fits", lambda *_: [told])
    assert told_by_one(on, start, laws) is one
    assert not told_by_one(on, start, replace(laws, swell=2.0))


@pytest.mark.parametrize(
    ("knots", "left", "beside", "one"),
    [
        ((1e-3,), 3.0 * BEHIND, False, True),
        ((1e-3, 2e-3), 3.0 * BEHIND, False, False),  # laws have as many numbers
        ((1e-3,), 0.9 * BEHIND, False, False),  # they leave little
        ((1e-3,), 3.0 * BEHIND, True, False),  # so does the correction
    ],
)
def test_it_is_one_thing_where_a_correction_of_no_more_numbers_leaves_nothing_and_laws_much(
    knots: tuple[float, ...], left: float, beside: bool, one: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    on = bench()
    plain = on.fitted(on.plain, ())
    start, laws, found = (replace(plain, chi2=plain.count + chi2) for chi2 in (100.0 * BEHIND, left, 0.0))
    rest = Suspect(LevelMap(Place.F, (-5.0, 0.0, 5.0)), np.ones(1), np.array([left]), {})
    promise = Suspect(Giving(Place.F, knots), np.ones(1), np.array([start.chi2 - found.chi2]), {})
    monkeypatch.setattr(Bench, "suspects_near", lambda *_: (start.chi2, [promise]))
    monkeypatch.setattr(Bench, "suspects", lambda _, asked: [rest] if beside or asked is laws else [])
    fits: list[int] = []
    monkeypatch.setattr("identify.explain.locate.first_fits", lambda *_: fits.append(1) or [found])
    told = Located(start, ((Giving(Place.F, knots), found),), 0.0)
    monkeypatch.setattr("identify.explain.locate.located", lambda *_: told)
    assert told_by_one(on, start, laws) is one
    assert bool(fits) is (left > BEHIND)  # where laws leave nothing, nothing is fitted to see
    monkeypatch.setattr(Bench, "suspects_near", lambda *_: (start.chi2, [rest]))
    assert not told_by_one(on, start, laws)  # no law of one lag promises that much: nothing is fitted to see


def test_a_bent_border_is_located_at_f_and_proven_on_another_run() -> None:
    there = bench(BENT)
    bent = found(there)
    assert bent.significant
    assert bent.best.place == Place.F
    assert bent.share > 0.9
    other = observed(recorded(OP_AMP, sine("other", 12.5, 3.0, 2, 1), (BENT,), NOISE_V, 9, 9.0, 8), NOISE_V, 1)
    proof = proven(there, bent, [other])
    assert proof is not None
    assert proof.held_out_v < 1.3 * NOISE_V
    drawn = shape_of(proof.correction, proof.hypothesis.fit, there.observations)
    assert drawn is not None
    assert all(np.max(np.abs(curve)) > 0.01 for curve in drawn.curves)
    shares = surveyed(there, bent.base)
    assert [s.stage for s in shares] == ["source", "G1", "F", "G2", "sense"]
    assert shares[2].share > 0.9
    assert shares[2].p_value < 1e-9


def test_a_supply_that_generator_and_adc_share_is_a_gain_that_goes_with_u() -> None:
    """It was a path past the gap at F: what goes with u, added to the reading or to v, is nearly that."""
    told = found(bench(Concealed("shared_supply", {"share": 0.02, "top": 10.0})))
    assert (told.best.place, told.best.form) == (Place.SENSE, "gain over the source")
    assert told.share > 0.9
    assert set(told.places) >= {Place.SENSE, Place.G2}


def test_a_buffer_that_cannot_follow_the_reading_may_be_of_g2_or_of_the_adc() -> None:
    """What G2 puts out is what is read: only G2 was listed, and F."""
    slow_v = 0.05  # a sample; the largest step is 0.08 V
    told = found(added_to_readings(lambda trace: slewed(trace.y, slow_v) - trace.y))
    assert told.best.form == "lag behind a rate"
    assert {Place.G2, Place.SENSE} <= set(told.places)


def added_to_readings(make: Callable[[Trace], Array]) -> Bench:
    """Return the two short recordings with something added to y and then noise."""
    rng, seen = np.random.default_rng(2), []
    for i, stimulus in enumerate((WALK, WAVE)):
        trace = recorded(OP_AMP, stimulus, (), 0.0, i, 3.0 * i, 8)
        y = trace.y + make(trace) + NOISE_V * rng.normal(size=trace.size)
        seen.append(observed(replace(trace, y=y), NOISE_V, 1))
    return replace(bench(), observations=tuple(seen))


def test_what_bridges_the_gap_linearly_is_a_path_past_the_circuit_and_listed_at_f() -> None:
    """A stray capacitor across F: its current has the way through G1 and G2."""
    g1, g2 = (OP_AMP.g1_num, OP_AMP.g1_den), (OP_AMP.g2_num, OP_AMP.g2_den)
    bridge = (np.polymul((2e-3, 0.0), np.polymul(g1[0], g2[0])), np.polymul(g1[1], g2[1]))

    def bridged(trace: Trace) -> Array:
        return np.asarray(lsim(bridge, trace.u, np.arange(trace.size) / trace.rate_hz, interp=False)[1])

    told = found(added_to_readings(bridged))
    assert told.best.form == Bypass.form
    assert {Place.F, Place.SENSE} <= set(told.places)


def test_a_gain_that_ripples_quickly_behind_the_gap_ripples_alike_before_g2_and_behind_it() -> None:
    told = found(bench(Concealed("adc_ripple", {"share": 0.02, "frequency": 384.0})))
    assert told.best.form == "ripple of the gain"
    assert {Place.SENSE, Place.G2, Place.F} <= set(told.places)


def test_a_slack_knob_of_the_generator_is_a_hysteresis_of_the_source() -> None:
    """It was a ripple of the gain, at the frequency at which the stimulus turns."""
    slack_v, there = 0.02, bench()
    turned = [replace(s, u=play(s.u - slack_v, s.u + slack_v, 0.0, 1.0, 0.0)) for s in (WALK, WAVE)]
    runs = [recorded(OP_AMP, s, (), NOISE_V, i, 3.0 * i, 8) for i, s in enumerate(turned)]
    seen = tuple(observed(replace(r, u=s.u), NOISE_V, 1) for r, s in zip(runs, (WALK, WAVE), strict=True))
    told = found(replace(there, observations=seen))
    assert (told.best.place, told.best.form) == (Place.SOURCE, "second hysteresis")
    assert told.share > 0.9


@pytest.mark.parametrize("comes_back", [True, False])
def test_what_comes_back_with_the_stimulus_is_told_from_what_does_not(comes_back: bool) -> None:
    twice = staircase("walk", FIG13_LEVELS_V, 0.02, 2)
    trace = recorded(OP_AMP, twice, (BENT,) if comes_back else (), NOISE_V, 1, 0.0, 8)
    jumps = np.cumsum(np.random.default_rng(5).uniform(size=trace.size) < 3e-3) % 2
    y = trace.y if comes_back else trace.y + 0.05 * jumps
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in twice.segments)
    there = replace(bench(), observations=(observed(replace(trace, y=y, steps=steps), NOISE_V, 1),))
    evidence = Evidence(there.fitted(there.plain, ()).fit, there.observations)
    assert abs(unrepeated(evidence.chain, evidence.observations) - (0.0 if comes_back else 1.0)) < 0.25
    assert where(evidence) == Place.SENSE


def gain(trace: Trace, off: Array) -> Array:
    """Return readings with a gain that is off by 2 %."""
    return trace.y * (1.0 + 0.02 * off)


def late(trace: Trace, off: Array) -> Array:
    """Return readings of which the clock is off by 200 us."""
    return np.interp(trace.clock_s + 2e-4 * off, trace.clock_s, trace.y)


@pytest.mark.parametrize(("form", "wandering", "share", "period_s"), [
    ("drift of the gain", gain, 1.0, 2.6),
    ("drift of the gain", gain, 0.15, 0.7),
    ("drift of the delay", late, 1.0, 2.6),
])
def test_a_gain_or_a_delay_that_wanders_is_told_from_an_offset_that_does(
    form: str, wandering: Callable[[Trace, Array], Array], share: float, period_s: float
) -> None:
    """A table of the offset as fine as the data explains as much: it has a weight for every few readings."""
    twice = staircase("walk", FIG13_LEVELS_V, 0.06, 2)
    trace = recorded(OP_AMP, twice, (), 0.0, 1, 0.0, 8)
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in twice.segments)
    y = wandering(trace, share * np.sin(2.0 * np.pi * trace.clock_s / period_s))
    wandered = replace(trace, y=y, steps=steps)
    there = replace(bench(), observations=(observed(noisy(wandered, NOISE_V, 1), NOISE_V, 1),))
    told = found(there)
    assert (told.best.place, told.best.form) == (Place.SENSE, form)
    assert told.share > 0.98


def test_what_is_gone_where_f_stands_at_a_border_is_of_its_memory() -> None:
    """A capacitor that gathers noise while nothing holds it: w wanders inside the gap, and is reset by a border."""
    chain, twice = chain_of(model_of(OP_AMP)), sine("wave", 2.0, 3.4, 2, 2)
    trace = recorded(OP_AMP, twice, (), 0.0, 1, 0.0, 8)
    inside = still(chain, signals(chain, trace), trace)
    walked = np.cumsum(np.random.default_rng(5).normal(0.0, 0.01, trace.size))
    reset = walked[np.maximum.accumulate(np.where(inside, 0, np.arange(trace.size)))]
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in twice.segments)
    noise = np.random.default_rng(6).normal(0.0, NOISE_V, trace.size)
    for wanders, place in ((walked - reset, Place.F), (walked, Place.SENSE)):
        seen = observed(replace(trace, y=trace.y + wanders + noise, steps=steps), NOISE_V, 1)
        there = replace(bench(), observations=(seen,))
        evidence = Evidence(there.fitted(there.plain, (), 0).fit, there.observations)
        assert where(evidence) == place


@pytest.mark.parametrize(("by_itself", "place"), [(False, Place.F), (True, Place.SENSE)])
def test_what_is_another_after_every_move_and_stays_while_f_rests_is_of_f(by_itself: bool, place: Place) -> None:
    """A gap that every turn finds anew; a zero of the converter that leaps whenever it likes is the sense's."""
    long, rng, chain = staircase("walk", FIG13_LEVELS_V, 0.2, 2), np.random.default_rng(8), chain_of(model_of(OP_AMP))
    trace = recorded(OP_AMP, long, (), NOISE_V, 1, 0.0, 8)
    moving = np.diff(signals(chain, trace)[chain.index(Place.F) - 1]) != 0.0
    moves = np.flatnonzero(np.diff(moving, prepend=False) & moving)
    leaps = np.sort(rng.integers(0, trace.size, moves.size)) if by_itself else moves
    offset_v = rng.normal(0.0, 0.02, leaps.size + 1)[np.searchsorted(leaps, np.arange(trace.size), side="right")]
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in long.segments)
    there = replace(bench(), observations=(observed(replace(trace, y=trace.y + offset_v, steps=steps), NOISE_V, 1),))
    evidence = Evidence(there.fitted(there.plain, (), 0).fit, there.observations)
    assert where(evidence) == place


def test_what_wanders_slowly_below_the_noise_is_seen_in_means() -> None:
    """No single reading shows a jump of a third of the noise; means of a hundred do."""
    long = staircase("walk", FIG13_LEVELS_V, 0.2, 2)
    trace = recorded(OP_AMP, long, (), NOISE_V, 1, 0.0, 8)
    jumps = np.cumsum(np.random.default_rng(8).uniform(size=trace.size) < 1e-3) % 2
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in long.segments)
    for size_v, wanders in ((0.003, 1.0), (0.0, 0.0)):
        seen = observed(replace(trace, y=trace.y + size_v * jumps, steps=steps), NOISE_V, 1)
        there = replace(bench(), observations=(seen,))
        told = found(there)
        assert abs(unrepeated(told.base.fit.chain, there.observations) - wanders) < 0.25
        assert told.significant == bool(wanders)
        assert not wanders or told.best.place == Place.SENSE
        # What G2 puts out is what is read, and what is slow passes G2 as it is.
        assert not wanders or set(told.places) == {Place.SENSE, Place.G2, Place.F}


def test_a_line_is_told_at_its_own_frequency_and_stands_where_it_explains_most_in_every_run() -> None:
    """A tenth of what a run resolves beside it, or at another turn, it would leave far more than noise."""
    there = bench(Concealed("reference_ripple", {"share": 0.03, "frequency": 93.9}))
    told = found(there)
    correction, fitted = told.fitted[0]
    assert (correction.place, correction.form) == (Place.SOURCE, "ripple of the gain")
    assert correction.knots[0] == pytest.approx(93.9, abs=0.1)
    assert fitted.misfit < 0.02
    names = [p.name for p in correction.parameters()]
    turned = {f"{name}[walk]": -0.2 * fitted.fit.chain.values[f"{name}[walk]"] for name in names}
    again = turned_sines(fitted.fit.chain.with_values(turned), there.observations, names)
    assert again.values[f"{names[0]}[wave]"] == fitted.fit.chain.values[f"{names[0]}[wave]"]  # it stood right
    right, here = ([c.values[f"{name}[walk]"] for name in names] for c in (fitted.fit.chain, again))
    assert np.dot(right, here) > 0.8 * np.linalg.norm(right) * np.linalg.norm(here)


def test_a_shape_has_no_straight_part() -> None:
    there = bench(BENT)
    plain = there.fitted(there.plain, ())
    law = LevelMap(Place.F, tuple(np.linspace(-18.0, 15.0, 8).tolist()))
    drawn = shape_of(law, there.fitted(law.put_in(plain.fit.chain), ()).fit, there.observations)
    assert drawn is not None
    assert drawn.at[0] > -18.5
    assert abs(np.polyfit(drawn.at, drawn.curves[0], 1)[0]) < 0.05 * np.ptp(drawn.curves[0])


def test_a_ripple_of_the_source_is_found_at_its_frequency_among_the_lines_of_the_stimulus() -> None:
    rippled = Concealed("reference_ripple", {"share": 0.03, "frequency": 93.9})
    there = bench(rippled, Concealed("adc_nonlinearity", {"k2": 1e-4, "k3": 0.0}))
    evidence = Evidence(there.fitted(there.plain, ()).fit, there.observations)
    assert ripple_hz(evidence, Place.SOURCE) == pytest.approx(93.9, abs=0.9)  # half of what 0.56 s resolve
    assert found(bench(rippled)).best.place == Place.SOURCE


def test_a_line_of_the_source_is_found_at_its_frequency_and_told_at_both_places_in_front_of_the_gap() -> None:
    """Of every run the phase is free: what G1 does to the line is not told."""
    stimulus = sine("wave", 20.0, 8.0, 2, 8)
    runs = [recorded(OP_AMP, stimulus, (WHISTLE,), NOISE_V, seed, 3.0 * seed, 8) for seed in (1, 2)]
    steps = tuple(Step("wave", "", start, start + 2000, i) for i, start in enumerate(range(0, runs[0].y.size, 2000)))
    seen = tuple(observed(replace(run, name=f"wave {i}", steps=steps), NOISE_V, 1) for i, run in enumerate(runs))
    told = found(replace(bench(), observations=seen))
    assert told.best.form == "line"
    assert told.best.knots[0] == pytest.approx(438.2, abs=0.2)
    assert set(told.places) >= {Place.G1, Place.SOURCE}
    in_front = (Place.G1, Place.SOURCE, Place.F)  # added to v, it moves the borders
    assert sum(told.places[place] for place in in_front) > 0.99


def test_a_ripple_of_the_gap_is_found_at_its_frequency_on_the_borders() -> None:
    there = bench(Concealed("hum at F", {"frequency": 86.3, "amplitude": 0.03}))
    rippled = found(there)
    assert (rippled.best.place, rippled.best.form) == (Place.F, "ripple of the gap")
    assert rippled.best.knots[0] == pytest.approx(86.3, abs=0.5)
    assert rippled.share > 0.95


def test_a_gap_that_follows_the_load_is_found_on_the_borders() -> None:
    warmed = found(bench(Concealed("warming_gap", {"k": 0.08, "tau": 0.1, "top": 3.0})))
    assert (warmed.best.place, warmed.best.form) == (Place.F, "gap after load")
    assert warmed.share > 0.95
    assert warmed.places[Place.F] > 0.99


def test_a_lag_of_one_way_goes_with_the_rate_before_or_behind_a_g2_that_is_fast() -> None:
    late = found(bench(Concealed("one_way_lag", {"tau": 3e-4})))
    assert late.best.form == "filter by direction"
    assert late.share > 0.95
    assert late.places[Place.G2] > 0.1  # that law has to be tried there, too
    open_to = {Place.F, Place.G2, Place.SENSE}  # a law of the rate of what G2 puts out is one of what is read
    assert set(late.places) - open_to == {p for p, share in late.places.items() if share < 0.01}


@pytest.mark.parametrize("table", [
    OffsetOverClock(Place.SENSE, tuple(np.arange(2.0 * MOST).tolist())), LevelTable(Place.SOURCE, (-1.0, 0.0, 2.0)),
])  # fmt: skip
@pytest.mark.parametrize(("explained", "law_is_first"), [(0.9, True), (0.5, False)])
def test_a_table_as_fine_as_the_data_is_believed_after_a_law_of_few_numbers_that_foretells_most(
    explained: float, law_is_first: bool, table: Correction
) -> None:
    there = bench()
    base = replace(there.fitted(there.plain, ()), chi2=2000.0, count=1000)
    law = LevelMap(Place.F, (-1.0, 0.0, 1.0, 2.0))
    first = law.place if law_is_first else table.place
    both = ((table, replace(base, chi2=1000.0)), (law, replace(base, chi2=2000.0 - 1000.0 * explained)))
    assert next(iter(Located(base, both, 0.0, (400.0, 5.0)).places)) == first


@pytest.mark.parametrize(("explained", "first", "left"), [(0.97, Place.G1, 970.0), (0.65, Place.F, 1000.0)])
def test_dynamics_by_direction_are_a_disguise_of_those_alike_in_both_that_foretell_most(
    explained: float, first: Place, left: float
) -> None:
    there = bench()
    base = replace(there.fitted(there.plain, ()), chi2=2000.0, count=1000)
    alike, by_way = Filter(Place.G1, (1e-3, 1e-2)), OneWay(Place.F, (1e-3, 1e-2))
    both = ((by_way, replace(base, chi2=1000.0)), (alike, replace(base, chi2=2000.0 - 1000.0 * explained)))
    beyond = Located(base, both, 0.0, (5.0, 5.0))
    assert next(iter(beyond.places)) == first
    assert left_to_explain(beyond) == pytest.approx(left)


def test_beside_what_is_fitted_by_direction_a_filter_is_fitted_that_knows_none() -> None:
    there = bench(Concealed("one_way_lag", {"tau": 3e-4}))
    ranked = there.suspects(there.fitted(there.plain, ()))
    by_way = [s for s in ranked if s.correction.form == OneWay.form]
    chosen = contenders([*by_way, *(s for s in ranked if s not in by_way)], 1.0)
    assert [s.correction.form for s in chosen].count(Filter.form) == 1
    maps = [s for s in ranked if s.correction.form == LevelMap.form]
    assert {s.correction.form for s in contenders(maps, 1.0)} == {LevelMap.form}


@pytest.mark.parametrize(("left", "fall", "others"), [(1000.0, 200.0, 0), (1000.0, 50.0, 4), (15.0, 1.0, 0)])
def test_a_correction_that_explains_little_excludes_no_other_place(left: float, fall: float, others: int) -> None:
    there = bench()
    base = replace(there.fitted(there.plain, ()), chi2=1000.0 + left, count=1000)  # 20 of it the noise may make
    fitted = ((RateMap(Place.F, (-1.0, 0.0, 1.0)), replace(base, chi2=base.chi2 - fall)),)
    told = Located(base, fitted, 0.0, (5.0,))
    assert len(told.alternatives()) == others
    assert Place.F not in told.alternatives()


def test_a_place_that_is_ruled_out_is_not_told_and_all_else_is_open_where_nothing_else_was_fitted() -> None:
    there = bench()
    base, behind = replace(there.fitted(there.plain, ()), chi2=2000.0, count=1000), (Place.G2, Place.SENSE)
    kinds = ((OffsetOverClock, Place.SENSE), (RateMap, Place.F))
    drift, border = (kind(place, (-1.0, 0.0, 1.0)) for kind, place in kinds)
    best, second = (drift, replace(base, chi2=1000.0)), (border, replace(base, chi2=1500.0))
    assert next(iter(Located(base, (best, second), 0.0, (5.0, 5.0)).places)) is Place.SENSE
    told = Located(base, (second, best), 0.0, (5.0, 5.0), ruled_out=behind)
    assert (tuple(told.places), told.best.place, told.alternatives()) == ((Place.F,), Place.F, ())
    assert told.place is Place.F
    alone = Located(base, (best,), 0.0, (5.0,), ruled_out=behind)
    assert (alone.best.place, alone.place) == (Place.SENSE, Place.F)  # what moves as slowly behind F may be of F
    assert set(alone.alternatives()) == {Place.SOURCE, Place.G1}
    assert "at F (as if at sense, where it has not come in)" in described(alone)
    nowhere = Located(base, (best,), 0.0, (5.0,), ruled_out=(*behind, Place.F))
    assert (nowhere.place, set(nowhere.alternatives())) == (Place.SENSE, {Place.SOURCE, Place.G1})


@pytest.mark.parametrize("kind", [LevelMap, Relays])
def test_what_a_law_of_v_explains_as_well_as_one_of_w_is_taken_for_that_of_w(kind: type[Correction]) -> None:
    there = bench()
    base = replace(there.fitted(there.plain, ()), chi2=2000.0, count=1000)
    left = replace(base, chi2=1000.0)
    fitted = tuple((kind(place, (-1.0, 0.0, 1.0, 2.0)), left) for place in (Place.G1, Place.F))
    assert Located(base, fitted, 0.0, (5.0, 5.0)).places == pytest.approx({Place.F: 0.8, Place.G1: 0.2})


@pytest.mark.parametrize("kind", [RateMap, Trailing])
def test_a_law_of_how_fast_g2_puts_out_is_listed_at_the_sense(kind: type[Correction]) -> None:
    """What G2 puts out is what is read: a sampling capacitor that keeps some of the last reading was G2's alone."""
    there = bench()
    base = replace(there.fitted(there.plain, ()), chi2=2000.0, count=1000)
    fitted = ((kind(Place.G2, (-1.0, 1.0, 2.0)), replace(base, chi2=1000.0)),)
    assert Located(base, fitted, 0.0, (5.0,)).places == pytest.approx({Place.G2: 0.8, Place.SENSE: 0.2})


def test_a_table_as_fine_as_the_data_keeps_none_of_few_knots_from_the_race() -> None:
    fine, few = (OffsetOverClock(Place.SENSE, tuple(np.arange(float(count)).tolist())) for count in (MOST + 1, 6))
    ranked = [Suspect(law, np.ones(1), np.array([5000.0]), {}) for law in (fine, few)]
    assert overlooked(ranked, ranked[:1]) == ranked[1:]
    assert overlooked(ranked, ranked) == []


def test_of_corrections_that_race_those_come_to_the_end_that_explain_most() -> None:
    """Nothing is run to its end once the mismatch is explained to the noise."""
    there = bench(BENT)
    base = there.fitted(there.plain, ())
    ranked = there.suspects(base)
    ended_at = raced(there, base, overlooked(ranked, ()))
    assert 1 < len(ended_at) <= LAST
    assert [h.chi2 for _, h in ended_at] == sorted(h.chi2 for _, h in ended_at)
    assert ended_at[0][0].correction.place == Place.F
    assert ended_at[0][1].misfit < base.noise_known


def test_corrections_are_fitted_to_the_end_where_that_could_change_which_is_best(monkeypatch) -> None:
    there = bench()
    base, knots = there.fitted(there.plain, ()), tuple(np.linspace(-18.0, 14.0, 9).tolist())
    first, second = (LevelMap(place, knots) for place in (Place.F, Place.SENSE))
    left = replace(base, fit=replace(base.fit, converged=False, beyond=2.0))
    asked: list[object] = []
    monkeypatch.setattr(Bench, "fitted", lambda self, chain, effects: asked.append(chain) or left)
    for behind, fits in ((3.0, 2), (300.0, 0)):
        asked.clear()
        ended(there, [(first, left), (second, replace(left, chi2=left.chi2 + behind))])
        assert len(asked) == fits


def test_a_ripple_of_the_gap_is_retuned_beside_the_values_it_leaves() -> None:
    """How a gap passes a line on hangs on its size: what is told from a gap that rests is at another frequency."""
    there = bench(Concealed("hum at F", {"frequency": 86.3, "amplitude": 0.3}))
    base = there.fitted(there.plain, ())
    off_hz = 86.3 + 0.2 / float(there.observations[0].trace.clock_s[-1])
    law = GapRipple(Place.F, (off_hz,))
    begun = fitted_from(there, base, suspect(there.evidence(base), law))
    tuned, fitted = slid_on(there, base, law, begun)
    assert begun.misfit > 0.5
    assert fitted.misfit < 0.02
    assert tuned.knots[0] == pytest.approx(86.3, abs=0.01)
    assert retuned(there.evidence(fitted), base.fit.chain, tuned) is None


@pytest.mark.parametrize("off", [0.98, 1.02])
def test_the_level_at_which_something_switches_is_found_from_either_side(off: float) -> None:
    """What switches too late leaves nothing behind its level: no slope says where the right one is."""
    there = bench(Concealed("switching_gain", {"share": 0.05, "level": 4.0}))
    base = there.fitted(there.plain, ())
    law, right = Relays(Place.SENSE, (4.0 * off,)), Relays(Place.SENSE, (4.0,))
    begun, there_at = (fitted_from(there, base, suspect(there.evidence(base), one)) for one in (law, right))
    found, fitted = slid_on(there, base, law, begun)
    assert begun.misfit > 10.0 * base.noise_known > 10.0 * fitted.misfit
    assert fitted.chi2 < there_at.chi2 + 1.0  # between two readings no level is told from another
    assert found.knots[0] == pytest.approx(4.0, rel=4e-3)
    assert relevelled(there.evidence(fitted), base.fit.chain, found) is None


def test_what_a_residual_tells_is_kept_for_the_next_question() -> None:
    there = bench(Concealed("giving_contact", {"tau": 1e-3}))
    base = there.fitted(there.plain, ())
    told, other = there.evidence(base), replace(base)
    assert there.evidence(base) is told
    assert there.evidence(other) is not told
    assert there.evidence(base) is not told  # that of the last one alone: it is as large as the recordings


def test_a_correction_is_fitted_once_whoever_asks() -> None:
    """A line with overtones takes half a minute; whether chance is at work is asked before where the mismatch is."""
    there = bench(Concealed("giving_contact", {"tau": 1e-3}))
    base, law = there.fitted(there.plain, ()), Giving(Place.F, (6e-4,))
    found = suspect(there.evidence(base), law)
    once = there.remembered(FirstFit(law, found), base)
    slid = there.remembered(GoneOn(law, once), base)
    other = there.of_kinds(())
    assert other.remembered(FirstFit(law, replace(found, looks=1.0)), base) is once
    assert other.remembered(GoneOn(law, once), base) is slid
    assert other.remembered(FirstFit(Giving(Place.F, (7e-4,)), found), base) is not once


@pytest.mark.parametrize("begins_s", [6e-4, 1.5e-3])
def test_one_lag_is_slid_to_what_it_is_while_the_plain_values_follow(begins_s: float) -> None:
    """They have moved to stand in for what the wrong lag leaves, and hold a search of the lag alone where it is."""
    there = bench(Concealed("giving_contact", {"tau": 1e-3}))
    base = there.fitted(there.plain, ())
    law = Giving(Place.F, (begins_s,))
    begun_there = fitted_from(there, base, suspect(there.evidence(base), law))
    slid, fitted = slid_on(there, base, law, begun_there)
    assert begun_there.misfit > 0.1
    assert fitted.misfit < 0.02
    assert slid.knots[0] == pytest.approx(1e-3, rel=0.02)
    assert fitted.fit.chain.values["unnamed.give1"] == pytest.approx(1.0, abs=0.05)


def test_one_lag_takes_the_place_of_several_that_leave_something() -> None:
    there = bench(Concealed("giving_contact", {"tau": 1e-3}))
    base, law = there.fitted(there.plain, ()), Giving(Place.F, (1e-4, 1e-2))
    begun_there = fitted_from(there, base, suspect(there.evidence(base), law))
    other, fitted = with_corners(there, base, law, begun_there)
    assert begun_there.misfit > 0.05
    assert fitted.misfit < 0.02
    assert other.knots == (pytest.approx(1e-3, rel=0.02),)


def test_where_a_fit_may_leave_noise_laws_that_one_knot_does_are_tried_too() -> None:
    """Nothing else is: of 0.1 ms a contact that gives way is nearly a pole, which leaves no more than noise might."""
    there = replace(bench(Concealed("giving_contact", {"tau": 2e-4})), noise_known=1.0)
    base = there.fitted(there.plain, ())
    first = begun(there, base)
    least = min((h for _, h in first.fitted), key=lambda h: h.chi2)
    only = replace(first, asked=(), worth=[s for s in first.ranked if s.correction.form == Filter.form])
    tried = untried(there, base, only, least)
    most = max(s.gain for s in first.ranked)
    assert most > LARGE
    assert Giving.form in {s.correction.form for s in tried}
    assert all(s.correction.single and s.gain > NEARLY * most for s in tried)
    left = [s for s in overlooked(first.ranked, only.worth) if s.correction.single]
    assert {s.correction.form for s in left} > {s.correction.form for s in tried}  # others come nowhere near
