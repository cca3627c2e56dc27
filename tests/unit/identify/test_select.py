"""Are effects chosen early looked at again once those found after them are known?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.candidates import Candidate
from identify.effects import catalogue, chain_of
from identify.effects.effect import Effect
from identify.explain.bench import Bench
from identify.explain.decide import decided, overtaking
from identify.explain.exchange import exchanged
from identify.explain.hypothesis import Hypothesis
from identify.explain.locate import Located, located
from identify.explain.neighbours import resettled
from identify.explain.plain import prepared
from identify.explain.promise import Pair, Promise
from identify.explain.prune import simplified
from identify.explain.race import DECISIVE
from identify.explain.rivals import odds
from identify.explain.round import Round, kind_of, lagging, outdone, ranked, richer, unforeseen
from identify.explain.screen import RoundOf
from identify.explain.searching import Searching
from identify.explain.select import (
    ALL,
    _belongs,
    _explainable,
    _from_another,
    _hopeless,
    _is_all,
    _settled,
    selected,
)
from identify.explain.suspect import Suspect
from identify.explain.weights import Carried
from identify.fit import Pull, chi_squared
from identify.holdout import split
from identify.phases import angles_of, scanned
from identify.stage import Place
from identify.unnamed.maps import LevelMap
from tests.proof.ask import known_effects, parted
from tests.proof.bench import record
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP, RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.proof.trial import Key, drawn
from tests.trials import model_of, noisy, observed, recorded

NOISE_V = 0.010
TRUTH = {"saturation.lower": -12.3, "feedthrough.k": 0.011}
RAIL = catalogue()["saturation"](Place.F, "lower")
DIODE = catalogue()["soft_saturation"](Place.F, "diode lower")
BYPASS = catalogue()["feedthrough"](Place.SENSE)
KNEE = {"soft_saturation.level": 12.3, "soft_saturation.knee": 0.01, "soft_saturation.slope": 0.0}


@pytest.fixture(scope="module")
def bench() -> Bench:
    """Return a bench with a recording in which a rail and a feedthrough are concealed."""
    concealed = (
        Concealed("saturation", {"upper": float("inf"), "lower": -12.3}),
        Concealed("feedthrough", {"k": 0.011}),
    )
    walk = staircase("walk", FIG13_LEVELS_V, 0.02)
    observation = observed(recorded(OP_AMP, walk, concealed, NOISE_V, seed=7), NOISE_V)
    return Bench(chain_of(model_of(OP_AMP)), (observation,), (), tuple(catalogue().values()))


def fitted(bench: Bench, *effects: Effect) -> Hypothesis:
    """Return a set of effects fitted from near the truth."""
    return bench.fitted(bench.with_effects(effects, TRUTH | KNEE), effects)


@pytest.fixture(scope="module")
def rounds(bench: Bench) -> list[Round]:
    """Return a first round won by the knee of a diode, ahead of the rail that is there."""
    return [Round(bench.fitted(bench.plain, ()), 0, (fitted(bench, DIODE), fitted(bench, RAIL)))]


def test_an_effect_is_exchanged_when_another_does_better_beside_those_found_later(bench, rounds):
    chosen = fitted(bench, DIODE, BYPASS)
    better = exchanged(bench, chosen, rounds)
    assert better.effects == (RAIL, BYPASS)
    assert better.advantage(chosen) > 0.0
    assert better.fit.chain.values["saturation.lower"] == pytest.approx(-12.3, abs=0.02)


def test_an_effect_that_does_best_stays(bench, rounds):
    chosen = fitted(bench, RAIL, BYPASS)
    assert exchanged(bench, chosen, rounds) is chosen


def test_what_an_effect_was_exchanged_for_is_among_its_rivals(bench, rounds):
    final = fitted(bench, RAIL, BYPASS)
    second = Round(rounds[0].tried[0], 0, (fitted(bench, DIODE, BYPASS),), settled=final)
    probability, others = odds(bench, final, RAIL, [*rounds, second], Located(final, (), 1.0))
    assert second.best is final
    assert probability > 0.5
    assert all((other.id, other.probability < 0.5) == ("soft_saturation", True) for other in others)


def test_an_effect_at_another_place_is_no_rival_beside_itself():
    """A chain has no effect twice: what stood near in the first round may be in the set by now."""
    late = (Concealed("source_pole", {"tau": 3e-3}),)
    seen = observed(recorded(RC, staircase("walk", FIG13_LEVELS_V, 0.02), late, NOISE_V, seed=3), NOISE_V)
    bench = Bench(chain_of(model_of(RC)), (seen,), (), tuple(catalogue().values()))
    base, (source, before, behind) = bench.fitted(bench.plain, ()), (
        catalogue()[name](place) for name, place in (
            ("source_pole", Place.SOURCE), ("extra_pole", Place.G1), ("extra_pole", Place.G2))
    )  # fmt: skip
    values = {"source_pole.tau": 3e-3, "extra_pole.tau": 1e-4}
    first = bench.fitted(bench.with_effects((source,), values), (source,))
    near = replace(first, effects=(behind,))
    final = bench.fitted(bench.with_effects((source, before), values), (source, before))
    beyond = Located(base, (), 1, 1.0)
    _, others = odds(bench, final, source, [Round(base, 1, (first, near))], beyond)
    assert "extra_pole" not in {other.id for other in others}


@pytest.mark.parametrize(("name", "place", "equal"), [
    ("source_pole", Place.SOURCE, ("extra_pole", Place.G1)), ("extra_pole", Place.G1, ("source_pole", Place.SOURCE)),
    ("extra_pole", Place.G2, None),
])  # fmt: skip
def test_what_gives_the_same_data_is_as_likely_though_no_fit_of_it_came_near(bench, name, place, equal):
    pole = catalogue()[name](place)
    base = bench.fitted(bench.plain, ())
    final = replace(base, effects=(pole,), chi2=base.chi2 - 1e4)
    step = Round(base, 1, (final,))
    probability, others = odds(bench, final, pole, [step], Located(final, (), 1.0))
    assert [(o.id, o.stage) for o in others] == ([(equal[0], equal[1].label)] if equal else [])
    assert all(o.probability == pytest.approx(probability) for o in others)


def test_a_form_with_one_parameter_more_is_tried_where_the_best_leaves_more_than_noise(bench):
    base, rail = bench.fitted(bench.plain, ()), fitted(bench, RAIL)
    (both,) = bench.fuller(base, [rail])  # the feedthrough is not explained yet
    assert both.effects == (catalogue()["saturation"](Place.F, "both"),)
    assert both.fit.chain.values["saturation.lower"] == pytest.approx(-12.3, abs=0.05)
    assert bench.fuller(base, [fitted(bench, RAIL, BYPASS)]) == []


def test_a_second_limit_is_looked_for_from_where_the_first_one_is_and_one_that_is_not_there_is_none():
    """No step leads away from a rail at infinity."""
    rails = (Concealed("saturation", {"upper": 11.0, "lower": -14.0}),)
    seen = observed(recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), rails, NOISE_V, seed=7), NOISE_V)
    both, above = (catalogue()["saturation"](Place.F, form) for form in ("both", "upper"))
    bench = Bench(chain_of(model_of(OP_AMP)), (seen,), (), tuple(catalogue().values()))
    base = bench.fitted(bench.plain, ())
    upper = bench.fitted(bench.with_effects((above,), {"saturation.upper": 11.0}), (above,))
    (found,) = bench.fuller(base, [upper])
    assert found.effects == (both,)
    values = found.fit.chain.values
    assert [values[f"saturation.{end}"] for end in ("upper", "lower")] == pytest.approx([11.0, -14.0], abs=0.02)
    assert bench.possible(found)
    assert not bench.possible(bench.fitted(bench.with_effects((both,), upper.fit.chain.values), (both,)))


def test_nothing_is_compared_on_finer_grids_where_nothing_comes_near_to_a_name(bench, monkeypatch):
    asked: list[object] = []
    monkeypatch.setattr(Bench, "refined", lambda self, chain: asked.append(chain) or self)
    base, rail = replace(bench.fitted(bench.plain, ()), chi2=1e6), fitted(bench, RAIL)
    for share, looks in ((0.05, 0), (0.15, 1), (0.5, 1)):
        this = Round(base, 0, (replace(rail, chi2=base.chi2 - share * (base.chi2 - base.count)),))
        asked.clear()
        assert decided(bench, this) == (bench, this)
        assert len(asked) == looks


@pytest.mark.parametrize(("off_v", "won_by"), [(0.0, RAIL), (1.3, DIODE)])
def test_what_finer_grids_bring_near_a_winner_that_leaves_much_is_fitted_there(bench, monkeypatch, off_v, won_by):
    """Of 5.8 million of a pole far above the noise the steps of the samples left 7,000, a resonance 5,000."""
    finer = replace(bench, known={}, asked={})
    monkeypatch.setattr(Bench, "refined", lambda self, chain: finer)
    base, won = bench.fitted(bench.plain, ()), fitted(bench, DIODE)
    there = fitted(bench, RAIL).fit.chain
    off = there.with_values({"saturation.lower": there.values["saturation.lower"] + off_v})
    rail = bench.fitted(off, (RAIL,), 0)
    coarse = replace(won, chi2=won.count + 2e4), replace(rail, chi2=won.count + 3e4)
    used, this = decided(bench, Round(base, 0, coarse))
    assert used is finer
    assert this.tried[0].effects == (won_by,)
    assert this.tried[0].chi2 < min(h.chi2 for h in coarse)


def test_all_is_explained_where_what_is_left_may_be_noise_and_corrections_find_nothing_in_it(bench, monkeypatch):
    """How large noise is nobody knows to the last: what is left may be physics of less than that."""
    base = bench.fitted(bench.plain, ())
    promise = Suspect(LevelMap(Place.F, (-1.0, 0.0, 1.0), "map"), np.ones(3), np.zeros(3), {})
    for left, gain, complete in ((0.5, 500.0, True), (1.5, 500.0, False), (1.5, 5.0, True), (2.5, 5.0, False)):
        hypothesis = replace(base, chi2=(1.0 + left * bench.noise_known) * base.count)
        found = [replace(promise, squares=np.full(3, gain / 3.0))]
        monkeypatch.setattr(Bench, "suspects", lambda self, asked, found=found: found)
        assert bench.complete(hypothesis) is complete
        assert bench.complete(replace(hypothesis, swell=20.0)) is (left < 1.0)


@pytest.mark.parametrize(("gain", "left", "swell", "every"), [
    (3.0, 0.0, 1.0, False),  # what may show to no correction is looked for all the same
    (30.0, 0.0, 1.0, True),  # a hint is enough
    (3.0, 2.5, 1.0, True),  # more is left than noise may make
    (3.0, 0.0, 20.0, True),  # chance is noise to corrections
])  # fmt: skip
def test_no_law_is_tried_where_no_correction_has_even_a_hint_of_it(bench, monkeypatch, gain, left, swell, every):
    base = bench.fitted(bench.plain, ())
    base = replace(base, chi2=(1.0 + left * bench.noise_known) * base.count, swell=swell)
    found = [Suspect(LevelMap(Place.F, (-1.0, 0.0, 1.0), "map"), np.ones(3), np.full(3, gain / 3.0), {})]
    monkeypatch.setattr(Bench, "suspects", lambda self, asked: found)
    looked: list[str] = []
    monkeypatch.setattr("identify.explain.screen.candidates", lambda _, kinds: looked.extend(k.id for k in kinds) or [])
    this = bench.round(base)
    alone = {"adc_clipping", "adc_quantisation", "clock_skew", "hum", "process_noise"}
    assert {*looked} == (set(catalogue()) if every else alone)
    assert this.looks == sum(len(list(kind.variants())) for kind in catalogue().values())  # all the same


def test_what_was_not_looked_for_counts_against_a_discovery_all_the_same(bench):
    """A clean rig had a clipped ADC with 0.86: of 5 kinds that were tried one did what one of 34 does by chance."""
    base = replace(bench.fitted(bench.plain, ()), chi2=96_000, count=96_000)
    won = replace(base, effects=(RAIL,), chi2=base.chi2 - 16.5)
    assert won.gains_enough(base)
    assert Round(base, 8, (won,)).best is won
    assert Round(base, 80, (won,)).best is None


def test_a_hypothesis_is_fitted_again_on_other_grids_alone_and_once(bench, monkeypatch):
    base = bench.fitted(bench.plain, ())
    assert bench.again(base) is base
    finer = replace(bench, observations=tuple(replace(o, substeps=2) for o in bench.observations), known={}, asked={})
    there = finer.again(base)
    assert there is not base
    assert there is finer.again(base) is finer.again(there)
    looks: list[int] = []
    monkeypatch.setattr("identify.explain.free_form.all_wanders", lambda base, seen: bool(looks.append(1)) or True)
    assert located(finer, there) is located(finer, there)
    assert len(looks) == 1


@pytest.mark.parametrize(("ends_at", "grids"), [(1.5, 2), (3.0, 3)])
def test_a_fit_that_coarse_grids_mislead_is_begun_again_on_those_of_the_bench(bench, ends_at, grids, monkeypatch):
    coarse = [tuple(replace(o, substeps=o.substeps + i) for o in bench.observations) for i in (1, 2)]
    given, seen = iter([*coarse, coarse[-1]]), []
    monkeypatch.setattr(Bench, "_coarsened", lambda *_: next(given))
    searched = Searching.searched

    def noted(self, chain, effects, observations, *rest, **told):
        seen.append((chain, observations))
        found = searched(self, chain, effects, bench.observations, *rest, **told)
        return replace(found, cost=found.cost * (ends_at if observations is coarse[1] else 1.0))

    monkeypatch.setattr(Searching, "searched", noted)
    begun = bench.plain.with_values({"G2.den.s1": 1.1 * bench.plain.values["G2.den.s1"]})
    bench.fitted(begun, ())
    assert [observations for _, observations in seen] == [*coarse, bench.observations][:grids]
    assert (seen[-1][0] is begun) is (grids == 3)


def test_what_a_further_effect_may_bring_ahead_is_undecided(bench):
    """The winner leaves more than it leads by: its own values may stand in for what is not found yet."""
    base, won, rail = bench.fitted(bench.plain, ()), fitted(bench, DIODE), fitted(bench, RAIL)
    far = 1e4  # of chi-squared, behind the winner: hopeless on what is known so far
    for left, names in ((2.0 * far, ("soft_saturation", "saturation")), (0.5 * far, ("soft_saturation",))):
        winner = replace(won, chi2=won.count + left)
        this = Round(base, 0, (winner, replace(rail, chi2=winner.chi2 + far), replace(won, chi2=winner.chi2 + far)))
        assert tuple(h.effects[-1].id for h in this.undecided) == names


def test_a_law_is_undecided_at_every_place_of_its_own(bench):
    base, won = bench.fitted(bench.plain, ()), fitted(bench, RAIL)
    lags = [replace(won, effects=(catalogue()["resonance"](place),)) for place in (Place.G2, Place.G1, Place.G2)]
    assert Round(base, 0, (won, *lags)).undecided == (won, *lags[:2])


DRAWN = {  # what a key draws, where how clearly that shows takes a minute to be told
    Key(27, "pair", "pair", 5): (
        Concealed("process_noise", {"sd": 0.0005714627153810562, "bandwidth": 394.5371690707889}),
        Concealed("dac_quantisation", {"lsb": 0.006629956946617298}),
    )
}


@pytest.mark.parametrize(("key", "runs", "alone", "names"), [
    (Key(27, "pair", "pair", 5), ("staircase_small", "sine_large", "minor_loops"), set(),
     {"process_noise", "dac_quantisation"}),  # most of the misfit is chance
    (Key(28, "pair", "pair", 1), (), {"extra_pole", "rate_dependent_gap"}, {"resonance", "plateau_tilt"}),
], ids=["beside chance", "at another place"])  # fmt: skip
def test_both_of_two_are_found(key, runs, alone, names, monkeypatch):
    if key in DRAWN:
        monkeypatch.setattr("tests.proof.trial._pieces", lambda *_: [(one, 0.0) for one in DRAWN[key]])
    trial = drawn(key, known_effects())
    train, test = parted(record(trial))
    train = [trace for trace in train if not runs or trace.name in runs]
    model = model_of(trial.nominal)
    there, plain = prepared(model, split(model, train, test), list(set(known_effects()) - names - alone))
    _, found, _ = selected(there, plain, lambda sentence, share: None)
    assert set(found.names) == names
    assert {(f.id, f.stage) for f in trial.expected} == {(e.id, e.place.label) for e in found.effects}


def test_what_first_order_does_not_foresee_is_fitted_where_its_start_gains_much(bench):
    def promise(effect: Effect, start: float, gain: float, slack: float) -> Promise:
        return Promise(Candidate(effect, {}, start), bench.plain, gain, slack)

    fitted = promise(RAIL, 100.0, 120.0, 1.0)
    mistaken, sure, faint = (
        promise(BYPASS, 60.0, -20.0, 80.0), promise(DIODE, 60.0, 20.0, 5.0), promise(BYPASS, 10.0, -20.0, 80.0),
    )  # fmt: skip
    promises, base = [sure, mistaken, faint, fitted], bench.fitted(bench.plain, ())
    nearly_all, poor = (replace(base, chi2=share * base.chi2 + (1.0 - share) * base.count) for share in (0.05, 0.3))
    there = base.chi2 - base.count
    assert unforeseen(promises, [fitted], [nearly_all], base, there) == [mistaken]
    assert unforeseen(promises, [fitted], [poor], base, there) == [sure, mistaken, faint]  # plain values hide all
    assert unforeseen(promises, [fitted], [poor], base, 0.7 * there) == [mistaken]  # corrections find no more
    assert unforeseen(promises, [fitted], [poor], replace(base, effects=(BYPASS,)), there) == [mistaken]


def test_a_step_that_no_slope_leads_to_is_looked_for_before_a_second_law_is():
    """Half a step off at the highest level, the DAC had a dielectric beside it, with 0.99."""
    trial = drawn(Key(84, "single", "dac_quantisation", 0), known_effects())
    train, test = parted(record(trial))
    model, few = model_of(trial.nominal), {"dac_quantisation", "dielectric_absorption"}
    there, plain = prepared(model, split(model, train[:4], test[:1]), list(set(known_effects()) - few))
    _, found, _ = selected(there, plain, lambda sentence, share: None)
    assert found.names == ("dac_quantisation",)
    assert found.fit.chain.values["dac_quantisation.lsb"] == pytest.approx(trial.physics[0].values["lsb"], rel=1e-3)


def test_a_large_law_of_the_source_is_fitted_though_first_order_prefers_others():
    """The plain values have moved to stand in for it: to first order a capacitor in G1 promises six times as much."""
    trial = drawn(Key(22, "single", "source_nonlinearity", 0), known_effects())
    train, test = parted(record(trial))
    train = [trace for trace in train if trace.name in ("staircase_small", "sine_large", "sine_fast")]
    model = model_of(trial.nominal)
    few = set(known_effects()) - {"source_nonlinearity", "capacitor_nonlinearity", "self_heating"}
    there, plain = prepared(model, split(model, train, test), list(few))
    assert there.round(plain).tried[0].names == ("source_nonlinearity",)


@pytest.mark.parametrize(("part", "found", "belongs"), [
    (0.2, 0.0, True), (0.4, 0.0, False), (0.2, 2e4, True), (0.2, 4e4, False),
])  # fmt: skip
def test_a_further_law_explains_its_part_of_what_is_proven_and_of_what_corrections_find(
    bench, monkeypatch, part, found, belongs
):
    squares = np.array([found + 1.0])
    monkeypatch.setattr("identify.explain.bench.suspects", lambda evidence: [Suspect(None, squares, squares, {})])
    start = replace(bench.fitted(bench.plain, ()), count=100_000, noise_known=0.0, chi2=3e5)
    base = replace(start, effects=(BYPASS,), chi2=1.2e5)
    law = replace(base, effects=(BYPASS, RAIL), chi2=1.14e5)  # 30 % of what is left
    assert _belongs(start, Round(base, 0, (law,)), part, part * _explainable(bench, base)) is belongs
    assert _explainable(bench, replace(base, swell=9.0)) == base.proven  # corrections find most of all what chance made


def test_beside_chance_a_law_that_takes_all_of_next_to_nothing_does_not_belong(bench):
    """What is left may be noise, whose variance is known to a hundredth: all of that is no more than chance."""
    start = replace(bench.fitted(bench.plain, ()), count=100_000, noise_known=0.01, chi2=1e7)
    base = replace(start, effects=(BYPASS,), chi2=100_060.0, swell=4.0)
    law = replace(base, effects=(BYPASS, RAIL), chi2=100_002.0)
    assert not _belongs(start, Round(base, 0, (law,)), 0.4, 0.4 * _explainable(bench, base))
    alone = [replace(h, swell=1.0) for h in (base, law)]
    assert _belongs(start, Round(alone[0], 0, (alone[1],)), 0.4, 0.4 * 60.0)


def test_what_promises_less_than_its_part_is_not_fitted(bench):
    base = fitted(bench, RAIL)
    assert bench.round(base).tried
    assert not bench.round(base, base.chi2).tried


def test_a_law_that_foretells_a_scatter_is_before_chance_that_could_have_made_it(bench):
    base = replace(bench.fitted(bench.plain, ()), chi2=1.2e5, count=100_000)
    chance = replace(base, effects=(BYPASS,), chi2=1.001e5, swell=60.0)
    whole, part = (replace(base, effects=(effect,), chi2=chi2) for effect, chi2 in ((RAIL, 1.015e5), (DIODE, 1.05e5)))
    assert ranked(base, [part, whole, chance]) == (whole, chance, part)
    assert ranked(base, [part, chance]) == (chance, part)
    weak = replace(whole, chi2=1.01e5)
    little = replace(base, chi2=1.015e5)  # all of it may be noise: half of it is not foretold
    assert ranked(little, [weak, chance]) == (chance, weak)


def test_a_lag_is_fitted_where_first_order_promises_nothing(monkeypatch):
    walk, law = staircase("walk", FIG13_LEVELS_V, 0.03), Concealed("rate_dependent_gap", {"k": 1e-3})
    kinds = tuple(catalogue()[name] for name in ("rate_dependent_gap", "dead_time", "feedthrough"))
    late = observed(recorded(OP_AMP, walk, (law,), NOISE_V, seed=13), NOISE_V)
    there = Bench(chain_of(model_of(OP_AMP)), (late,), (), kinds)
    there = there.refined(there.plain)
    monkeypatch.setattr("identify.explain.screen.hopeful", lambda screened, runs: [])
    this = there.round(there.fitted(there.plain, ()))
    assert {h.names for h in this.tried} == {("rate_dependent_gap",), ("dead_time",)}
    assert this.tried[0].fit.chain.values["rate_dependent_gap.k"] == pytest.approx(1e-3, rel=0.01)


def test_lags_are_fitted_once_each_where_the_best_fit_leaves_much(bench):
    base = bench.fitted(bench.plain, ())
    late, gap, pole = (catalogue()[name] for name in ("dead_time", "rate_dependent_gap", "extra_pole"))
    screened = [
        Candidate(effect, {}, gain) for gain, effect in enumerate(
            (RAIL, late(Place.G2), pole(Place.G1), pole(Place.G2), gap(Place.F), gap(Place.F)))
    ]  # fmt: skip
    poor = replace(base, effects=(late(Place.G2),), chi2=0.8 * base.chi2)
    there = base.chi2 - base.count
    assert lagging(screened, [poor], base, False, there) == screened[2:5]
    assert lagging(screened, [], base, False, 0.0) == []
    whole = replace(poor, chi2=1.01 * base.count)  # it explains all; starts that explain as much as its own may, too
    assert lagging(screened, [whole], base, False, there) == screened[2:5]
    weak = [replace(candidate, gain=0.05 * candidate.gain) for candidate in screened[1:]]
    assert lagging([replace(screened[0], gain=1.0), *weak], [whole], base, False, there) == []


def test_what_acts_by_chance_is_fitted_where_the_misfit_differs_from_repeat_to_repeat(bench):
    base = bench.fitted(bench.plain, ())
    screened = [Candidate(catalogue()["process_noise"](Place.G1, form), {}, 1.0) for form in ("white", "low-pass")]
    assert lagging(screened, [], base, False, 1.0) == []
    assert lagging(screened, [], base, True, 1.0) == screened[:1]


def test_what_promises_more_than_the_best_fit_kept_is_fitted_too(bench, monkeypatch):
    base, rail = bench.fitted(bench.plain, ()), fitted(bench, RAIL)
    first, second, third = (
        Promise(Candidate(effect, {}, 0.0), bench.plain, gain)
        for effect, gain in ((DIODE, 900.0), (RAIL, 300.0), (BYPASS, 50.0))
    )
    assert outdone([first, second, third], [first], 100.0) == [second]
    assert outdone([first, second, third], [first], 900.0) == []
    asked: list[list[Promise]] = []
    known: list[list[float]] = []

    def raced(bench, base, promises, ahead=()):
        asked.append(list(promises))
        known.append([h.chi2 for h in ahead])
        fall = {DIODE: 100.0, RAIL: 290.0}
        return [replace(rail, chi2=base.chi2 - fall[p.candidate.effect]) for p in promises]

    monkeypatch.setattr("identify.explain.screen.raced", raced)
    monkeypatch.setattr("identify.explain.screen.hopeful", lambda screened, runs: [first, second, third])
    monkeypatch.setattr("identify.explain.screen.promised", lambda evidence, hope: hope)
    monkeypatch.setattr("identify.explain.screen.promising", lambda hopes, tried, runs: [first])
    monkeypatch.setattr("identify.explain.screen.doubled", lambda bench, base, tried, least: list(tried))
    monkeypatch.setattr(Bench, "fuller", lambda self, base, tried: [])
    monkeypatch.setattr("identify.explain.screen.lagging", lambda *screened: [])
    monkeypatch.setattr("identify.explain.screen.unforeseen", lambda hopes, *rest: [])
    this = bench.round(base)
    assert asked[:2] == [[first], [second]]
    assert known == [[], [base.chi2 - 100.0], [base.chi2 - 100.0, base.chi2 - 290.0]]  # those behind are not fitted on
    assert base.chi2 - this.tried[0].chi2 == pytest.approx(290.0)


def test_a_fit_on_coarser_grids_ends_where_one_on_the_grids_of_the_bench_does():
    lagging = recorded(RC, sine("fast", 31.25, 8.0, 8, 1), (Concealed("extra_pole in G2", {"tau": 0.57e-3}),))
    bench = Bench(chain_of(model_of(RC)), (observed(noisy(lagging, 2e-5, 5), 2e-5, 16),), (), ())
    pole = catalogue()["extra_pole"](Place.G2)
    found = bench.fitted(bench.with_effects([pole], {"extra_pole.tau": 4e-4}), [pole])
    finely = bench.finely(found)
    plainly = [replace(o, substeps=4) for o in bench.observations]  # the coarser grid without what the finer one adds
    assert abs(sum(chi_squared(found.fit.chain, o) for o in plainly) - found.chi2) > 10.0 * DECISIVE
    assert found.chi2 == pytest.approx(finely.chi2, abs=DECISIVE)
    for name in ("extra_pole.tau", "G1.den.s1", "F.D_L"):
        assert found.fit.chain.values[name] == pytest.approx(finely.fit.chain.values[name], abs=finely.fit.sd(name))


@pytest.mark.parametrize(("behind", "tried"), [(2.0, False), (20.0, True), (1e4, True), (1e5, False)])
def test_one_more_value_of_a_law_may_bring_a_part_of_a_large_mismatch(bench, behind, tried):
    """Where the best may leave noise alone: rails 10,000 above the noise lacked the resistor of a diode."""
    base = replace(fitted(bench, RAIL), effects=(), chi2=1e8)
    best = replace(base, effects=(RAIL,), chi2=float(base.count))
    other = replace(best, effects=(DIODE,), chi2=best.chi2 + behind)
    assert richer(base, [best, other]) == [best, *([other] if tried else [])]


def test_what_came_close_is_compared_on_grids_fine_enough_for_all_of_it():
    late = recorded(RC, staircase("walk", FIG13_LEVELS_V, 0.02), (Concealed("dead_time", {"delay": 63.4e-6}),))
    observation = observed(noisy(late, 2e-3, 5), 2e-3, 1)
    bench = Bench(chain_of(model_of(RC)), (observation,), (), tuple(catalogue().values()))
    delay, pole = catalogue()["dead_time"](Place.G2), catalogue()["extra_pole"](Place.G2)
    base = bench.fitted(bench.plain, ())
    values = {"dead_time.delay": 6e-5, "extra_pole.tau": 6e-5}
    tried = [bench.fitted(bench.with_effects([e], values), [e]) for e in (pole, delay)]
    coarse = Round(base, 0, tuple(sorted(tried, key=lambda h: -h.advantage(base))))
    finer, compared = decided(bench, coarse)
    assert finer.observations[0].substeps > 1
    assert compared.base.effects == ()
    assert {h.effects for h in compared.tried} == {(delay,), (pole,)}
    again = next(h for h in compared.tried if h.effects == (delay,))
    assert again.chi2 == pytest.approx(tried[1].chi2, abs=1.0)  # a delay is fitted as finely as it needs from the first
    assert again.fit.chain.values["dead_time.delay"] == pytest.approx(63.4e-6, rel=0.05)


def test_a_plain_fit_that_had_not_come_to_its_end_is_no_physics():
    clean = recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), (), NOISE_V, seed=4)
    kinds = tuple(catalogue()[name] for name in ("feedthrough", "source_pole", "source_nonlinearity"))
    bench = Bench(chain_of(model_of(OP_AMP)), (observed(clean, NOISE_V),), (), kinds)
    off = bench.plain.with_values({"G1.den.s1": 1.1 * bench.plain.values["G1.den.s1"]})
    stuck = bench.fitted(off, (), 0)
    assert stuck.misfit > 1.0
    _, final, rounds = selected(bench, stuck, lambda sentence, share: None)
    assert final.effects == ()
    assert abs(final.misfit) < 0.1
    assert rounds[0].base.misfit == pytest.approx(final.misfit)


def test_what_was_passed_over_is_fitted_where_the_grid_of_the_fits_brings_it_near():
    slow = recorded(RC, staircase("walk", FIG13_LEVELS_V, 0.02), (Concealed("extra_pole in G2", {"tau": 63.4e-6}),))
    observation = observed(noisy(slow, 2e-3, 5), 2e-3, 1)
    bench = Bench(chain_of(model_of(RC)), (observation,), (), tuple(catalogue().values()))
    delay, pole = catalogue()["dead_time"](Place.G2), catalogue()["extra_pole"](Place.G2)
    base = bench.fitted(bench.plain, ())
    only = bench.fitted(bench.with_effects([delay], {"dead_time.delay": 6e-5}), [delay])
    near, far = (bench.with_effects([pole], {"extra_pole.tau": tau}) for tau in (6e-5, 5e-3))
    passed = tuple(Promise(Candidate(pole, {}, 0.0), chain, 0.0, slack=500.0) for chain in (near, far))
    this = Round(base, 0, (only,), passed_over=passed)
    (late,) = overtaking(bench, this, only.chi2, base)
    assert late.chi2 < only.chi2
    assert late.fit.chain.values["extra_pole.tau"] == pytest.approx(63.4e-6, rel=0.1)


def test_a_rival_far_behind_is_not_fitted_to_the_end_on_finer_grids(bench, monkeypatch):
    base, rail, diode = bench.fitted(bench.plain, ()), fitted(bench, RAIL), fitted(bench, DIODE)
    asked: list[tuple[tuple[Effect, ...], int]] = []

    def fitting(diode_chi2):
        mine = {(): base, (RAIL,): rail, (DIODE,): replace(diode, chi2=diode_chi2)}

        def again(self, chain, effects, iterations=40):
            asked.append((tuple(effects), iterations))
            h = mine[tuple(effects)]
            return replace(h, fit=replace(h.fit, converged=iterations > 4))

        return again

    monkeypatch.setattr(Bench, "refined", lambda self, chain: replace(self))
    monkeypatch.setattr(Round, "close", property(lambda self: self.tried))
    for behind, ended in ((500.0, {(RAIL,), ()}), (20.0, {(RAIL,), (DIODE,), ()})):
        asked.clear()
        monkeypatch.setattr(Bench, "fitted", fitting(rail.chi2 + behind))
        decided(bench, Round(base, 0, (rail, diode)))
        assert {effects for effects, iterations in asked if iterations > 4} == ended


def test_only_the_angles_of_what_is_added_are_looked_for_all_around():
    line = {"frequency": 50.0, "amplitude": 0.05, "third": 0.0, "fifth": 0.0}
    trace = recorded(RC, sine("fast", 31.25, 8.0, 8, 1), (Concealed("hum at sense", line),))
    seen = (observed(trace, 1e-3),)
    hum, plain = catalogue()["hum"](Place.SENSE, ""), chain_of(model_of(RC))
    chain = hum.put_in(plain, {**line, "phase": 2.0})
    turned = scanned(chain, seen, angles_of(hum.parameters()))
    phase = f"hum.phase[{trace.name}]"
    assert sum(chi_squared(turned, o) for o in seen) < 0.2 * sum(chi_squared(chain, o) for o in seen)
    assert turned.values[phase] != pytest.approx(2.0, abs=0.3)
    assert scanned(chain, seen, angles_of(RAIL.parameters())) is chain


def test_steps_of_a_dac_are_looked_for_closer_once_the_rest_is_known():
    """A level that is rounded to a wrong step shows in no slope; in another run it may be one that is held long."""
    lsb = 0.013452527
    slow = sine("slow", 1e4 / 3187, 8.0, 2, 1)  # many levels
    dac = catalogue()["dac_quantisation"](Place.SOURCE)
    trace = recorded(OP_AMP, slow, (Concealed("dac_quantisation", {"lsb": lsb}),), 1e-3, seed=5)
    bench = Bench(chain_of(model_of(OP_AMP)), (observed(trace, 1e-3, 1),), (), (type(dac),))
    off = bench.fitted(bench.with_effects([dac], {"dac_quantisation.lsb": lsb * (1.0 + 2e-4)}), [dac])
    found = resettled(bench, off)
    assert found.chi2 < off.chi2 - 20.0
    assert abs(found.fit.chain.values["dac_quantisation.lsb"] / lsb - 1.0) < 5e-5
    rail = fitted(bench, RAIL)
    assert resettled(bench, rail) is rail


def test_a_coarse_step_that_gains_take_up_is_found_with_all_the_rest_moving(monkeypatch):
    """Most of a change of the step is one of the gains; moved alone, it only seems to make all worse."""
    lsb = 0.04356571734361154
    levels = tuple(float(v) for v in np.random.default_rng(4).uniform(-8.0, 8.0, 30))
    dac = catalogue()["dac_quantisation"](Place.SOURCE)
    played = (staircase("walk", levels, 0.02), sine("slow", 1e4 / 3187, 8.0, 2, 1))
    runs = [recorded(OP_AMP, s, (Concealed("dac_quantisation", {"lsb": lsb}),), 1e-3, seed=5) for s in played]
    bench = Bench(chain_of(model_of(OP_AMP)), tuple(observed(run, 1e-3, 1) for run in runs), (), (type(dac),))
    off = bench.fitted(bench.with_effects([dac], {"dac_quantisation.lsb": lsb * (1.0 - 2e-4)}), [dac])
    found = resettled(bench, off)
    assert abs(found.fit.chain.values["dac_quantisation.lsb"] / lsb - 1.0) < 5e-5
    monkeypatch.setattr(type(dac), "leaps", lambda effect, chain, observations: [])
    assert resettled(bench, off).chi2 > found.chi2 + 20.0


@pytest.mark.parametrize("side", ["upper", "lower"])
def test_a_limit_that_is_not_met_is_let_go(side):
    rails = {"upper": 11.0, "lower": -12.3}
    there = Concealed("saturation", {"upper": float("inf"), "lower": float("-inf")} | {side: rails[side]})
    trace = recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), (there,), NOISE_V, seed=7)
    bench = Bench(chain_of(model_of(OP_AMP)), (observed(trace, NOISE_V),), (), tuple(catalogue().values()))
    both = catalogue()["saturation"](Place.F, "both")
    values = {"saturation.upper": 13.9, "saturation.lower": -17.9} | {f"saturation.{side}": rails[side]}
    found = simplified(bench, bench.fitted(bench.with_effects((both,), values), (both,)))
    assert [effect.form for effect in found.effects] == [side]
    assert found.fit.chain.values[f"saturation.{side}"] == pytest.approx(rails[side], abs=0.02)


@pytest.mark.parametrize(
    ("laws", "free", "ends"),
    [
        (0.5, 0.2, True),  # what one correction makes and no laws do is in no catalogue
        (0.5, 0.4, False),  # it is nearly as good: laws may still come
        (0.001, -0.1, False),  # all is explained
    ],
)
def test_a_search_ends_where_one_correction_leaves_far_less_than_the_laws_found(
    bench: Bench, laws: float, free: float, ends: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    start = bench.fitted(bench.plain, ())
    best, told = (replace(start, chi2=(1.0 + misfit) * start.count) for misfit in (laws, free))
    correction = LevelMap(Place.F, (-5.0, 0.0, 5.0))
    monkeypatch.setattr("identify.explain.select.located", lambda *_: Located(start, ((correction, told),), 1e-12))
    assert _hopeless(bench, start, best) == (told.chi2 if ends else 0.0)
    assert not _hopeless(bench, start, replace(best, swell=2.0))  # beside chance it is not told what it is


def test_what_first_fits_show_already_is_not_sought_further(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    start = bench.fitted(bench.plain, ())
    best, first, last = (replace(start, chi2=(1.0 + misfit) * start.count) for misfit in (0.5, 0.24, 0.1))
    correction = LevelMap(Place.F, (-5.0, 0.0, 5.0))
    monkeypatch.setattr("identify.explain.select.located", lambda *_: Located(start, ((correction, last),), 1e-12))
    monkeypatch.setattr("identify.explain.select.first_fits", lambda *_: [first])
    assert _hopeless(bench, start, best) == first.chi2
    best = replace(best, chi2=1.4 * start.count)
    for near, told in ((True, last.chi2), (False, 0.0)):  # first fits do not show it: are they near enough to go on?
        monkeypatch.setattr("identify.explain.select.within_reach", lambda *_, near=near: near)
        assert _hopeless(bench, start, best) == told


@pytest.mark.parametrize(("left", "ends"), [(0.1, False), (0.4, True)])
def test_a_search_is_given_up_only_once_other_laws_had_their_turn(
    bench: Bench, left: float, ends: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A source and an ADC that bend were a source and a capacitor, and one map did better than these."""
    start = bench.fitted(bench.plain, ())
    best = replace(fitted(bench, DIODE, BYPASS), chi2=1.5 * start.count)
    other = replace(fitted(bench, RAIL, BYPASS), chi2=(1.0 + left) * start.count)
    base = replace(start, chi2=9.0 * start.count)
    this = Round(base, 0, (best,))
    monkeypatch.setattr("identify.explain.select._hopeless", lambda *_: 1.2 * start.count)
    monkeypatch.setattr("identify.explain.select._belongs", lambda *_: True)
    monkeypatch.setattr("identify.explain.select.exchanged", lambda *_: other)
    after, over = _settled(bench, base, this, [this], 0.4, 1.0)
    assert after.best is other
    assert over is ends


@pytest.mark.parametrize(("together", "one"), [(0.9, True), (1.1, False)])
def test_laws_that_promise_by_twos_all_there_is_are_looked_at_though_one_correction_tells_it_too(
    bench: Bench, together: float, one: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A path past the circuit does nearly what feedthrough and a second play do."""
    start = replace(bench.fitted(bench.plain, ()), chi2=1e7)
    law = Promise(Candidate(BYPASS, {}, 0.0), start.fit.chain, 0.0)
    first = Round(start, 0, (), pairs=(Pair(law, law, together * (start.chi2 - start.count)),))
    monkeypatch.setattr("identify.explain.select.told_by_one", lambda *_: True)
    monkeypatch.setattr("identify.explain.select.all_wanders", lambda *_: False)
    assert _is_all(bench, start, start, [first]) is one
    assert _is_all(bench, start, start, [first, first])


@pytest.mark.parametrize(("left", "rough", "ends"), [(50.0, 100.0, True), (150.0, 100.0, False), (0.0, 0.0, False)])
def test_no_law_is_looked_for_in_what_one_that_is_known_roughly_may_leave(
    bench: Bench, left: float, rough: float, ends: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Beside noise in front of the gap and a rail, a round was screened and raced for 34 s, and its laws let go."""
    start = bench.fitted(bench.plain, ())
    noise = catalogue()["process_noise"](Place.G1, "white")
    weighed = replace(bench, carried=Carried(noise, Pull(lambda _: 0.0, 0.0, 1.0), rough))
    monkeypatch.setattr("identify.explain.select._explainable", lambda *_: left)
    monkeypatch.setattr("identify.explain.select.told_by_one", lambda *_: False)
    monkeypatch.setattr("identify.explain.select.all_wanders", lambda *_: False)
    assert _is_all(weighed, start, start, [Round(start, 0, ())]) is ends
    assert not _is_all(bench, start, start, [Round(start, 0, ())])


@pytest.mark.parametrize(("swell", "laws"), [(1.0, 3), (4.0, 2)])
def test_no_third_law_is_looked_for_beside_what_chance_makes_of_the_rest(
    bench: Bench, swell: float, laws: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It took minutes, and what it found was how far the mean of chance is off."""
    start = replace(bench.fitted(bench.plain, ()), chi2=1e7)

    def found(self: Bench, base: Hypothesis, least: float = 0.0) -> Round:
        law = (BYPASS, DIODE, RAIL)[len(base.effects)]
        best = replace(base, effects=(*base.effects, law), chi2=0.5 * base.chi2, swell=swell)
        return Round(base, 0, (best,), settled=best)

    monkeypatch.setattr(Bench, "round", found)
    for name, instead in {
        "decided": lambda bench, this: (bench, this), "_settled": lambda bench, start, this, *_: (this, False),
        "resettled": lambda bench, best: best, "pruned": lambda bench, best: best,
        "_unended": lambda *_: None, "all_wanders": lambda *_: False, "_explainable": lambda *_: 1.0,
    }.items():  # fmt: skip
        monkeypatch.setattr(f"identify.explain.select.{name}", instead)
    monkeypatch.setattr(Bench, "fine_enough", lambda self, *_: self)
    _, final, rounds = selected(bench, start, lambda sentence, share: None)
    assert (len(final.effects), len(rounds)) == (laws, laws)
    monkeypatch.setattr("identify.explain.select.told_by_one", lambda *_: True)
    _, final, rounds = selected(bench, start, lambda sentence, share: None)
    assert (len(final.effects), len(rounds)) == (1, 1)  # one thing is not two


@pytest.mark.parametrize(("left", "beside", "noise_left", "again", "found"), [
    (9e5, 0.0, 0.0, False, True), (0.0, 0.0, 0.0, False, False), (9e5, 0.0, 0.5, False, False),
    (9e5, 5e6, 0.0, False, False), (9e5, 0.0, 0.0, True, False),
])  # fmt: skip
def test_beside_a_law_that_did_best_by_doing_part_of_anothers_nothing_is_found_and_the_others_are_asked(
    bench: Bench, left: float, beside: float, noise_left: float, again: bool, found: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A heated resistor did most of a soft saturation and of a bent capacitor: it was named alone, with 0.8."""
    start = replace(bench.fitted(bench.plain, ()), chi2=1e7)

    def with_laws(chi2: float, *effects: Effect) -> Hypothesis:
        return replace(fitted(bench, *effects), chi2=chi2)

    best = BYPASS if again else DIODE  # beside that law the other was tried, and explained too little
    winner, other = with_laws(start.count + left, best), with_laws(start.count + 1.2e6 + beside, RAIL)
    both = with_laws(start.count * (1.0 + noise_left), RAIL, BYPASS)
    first, second = Round(start, 8, (winner, other)), Round(winner, 8, ())
    asked: list[tuple[Hypothesis, float, Effect]] = []

    def considered(_: Bench, base: Hypothesis, least: float, unwanted: Effect) -> Round:
        asked.append((base, least, unwanted))
        return Round(base, 8, (both,)).without(unwanted)

    monkeypatch.setattr(Bench, "round", considered)
    rounds, (_, then) = _from_another(bench, first, second)
    assert asked == ([(other, ALL * (other.chi2 - other.count), best)] if left and not beside else [])
    assert (then.best is both) is found
    assert (rounds.tried == (other,)) is found  # what misled is no rival
    if not found:
        assert (rounds, then) == (first, second)


def test_a_law_that_is_not_wanted_is_left_out_of_a_round_before_it_is_fitted(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So is what acts by chance; where nothing promises enough no further question is asked."""
    base = bench.fitted(bench.plain, ())
    best = bench.round(base).tried[0].effects[-1]
    others = bench.round(base, 0.0, best)
    assert others.tried
    assert best.id not in {h.effects[-1].id for h in others.tried if h.effects[-1].place is best.place}
    noise, wanted = catalogue()["process_noise"](Place.G1), RoundOf(bench.kinds, 0.0, kind_of(best))
    elsewhere = type(best)(next(place for place in Place if place is not best.place))
    assert [wanted.wants(law) for law in (best, elsewhere, noise)] == [False, True, False]
    assert RoundOf(bench.kinds, 0.0).wants(noise)
    asked: list[Hypothesis] = []
    monkeypatch.setattr(Bench, "complete", lambda _, hypothesis: asked.append(hypothesis) or True)
    assert bench.round(base, 2.0 * base.chi2, best).tried == ()
    assert asked == []
    assert bench.round(base, 2.0 * base.chi2).tried == ()
    assert asked == [base]
