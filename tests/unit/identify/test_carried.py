"""Is noise in front of the gap found in what repeats differ by, measured, and the rest seen beside it?"""

import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from identify.colour import Colour
from identify.effects import catalogue
from identify.explain.bench import Bench
from identify.explain.beside import (
    CLEARLY,
    SCATTERED,
    _fitted,
    _is_most,
    _is_of,
    comes_back,
    foretells_all,
    foretold,
    selected_beside,
    selected_either,
)
from identify.explain.carried import (
    SURE,
    alike_weighed,
    bare,
    carried,
    differ,
    left_by_chance,
    price,
    ratchets,
    rougher,
    scatters_so,
    weighed_again,
)
from identify.explain.explain import _found, confirmed, explain
from identify.explain.hypothesis import Hypothesis
from identify.explain.locate import Located
from identify.explain.plain import prepared
from identify.explain.promise import Promise
from identify.explain.prune import pruned
from identify.explain.readings import Look, read
from identify.explain.rivals import _ahead
from identify.explain.round import Round
from identify.explain.side_by_side import fitted_from
from identify.explain.sought import finer
from identify.explain.suspect import MOST
from identify.explain.suspects import suspects
from identify.explain.wander import changes, whitened
from identify.explain.warrant import Warranted, warranted
from identify.fit import Pull
from identify.holdout import split
from identify.observe import pooled_rms, refined, weighed
from identify.stage import Place
from identify.trace import Step
from identify.unnamed.lines import GapRipple, Wave
from identify.unnamed.maps import LevelMap
from identify.unnamed.timed import OffsetOverClock
from identify.wandering import wander_of
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V, SD_V, BANDWIDTH_HZ = 0.002, 0.02, 300.0
NOISY = Concealed("process_noise", {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})
TILTED = Concealed("plateau_tilt", {"k": 0.003})
STIMULI = (staircase("walk", FIG13_LEVELS_V, 0.02), sine("wave", 10.0, 3.0, 2, 6), sine("fast", 40.0, 3.0, 4, 6))
OFTEN = (staircase("walk", FIG13_LEVELS_V, 0.02, 8), sine("wave", 4.0, 3.0, 4, 1))
LAW = catalogue()["process_noise"](Place.G1, "white")
TRIED = {  # laws of every sort: a round of all there are takes seconds more
    "process_noise", "hum", "offset_drift", "saturation", "extra_pole", "feedthrough", "plateau_tilt", "self_heating",
    "dielectric_absorption",
}  # fmt: skip


def quiet(sentence: str, share: float) -> None:
    """Show nothing."""


def runs(*physics, stimuli=STIMULI):
    """Return recordings whose steps are marked as repeats."""
    found = []
    for seed, stimulus in enumerate(stimuli):
        steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in stimulus.segments)
        found.append(replace(recorded(OP_AMP, stimulus, physics, NOISE_V, seed), steps=steps))
    return found


def ready(data):
    """Return the bench of hypotheses, and the fitted plain model."""
    return prepared(model_of(OP_AMP), data, sorted(set(catalogue()) - TRIED))


def begun(*physics):
    """Return the bench of hypotheses, the fitted plain model, and the data."""
    data = split(model_of(OP_AMP), runs(*physics), ())
    return *ready(data), data


@pytest.fixture(scope="module")
def noisy():
    """Return bench and plain model where there is noise in front of the gap, and the data."""
    return begun(NOISY)


@pytest.fixture(scope="module")
def beside(noisy):
    """Return what is found of it."""
    return carried(*noisy[:2])


def test_noise_in_front_of_the_gap_is_measured_by_what_repeats_differ_by(noisy, beside):
    bench, plain, _ = noisy
    weighed_bench, base = beside
    before, after = changes(plain.fit.chain, bench.observations), changes(base.fit.chain, weighed_bench.observations)
    assert before[0, 0] > 20.0 * before[0, 1] ** 0.5
    assert after[0, 0] < 0.02 * before[0, 0]
    assert base.effects[0].id == "process_noise"
    assert base.misfit < 0.1 < plain.misfit
    values = base.fit.chain.values
    assert abs(np.log(values["process_noise.sd"] / SD_V)) < 0.5
    assert price(*beside) < price(bench, plain)


def test_the_weights_hold_for_runs_that_were_not_fitted(noisy, beside):
    unseen = observed(recorded(OP_AMP, staircase("other", FIG13_LEVELS_V[::-1], 0.03), (NOISY,), NOISE_V, 99), NOISE_V)
    chain = beside[1].fit.chain
    (it,) = alike_weighed(beside[0], chain, [unseen])
    raw, white = (pooled_rms(o.whitened(chain)) for o in (unseen, it))
    assert raw > 1.5
    assert 0.8 < white < 1.15
    assert bare([it])[0].colour.white
    assert alike_weighed(noisy[0], chain, [unseen]) == (unseen,)


HUM = Concealed("hum at sense", {"frequency": 50.0, "amplitude": 0.01, "third": 0.0, "fifth": 0.0})


@pytest.mark.parametrize(("physics", "all_of_it"), [((NOISY,), True), ((NOISY, HUM), False), ((HUM,), False)])
def test_held_out_runs_side_with_noise_where_its_weights_leave_nothing_of_them(beside, physics, all_of_it, monkeypatch):
    """Where what it makes by its own size does not tell, which small deviations get wrong far above the noise."""
    unseen = observed(recorded(OP_AMP, staircase("other", FIG13_LEVELS_V[::-1], 0.03), physics, NOISE_V, 99), NOISE_V)
    bench, base = beside
    (law,), chain = base.effects, base.fit.chain
    monkeypatch.setattr("identify.explain.carried.by_chance_elsewhere", lambda *_: 0.0)
    weighed_beside = alike_weighed(bench, chain, [unseen])
    assert scatters_so(bench, law, chain, weighed_beside) is all_of_it
    assert not scatters_so(bench, law, chain, [unseen])
    assert not scatters_so(replace(bench, carried=None), law, chain, weighed_beside)
    monkeypatch.setattr(sys.modules[explain.__module__], "improvement", lambda *_: -100.0)  # the mean is against it
    kept, dropped = confirmed(bench, Warranted(base, Located(base, (), 1.0)), weighed_beside)
    assert (kept.hypothesis.effects, dropped) == (((law,), ()) if all_of_it else ((), (law,)))


def test_what_named_noise_makes_by_chance_is_what_the_weights_take_away(noisy, beside):
    bench, base = beside
    chain = base.fit.chain
    made = left_by_chance(bench, base.effects, chain, bench.observations)
    both = bare(bench.observations), bench.observations
    raw, white = (pooled_rms(left for o in seen for left in o.whitened(chain)) for seen in both)
    assert made == pytest.approx(raw**2 - white**2)
    assert left_by_chance(bench, (), chain, bench.observations) == 0.0
    assert left_by_chance(noisy[0], (), chain, noisy[0].observations) == 0.0


@pytest.mark.parametrize(
    "other",
    [
        (),
        (Concealed("hum at G1", {"frequency": 60.12, "amplitude": 0.05, "third": 0.01, "fifth": 0.0}),),
        (Concealed("hum at sense", {"frequency": 49.9, "second": 0.01, "fourth": 0.005}),),
        (Concealed("offset_drift", {"rate": 0.02}),),
        (Concealed("lost_contact", {"rate": 3.0, "length": 0.003}),),
        (Concealed("telegraph", {"rate": 3.0, "size": 0.02}),),
        (Concealed("reference_ripple", {"frequency": 71.8, "share": 0.01}),),
    ],
    ids=["nothing", "hum at v", "hum", "drift", "lost contact", "telegraph", "ripple"],
)
def test_nothing_else_that_differs_from_repeat_to_repeat_is_taken_for_it(other):
    bench, plain, _ = begun(*other)
    assert selected_beside(bench, plain, quiet) is None


@pytest.mark.parametrize(("law", "there"), [
    (LevelMap(Place.SOURCE, (-5.0, 0.0, 5.0, 10.0)), False),
    (OffsetOverClock(Place.SENSE, tuple(np.arange(2.0 * MOST).tolist())), True),  # a table foretells nothing
])  # fmt: skip
def test_a_law_of_few_numbers_that_foretells_what_chance_would_make_is_believed_before_it(
    noisy, monkeypatch, law, there
):
    bench, plain, _ = noisy
    free = replace(plain, chi2=0.5 * plain.count)
    monkeypatch.setattr("identify.explain.beside.located", lambda b, h: Located(h, ((law, free),), 0.0))
    monkeypatch.setattr("identify.explain.beside.changes", lambda *_: np.zeros((1, 2)))  # repeats do not exclude it
    assert (selected_beside(bench, plain, quiet) is not None) is there


def test_a_law_that_repeats_itself_is_not_asked_where_repeats_differ_by_more_than_it_could_leave(noisy, monkeypatch):
    bench, plain, _ = noisy

    def refused(*_: object) -> Located:
        raise AssertionError("no law that answers alike whenever the same is played can leave less")

    monkeypatch.setattr("identify.explain.beside.located", refused)
    asked = list[set[str]]()
    whole = Bench.round

    def noted(self: Bench, *those: Any) -> Round:
        asked.append({kind.id for kind in self.kinds})
        return whole(self, *those)

    monkeypatch.setattr(Bench, "round", noted)
    assert selected_beside(bench, plain, quiet) is not None
    assert {"hum", "offset_drift"} <= asked[-1]
    assert not {"saturation", "extra_pole", "process_noise"} & asked[-1]


def test_how_much_noise_scatters_that_repeats_have_told_excludes_nothing_beside_it(beside, monkeypatch):
    """Far above the noise its structure foretells more than there is: no second law whatever was possible beside it."""
    bench, base = beside
    monkeypatch.setattr("identify.explain.bench.scatters_more", lambda *_: True)
    assert bench.possible(base)
    assert not replace(bench, carried=None).possible(base)


def test_a_law_that_foretells_what_repeats_differ_by_is_believed_first(noisy):
    """A gain that takes seconds to cool is another in the next repeat; noise is, too, and no law foretells that."""
    bench, plain, _ = begun(Concealed("self-heating in G1", {"k": -0.17, "tau": 1.8}))
    assert changes(plain.fit.chain, bench.observations)[0, 0] > 0.0
    assert foretold(bench, plain)
    bench, plain, _ = noisy
    assert not foretold(bench.of_kinds(catalogue().values()), plain)  # of all laws, those that explain most


def test_what_explains_more_but_answers_alike_hides_no_law_that_foretells_what_repeats_differ_by():
    """A pole of the source explains most, as many laws nearly do; hum of 4 mV in front of the gap is in repeats."""
    quiet_hum = Concealed("hum at G1", {"frequency": 60.12, "amplitude": 0.004, "third": 0.0, "fifth": 0.0})
    bench, plain, _ = begun(Concealed("source_pole", {"tau": 2e-4}), quiet_hum)
    assert foretold(bench.of_kinds(catalogue().values()), plain)


def test_a_promise_that_cannot_be_simulated_foretells_nothing(noisy, monkeypatch):
    bench, plain, _ = noisy
    endless = plain.fit.chain.with_values({"G2.den.s2": 0.0})
    with pytest.raises(ValueError, match="denominator"):
        changes(endless, bench.observations)
    monkeypatch.setattr("identify.explain.beside.promised", lambda evidence, found: Promise(found, endless, 1.0))
    assert not foretold(bench, plain)


def test_repeats_that_a_law_no_longer_answers_alike_are_held_against_it_all_the_same(noisy):
    """A gain that drifts answers no repeat alike; noise in front of the gap is left all the same."""
    bench, plain, _ = noisy
    drift = catalogue()["gain_drift"](Place.SENSE, "")
    drifts = drift.put_in(plain.fit.chain, {"rate": 0.1})
    before = changes(plain.fit.chain, bench.observations)[0, 0]
    assert changes(drifts, bench.observations)[0, 0] < 0.5 * before
    assert changes(drifts, bench.observations, plain.fit.chain)[0, 0] > 0.9 * before


@pytest.mark.parametrize("scattered", [True, False])
def test_what_shakes_the_borders_and_ratchets_nothing_is_no_noise_in_front_of_them(noisy, scattered, monkeypatch):
    """A contact that makes elsewhere at every turn scatters as slow noise in front of it would."""
    bench, plain, _ = begun(Concealed("scattered_gap", {"sd": 0.03})) if scattered else noisy
    there = bench.fitted(LAW.put_in(plain.fit.chain, {"sd": SD_V, "bandwidth": BANDWIDTH_HZ}), (LAW,))
    assert ratchets(bench, there) is not scattered
    asked = list[set[str]]()

    def found(bench: Bench, *_: object, **__: object) -> tuple[Bench, Hypothesis, list[Round]]:
        asked.append({kind.id for kind in bench.kinds})
        return bench, there if "process_noise" in asked[-1] else plain, []

    monkeypatch.setattr("identify.explain.beside.selected", found)
    assert selected_either(bench, plain, quiet, may_wander=False)[1] is (plain if scattered else there)
    assert [len(kinds) for kinds in asked[1:]] == ([len(asked[0]) - 1] if scattered else [])


def kinds_tried(readings, monkeypatch):
    """Return the ids of the effects with which what is missing is selected, every time it is."""
    tried = list[set[str]]()

    def noted(bench: Bench, plain: Hypothesis, *_: object) -> tuple[Bench, Hypothesis, list[Round]]:
        tried.append({kind.id for kind in bench.kinds})
        return bench, plain, []

    for name in ("selected_beside", "selected_either"):
        monkeypatch.setattr(sys.modules[explain.__module__], name, noted)
    _found(readings, quiet, Look((), against=readings.plain.fit.chain))
    return tried


@pytest.mark.parametrize("noise", [False, True])
@pytest.mark.parametrize("law", [
    Concealed("source_line", {"amplitude": 0.1, "frequency": 333.7}),
    Concealed("reference_ripple", {"share": 0.03, "frequency": 86.3}),
    Concealed("wearing_gap", {"rate": 0.02}),
], ids=["line", "ripple", "gap"])  # fmt: skip
def test_nothing_acts_by_chance_where_a_law_foretells_all_that_repeats_differ_by(law, noise, monkeypatch):
    """So is it where the stimulus makes a line go up and down, and where a gap wears from repeat to repeat."""
    there = runs(law, *([NOISY] if noise else []))
    readings = read(model_of(OP_AMP), there, (), ready, Look(()))
    assert foretells_all(readings.bench, readings.plain) is not noise
    tried = kinds_tried(readings, monkeypatch)
    assert ["process_noise" in kinds for kinds in tried] == [noise]
    assert "hum" in tried[0]


@pytest.mark.parametrize(("physics", "foretold"), [
    ((Concealed("sawtooth", {"size": 0.005, "frequency": 97.3}),), True),
    ((Concealed("sawtooth", {"size": 0.005, "frequency": 97.3}), NOISY), False),
    ((Concealed("hum at sense", {"frequency": 50.0, "amplitude": 0.01, "third": 0.0, "fifth": 0.0}), NOISY), False),
    ((Concealed("hum at sense", {"frequency": 137.0, "amplitude": 0.03, "third": 0.0, "fifth": 0.0}), NOISY), False),
], ids=["wave", "beside noise", "mains behind it", "line that goes on behind it"])  # fmt: skip
def test_a_wave_in_front_of_the_gap_need_not_foretell_all_where_its_line_goes_on(physics, foretold):
    """It has overtones without end, and what a few of them leave is no noise in front of the gap."""
    readings = read(model_of(OP_AMP), runs(*physics, stimuli=OFTEN), (), ready, Look(()))
    before, chance = differ(readings.plain.fit.chain, readings.bench.observations)
    assert np.all(before > chance)
    assert foretells_all(readings.bench, readings.plain) is foretold


@pytest.mark.parametrize(("left", "most"), [((170e3, 110e3, 47e3), True), ((710e3, 110e3, 47e3), False)])
def test_a_wave_foretells_most_in_all_runs_together(left, most):
    """Where F moves little its overtones count for more: of a sawtooth that was clear, 39 % were left there."""
    assert _is_most(np.array([1490e3, 748e3, 122e3]), np.array(left)) is most


@pytest.mark.parametrize(("frequency_hz", "line_hz", "of_it"), [
    (97.3, 97.4, True), (48.7, 97.4, True), (19.48, 97.4, False), (93.0, 97.4, False), (100.2, 100.3, False),
    (100.7, 100.6, True),
])  # fmt: skip
def test_a_line_is_that_of_a_law_at_its_frequency_or_at_an_overtone(frequency_hz, line_hz, of_it):
    """A fifth overtone has no weights, and what goes at twice the frequency of the mains has a name."""
    assert _is_of(Wave(Place.G1, (frequency_hz,)), line_hz) is of_it
    assert not _is_of(Wave(Place.SENSE, (frequency_hz,)), line_hz)
    assert not _is_of(LevelMap(Place.G1, (0.0, frequency_hz)), line_hz)


@pytest.mark.parametrize(("physics", "alone"), [
    ((Concealed("crossover", {"dead": 1.0}),), True),
    ((Concealed("crossover", {"dead": 1.0}), NOISY), False),
    ((Concealed("crossover", {"dead": 1e-4}),), False),
], ids=["large", "beside noise", "too little to tell"])  # fmt: skip
def test_a_large_mismatch_that_comes_back_is_not_made_by_chance(physics, alone, monkeypatch):
    """Of a small one chance may be a part that no repeat shows."""
    readings = read(model_of(OP_AMP), runs(*physics), (), ready, Look(()))
    assert comes_back(readings.bench, readings.plain) is alone
    tried = kinds_tried(readings, monkeypatch)
    assert tried
    assert all(("process_noise" in kinds) is not alone for kinds in tried)


def test_no_law_foretells_what_noise_in_front_of_the_gap_makes():
    readings = read(model_of(OP_AMP), runs(NOISY), (), lambda data: prepared(model_of(OP_AMP), data, ()), Look(()))
    before, chance = differ(readings.plain.fit.chain, readings.bench.observations)
    assert np.any(before > CLEARLY * chance)
    assert not foretells_all(readings.bench, readings.plain)


def test_a_ripple_of_the_gap_is_held_against_noise_at_the_frequency_its_fit_asks_for():
    """Told from a gap that rests it is off by so much that noise in front of the gap would be the likelier."""
    bench, plain, _ = begun(Concealed("hum at F", {"frequency": 86.3, "amplitude": 0.3}))
    (found,) = (s for s in bench.suspects(plain) if s.correction.form == GapRipple.form)
    begins = fitted_from(bench, plain, finer(bench.evidence(plain), found, 1.0))
    ((_, there),) = _fitted(bench, plain, [found])
    assert there.fit.chain.added[0].knots[0] == pytest.approx(86.3, abs=1e-3)
    assert price(bench, there) < 0.1 * price(bench, begins)


def test_physics_that_the_noise_had_hidden_is_found_beside_it():
    answer = explain(model_of(OP_AMP), runs(NOISY, TILTED))
    assert [effect.id for effect in answer.effects] == ["process_noise", "plateau_tilt"]
    noise, tilt = answer.effects
    assert noise.parameters["sd"][0].low < SD_V < noise.parameters["sd"][0].high
    assert tilt.parameters["k"][0].low < 0.003 < tilt.parameters["k"][0].high
    assert min(noise.probability, tilt.probability) > 0.9


def test_one_more_number_counts_once_it_explains_more_than_the_weights_may_leave(beside):
    bench, base = beside
    more = replace(base.fit, coordinates=(*base.fit.coordinates, base.fit.coordinates[-1]))
    rivals = [replace(base, fit=more, chi2=base.chi2 - share * bench.rough) for share in (0.5, 1.5)]
    assert _ahead(bench, rivals[0], base, 1000.0) == pytest.approx(-np.log(1000.0))
    assert _ahead(bench, rivals[1], base, 1000.0) == rivals[1].advantage(base, 1000.0) > 0.0
    sure = replace(bench, carried=None)
    assert _ahead(sure, rivals[0], base, 1000.0) == rivals[0].advantage(base, 1000.0)


def test_noise_is_measured_again_beside_what_else_is_found(beside):
    bench, base = beside
    again, found = weighed_again(bench, base)
    assert again.carried.rough == bench.carried.rough > 0.0
    assert found.effects == base.effects
    before, after = (np.log(h.fit.chain.values["process_noise.sd"]) for h in (base, found))
    assert abs(after - before) < 2.0 * SURE[0]  # what the differences of repeats tell of it, both times


def test_intervals_of_the_noise_hold_what_its_rough_law_may_be_off_by(noisy, beside):
    bench, base = beside
    (law,) = base.effects
    mean = bench.without(base, law).chi2 - base.chi2
    assert bench.carried.rough >= 0.2 * mean > 0.0
    size, band = (p.name for p in law.parameters())
    assert 1.0 < rougher(bench, base, law, size) <= (1.0 + 0.2 * mean / 1.96**2) ** 0.5
    assert rougher(bench, base, catalogue()["plateau_tilt"](Place.F), "plateau_tilt.k") == 1.0
    mean = noisy[0].fitted(base.fit.chain, base.effects)
    explained = noisy[0].without(mean, law).chi2 - mean.chi2
    for name in (size, band):
        assert rougher(noisy[0], mean, law, name) == pytest.approx((1.0 + 0.2 * explained / 1.96**2) ** 0.5)


def test_no_interval_of_the_noise_holds_what_repeats_exclude(beside, monkeypatch):
    """Where the mean explains very much, all it may be off by would hide a size of any order of magnitude."""
    bench, base = beside
    (law,) = base.effects
    worse = replace(base, chi2=base.chi2 + 1e6)
    monkeypatch.setattr(Bench, "without", lambda self, hypothesis, effect: worse)
    for parameter, sure in zip(law.parameters(), SURE, strict=True):
        there, sd = base.fit.chain.values[parameter.name], base.fit.sd(parameter.name)
        assert rougher(bench, base, law, parameter.name) * sd / there == pytest.approx(max(sure, sd / there))


def test_what_is_foretold_is_believed_before_chance(noisy, monkeypatch):
    bench, plain, _ = noisy
    found = (bench, plain, [])
    monkeypatch.setattr("identify.explain.beside._is_another", lambda *those: False)
    monkeypatch.setattr("identify.explain.beside.selected", lambda *asked, by_chance: found)
    assert selected_either(bench, plain, quiet, may_wander=False) is found
    explained = replace(plain, chi2=float(plain.count))
    monkeypatch.setattr("identify.explain.beside.selected", lambda *asked, by_chance: (bench, explained, []))
    monkeypatch.setattr("identify.explain.beside.carried", lambda *asked: pytest.fail("nothing is left to explain"))
    assert selected_either(bench, plain, quiet, may_wander=True)[1] is explained


@pytest.mark.parametrize(("share", "times"), [(0.5 * SCATTERED, 0), (2.0 * SCATTERED, 1)])
def test_noise_is_not_asked_for_where_all_that_is_left_comes_back(share, times, noisy, monkeypatch):
    bench, plain, _ = noisy
    found, asked = (bench, plain, []), []
    monkeypatch.setattr("identify.explain.beside._is_another", lambda *those: False)
    monkeypatch.setattr("identify.explain.beside.selected", lambda *those, by_chance: found)
    monkeypatch.setattr("identify.explain.beside.unrepeated", lambda chain, observations: share)
    monkeypatch.setattr("identify.explain.beside.selected_beside", lambda *those: asked.append(those))
    assert plain.proven > 0.0
    assert selected_either(bench, plain, quiet, may_wander=True) is found
    assert len(asked) == times


def test_where_noise_wins_a_round_it_is_asked_at_once_whether_it_is_there(noisy, beside, monkeypatch):
    """And once: what other laws would explain beside its mean alone is not looked for first."""
    bench, plain, _ = noisy
    found, asked = (*beside, []), []
    monkeypatch.setattr("identify.explain.beside.selected_beside", lambda *those: asked.append(those) or found)
    noisiest = replace(plain, effects=beside[1].effects, chi2=0.5 * plain.chi2)
    monkeypatch.setattr(Bench, "round", lambda self, base, least=0.0: Round(base, 1, (noisiest,)))
    monkeypatch.setattr("identify.explain.select._unended", lambda *those: None)
    monkeypatch.setattr("identify.explain.select.exchanged", lambda *those: pytest.fail("other laws were tried"))
    assert selected_either(bench, plain, quiet, may_wander=True) is found
    assert len(asked) == 1


@pytest.mark.parametrize(("clearly", "promised", "may_wander", "there", "at_once"), [
    (True, False, True, True, True), (False, False, True, True, False), (True, True, True, True, False),
    (True, False, False, True, False), (True, False, True, False, False),
])  # fmt: skip
def test_noise_is_asked_before_any_law_where_repeats_clearly_differ_and_nothing_foretells_it(
    clearly, promised, may_wander, there, at_once, noisy, monkeypatch
):
    bench, plain, _ = noisy
    beside, found, asked = (bench, plain, []), (bench, replace(plain, chi2=float(plain.count)), []), []
    sizes, chance = differ(plain.fit.chain, bench.observations)
    assert np.any(sizes > CLEARLY * chance)
    seen = sizes if clearly else 0.99 * CLEARLY * chance
    monkeypatch.setattr("identify.explain.beside.differ", lambda *those: (seen, chance))
    monkeypatch.setattr("identify.explain.beside.foretold", lambda *those: promised)
    monkeypatch.setattr(
        "identify.explain.beside.selected_beside", lambda *those: asked.append(those) or (beside if there else None)
    )
    monkeypatch.setattr("identify.explain.beside.selected", lambda *those, by_chance: found)
    assert (selected_either(bench, plain, quiet, may_wander) is beside) is at_once
    assert len(asked) == (clearly and not promised and may_wander)


@pytest.mark.parametrize(("share", "promised", "times"), [(0.9, False, 1), (0.9, True, 0), (0.3, False, 0)])
def test_noise_is_asked_at_once_where_most_of_what_a_law_leaves_is_another_in_every_repeat(
    share, promised, times, noisy, monkeypatch
):
    """Beside rails, a second round was raced for half a minute before noise won it. Not where a law foretells it."""
    bench, plain, _ = noisy
    path = catalogue()["feedthrough"](Place.SENSE)
    found, asked = (bench, plain, []), []
    monkeypatch.setattr("identify.explain.beside._is_another", lambda *those: False)
    monkeypatch.setattr("identify.explain.beside.selected_beside", lambda *those: asked.append(those) or found)
    monkeypatch.setattr("identify.explain.beside.unrepeated", lambda chain, observations: share)
    monkeypatch.setattr("identify.explain.beside.foretold", lambda *those: promised)
    won = replace(plain, effects=(path,), chi2=0.5 * plain.chi2)
    monkeypatch.setattr(Bench, "round", lambda self, base, least=0.0: Round(base, 1, () if base is won else (won,)))
    monkeypatch.setattr("identify.explain.select._unended", lambda *those: None)
    monkeypatch.setattr("identify.explain.select.exchanged", lambda *those: None)
    monkeypatch.setattr("identify.explain.select._is_all", lambda *those: True)
    monkeypatch.setattr("identify.explain.select.resettled", lambda bench, best: best)
    monkeypatch.setattr("identify.explain.select.pruned", lambda bench, best: best)
    monkeypatch.setattr("identify.explain.beside._scattered", lambda *those: False)
    assert (selected_either(bench, plain, quiet, may_wander=True) is found) is bool(times)
    assert len(asked) == times


def test_names_beside_noise_are_held_against_corrections_beside_that_noise(noisy, beside, monkeypatch):
    """Whether the noise is there was asked before; a name that is not earned leaves it."""
    weighed, base = beside
    named = replace(base, effects=(*base.effects, catalogue()["feedthrough"](Place.SENSE)), chi2=base.chi2 - 100.0)
    rounds = [Round(weighed.without(base, base.effects[0]), 0, (base,)), Round(base, 1, (named,))]
    held: list[Hypothesis] = []
    monkeypatch.setattr("identify.explain.warrant._challenged", lambda bench, plain, names: held.append(plain) or True)
    monkeypatch.setattr("identify.explain.warrant.located", lambda bench, asked: Located(asked, (), 1.0))
    monkeypatch.setattr("identify.explain.warrant._outdone", lambda *those: True)
    told = warranted(weighed, rounds[0].base, named, rounds)
    assert held == [told.hypothesis] == [told.beyond.base]
    assert told.hypothesis.effects == base.effects


def test_a_name_that_is_not_earned_leaves_the_noise_beside_which_it_was_found(beside, monkeypatch):
    """Where both that noise and the name won their rounds, and where the noise is carried without having won one."""
    weighed, base = beside
    bare_of_it = weighed.without(base, base.effects[0])
    named = replace(base, effects=(*base.effects, catalogue()["feedthrough"](Place.SENSE)), chi2=base.chi2 - 100.0)
    asked: list[Hypothesis] = []

    def told(bench: Bench, hypothesis: Hypothesis) -> Located:
        asked.append(hypothesis)
        return Located(hypothesis, ((OffsetOverClock(Place.F, (0.0, 1.0)), hypothesis),), 0.0)

    monkeypatch.setattr("identify.explain.warrant.located", told)
    monkeypatch.setattr("identify.explain.warrant._challenged", lambda *those: True)
    monkeypatch.setattr("identify.explain.warrant._outdone", lambda *those: False)
    monkeypatch.setattr("identify.explain.warrant._needless", lambda *those: False)
    monkeypatch.setattr("identify.explain.warrant._doubtful", lambda beyond, effect, told: not effect.by_chance)
    for first in (Round(bare_of_it, 0, (base,)), Round(bare_of_it, 0, ())):
        asked.clear()
        found = warranted(weighed, bare_of_it, named, [first, Round(base, 1, (named,))])
        assert found.hypothesis.effects == found.beyond.base.effects == base.effects
        assert sum(h.effects == base.effects for h in asked) == 1


def test_a_line_that_foretells_what_repeats_differ_by_is_believed_before_noise(noisy, beside, monkeypatch):
    bench, plain, _ = noisy
    line = catalogue()["hum"](Place.G1)
    told = replace(plain, effects=(line,), chi2=0.5 * price(*beside))
    fitted = Bench.fitted
    monkeypatch.setattr("identify.explain.beside.carried", lambda *asked: beside)
    monkeypatch.setattr(Bench, "explainable", lambda self, base: 0.0)
    monkeypatch.setattr(Bench, "round", lambda self, base, least=0.0: Round(base, 0, (told,)))
    monkeypatch.setattr(
        Bench, "fitted",
        lambda self, chain, effects, *more: told if line in effects else fitted(self, chain, effects, *more),
    )  # fmt: skip
    assert selected_beside(bench, plain, quiet) is None
    told = replace(told, chi2=plain.chi2)  # a line that does not
    found = selected_beside(bench, plain, quiet)
    assert found is not None
    assert found[1] is beside[1]


def test_nothing_is_said_of_noise_whose_place_another_law_took(noisy, beside, monkeypatch):
    monkeypatch.setattr("identify.explain.beside.carried", lambda *asked: beside)
    monkeypatch.setattr(Bench, "explainable", lambda self, base: float("inf"))
    monkeypatch.setattr("identify.explain.beside.selected", lambda bench, base, *more: (bench, noisy[1], []))
    assert selected_beside(noisy[0], noisy[1], quiet) is None


def test_a_gap_of_no_width_and_numbers_that_nothing_can_be_simulated_with_end_no_search(noisy, monkeypatch):
    bench, plain, _ = noisy
    shut = plain.fit.chain.with_values({"F.D_U": plain.fit.chain.values["F.D_L"]})
    assert carried(bench, replace(plain, fit=replace(plain.fit, chain=shut))) is None

    def refuses(*asked):
        raise ValueError("no such chain")

    monkeypatch.setattr("identify.effects.process_noise.wander_of", refuses)
    assert carried(bench, plain) is None


def test_w_wanders_where_a_border_is_within_reach_and_nowhere_else(noisy):
    bench, plain, _ = noisy
    chain = LAW.put_in(plain.fit.chain, {"sd": SD_V, "bandwidth": BANDWIDTH_HZ})
    o = bench.observations[1]
    it = wander_of(chain, o, SD_V, "white", BANDWIDTH_HZ)
    still = it.gains == 0.0
    assert 0.05 < np.mean(still) < 0.95
    assert np.all(it.keeps[still] == 1.0)
    assert np.all((it.keeps > 0.0) & (it.keeps <= 1.0))
    assert np.max(it.gains) <= 2.0 * (OP_AMP.s_l * SD_V / o.noise_v) ** 2
    larger = wander_of(chain, o, 2.0 * SD_V, "white", BANDWIDTH_HZ)
    assert np.sum(larger.gains) > 2.0 * np.sum(it.gains)


def test_the_law_the_data_are_weighed_beside_is_not_dropped_from_a_set(beside):
    bench, base = beside
    tilt = catalogue()["plateau_tilt"](Place.F)
    both = bench.fitted(tilt.put_in(base.fit.chain, {"k": 1e-6}), (*base.effects, tilt))
    alone = [replace(both, effects=(effect,), chi2=0.5 * both.chi2) for effect in reversed(both.effects)]
    loaded = replace(bench, known={h.effects: h for h in alone})
    assert pruned(loaded, both).effects == base.effects
    assert pruned(replace(loaded, carried=None, known=dict(loaded.known)), both).effects != both.effects


def test_of_corrections_only_what_the_law_cannot_leave_is_told(beside):
    bench, base = beside
    known = replace(bench.carried, rough=100.0)
    coarse, fine = (replace(s, squares=np.array([1e4])) for s in (_of(bench, base, 8), _of(bench, base, 300)))
    assert known.leaves(coarse)
    assert not known.leaves(replace(coarse, squares=np.array([99.0])))
    assert not known.leaves(fine)


def _of(bench, base, knots):
    """Return a suspect with a correction of so many knots."""
    some = suspects(bench.evidence(base))[0]
    return replace(some, correction=replace(some.correction, knots=tuple(np.linspace(0.0, 1.0, knots))))


def test_what_weights_hide_of_stepping_wants_no_finer_grid(noisy, beside):
    chain, (o, *_) = beside[1].fit.chain, noisy[0].observations
    coarse = replace(o, substeps=1, left_out=None)
    hidden = replace(coarse, colour=beside[0].observations[0].colour)
    assert refined(hidden, chain).substeps < refined(coarse, chain).substeps


def test_rows_of_readings_that_count_are_weighed_as_whole_runs_are(beside):
    (o, *_) = beside[0].observations
    use = o.use.copy()
    use[100:130] = False
    lost = replace(o, use=use, colour=Colour(wander=replace(o.colour.wander, use=use)))
    rows = np.random.default_rng(5).standard_normal((2, o.trace.size)) * o.noise_v
    whole = [whitened(lost, row)[use] for row in rows]
    assert np.allclose(weighed(rows[:, use], lost), whole, rtol=1e-12, atol=1e-12)


def test_numbers_are_held_near_what_repeats_tell_of_each(beside):
    bench, base = beside
    names = [p.name for p in base.effects[0].parameters()]
    aside = np.log([base.fit.chain.values[name] for name in names]) + np.array([0.5, -0.5])
    pull = Pull(lambda chain: np.log([chain.values[name] for name in names]), aside, np.array([1e-3, 1e-3]))
    held = replace(bench, carried=replace(bench.carried, pull=pull)).fitted(base.fit.chain, base.effects)
    assert np.log([held.fit.chain.values[name] for name in names]) == pytest.approx(aside, abs=0.01)
