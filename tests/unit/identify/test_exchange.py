"""Is a law put in another's place in the form, and with as few numbers, as the rest that is known asks for?"""

from dataclasses import replace

import pytest

from identify.candidates import Candidate
from identify.effects import catalogue, chain_of
from identify.effects.effect import Effect
from identify.explain.bench import Bench
from identify.explain.exchange import LAPS, crossed, exchanged, plainer, swapped
from identify.explain.locate import Located
from identify.explain.promise import promised, together
from identify.explain.prune import pruned
from identify.explain.rivals import odds
from identify.explain.round import FULLER, NEXT, WHOLE, Round, counts
from identify.stage import Place
from tests.proof.cases import Concealed
from tests.proof.rigs import LINEAR, OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
WALK = staircase("walk", FIG13_LEVELS_V, 0.03)
BYPASS = catalogue()["feedthrough"](Place.SENSE)
LEAK, BOTH = (catalogue()["plateau_droop"](Place.F, form) for form in ("leak", "leak and bias"))
CREEP = catalogue()["dielectric_absorption"](Place.F, "on plateaus")
SOFT = catalogue()["soft_saturation"]
SECOND, TILT = catalogue()["second_play"](Place.F), catalogue()["plateau_tilt"](Place.F)
TRUTH = {"feedthrough.k": 0.011, "plateau_droop.rate": 3.0, "dielectric_absorption.fraction": 0.5,
         "dielectric_absorption.tau": 0.1}  # fmt: skip


def bench(*physics: Concealed) -> Bench:
    """Return a bench with one walk of the op-amp rig with physics concealed in it."""
    seen = (observed(recorded(OP_AMP, WALK, physics, NOISE_V, seed=11), NOISE_V),)
    return Bench(chain_of(model_of(OP_AMP)), seen, (), tuple(catalogue().values()))


@pytest.fixture(scope="module")
def droops() -> Bench:
    """Return a bench whose level leaks away while a bias current charges it, and with a feedthrough.

    To zero and up to one side: the trial bench has a law of its own for either, so here it is the difference of two.
    """
    leaks, passes = Concealed("leak", {"rate": 3.0}), Concealed("feedthrough", {"k": 0.011})
    there = bench(leaks, passes)
    bias = Concealed("bias current", {"current": 4.0})
    charged = [recorded(OP_AMP, WALK, part, 0.0, seed=11) for part in ((), (bias,))]
    (seen,) = there.observations
    y = seen.trace.y[:] + charged[1].y[:] - charged[0].y[:]
    return replace(there, observations=(observed(replace(seen.trace, y=y), NOISE_V),))


def test_a_law_is_exchanged_for_another_in_the_form_that_does_best_beside_the_rest(droops: Bench) -> None:
    """Alone the leak tells one number; the second one shows once the creep that stood in its place is gone."""
    chosen = droops.fitted(droops.with_effects((CREEP, BYPASS), TRUTH), (CREEP, BYPASS))
    alone = droops.fitted(droops.with_effects((LEAK,), TRUTH), (LEAK,))
    first = Round(droops.fitted(droops.plain, ()), 0, (replace(alone, effects=(CREEP,)), alone))
    found = swapped(droops, chosen, CREEP, alone)
    assert found.effects == (BOTH, BYPASS)
    assert found.fit.chain.values["plateau_droop.current"] > 1.0
    assert exchanged(droops, chosen, [first]).effects == (BOTH, BYPASS)


@pytest.mark.parametrize(("k2", "form"), [(0.0, "cube"), (2e-3, "square and cube")])
def test_a_number_that_is_not_told_beside_the_rest_is_none_of_the_law(k2: float, form: str) -> None:
    """Alone a law may need two for what the other physics does; beside that each costs it its place."""
    there = bench(Concealed("adc_nonlinearity", {"k2": k2, "k3": -3e-4}), Concealed("feedthrough", {"k": 0.011}))
    bent = catalogue()["adc_nonlinearity"](Place.SENSE, "square and cube")
    start = {"adc_nonlinearity.k2": k2, "adc_nonlinearity.k3": -3e-4, "soft_saturation.level": 40.0, **TRUTH}
    soft = SOFT(Place.F, "tanh both")
    chosen = there.fitted(there.with_effects((soft, BYPASS), start), (soft, BYPASS))
    alone = there.fitted(there.with_effects((bent,), start), (bent,))
    assert swapped(there, chosen, soft, alone).effects == (replace(bent, form=form), BYPASS)


def test_a_fuller_form_is_fitted_once_and_to_its_end_only_where_it_may_do_better(
    droops: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    there, asked = replace(droops, known={}), []
    chosen = there.fitted(there.with_effects((CREEP, BYPASS), TRUTH), (CREEP, BYPASS))
    alone = there.fitted(there.with_effects((LEAK,), TRUTH), (LEAK,))
    worse = replace(chosen, effects=(BOTH, BYPASS), chi2=10.0 * chosen.chi2)
    monkeypatch.setattr(Bench, "reformed", lambda self, found, law, form, laps: asked.append((form, laps)) or worse)
    for _ in range(2):
        assert swapped(there, chosen, CREEP, alone).effects == (LEAK, BYPASS)
    assert asked == [(BOTH, LAPS)]


@pytest.mark.parametrize(("explained", "is_fuller"), [(0.5, False), (0.9, False), (1.5, True)])
def test_a_fuller_form_is_fitted_where_a_law_is_behind_by_a_small_part_of_what_is_explained(
    droops: Bench, monkeypatch: pytest.MonkeyPatch, explained: float, is_fuller: bool
) -> None:
    """A diode of a thousand standard deviations was given no resistor, and lost to a law that had that number."""
    chosen = droops.fitted(droops.with_effects((CREEP, BYPASS), TRUTH), (CREEP, BYPASS))
    alone = replace(chosen, effects=(LEAK,))
    behind = replace(chosen, effects=(LEAK, BYPASS), chi2=chosen.chi2 + 2.0 * FULLER)
    asked: list[Effect] = []
    without = replace(chosen, chi2=chosen.chi2 + explained * 2.0 * FULLER / NEXT)
    monkeypatch.setattr(Bench, "once", lambda self, effects, fitted: behind)
    monkeypatch.setattr(Bench, "without", lambda self, hypothesis, effect: without)
    monkeypatch.setattr("identify.explain.exchange._filled", lambda b, found, law, form: asked.append(form) or found)
    assert swapped(droops, chosen, CREEP, alone) is behind
    assert bool(asked) is is_fuller


def test_effects_beside_a_law_that_is_put_in_another_s_place_stay_where_they_have_come(
    droops: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Steps of a DAC were looked for once more beside the winner alone: all it was compared with was far behind."""
    there, begun = replace(droops, known={}), []
    own = {"feedthrough.k[walk]": 0.013}  # of one run
    chosen = there.fitted(there.with_effects((CREEP, BYPASS), TRUTH | own), (CREEP, BYPASS), 0)
    far = {"feedthrough.k": 0.5, "feedthrough.k[walk]": 0.6}
    rival = there.fitted(there.with_effects((BYPASS, LEAK), TRUTH | far), (BYPASS, LEAK), 0)
    monkeypatch.setattr(Bench, "fitted", lambda self, chain, effects, laps=0: begun.append(chain.values) or rival)
    swapped(there, chosen, CREEP, rival)
    assert begun[0]["feedthrough.k"] == TRUTH["feedthrough.k"]
    assert begun[0]["feedthrough.k[walk]"] == own["feedthrough.k[walk]"]
    assert begun[0]["plateau_droop.rate"] == TRUTH["plateau_droop.rate"]


def test_a_law_tried_late_is_fitted_beside_what_the_law_before_it_could_not_exclude(droops: Bench) -> None:
    """Beside the creep the way past the gap is not the law that promised most; beside the leak it is."""
    creep, leak = (droops.fitted(droops.with_effects((law,), TRUTH), (law,)) for law in (CREEP, BOTH))
    before = Round(droops.fitted(droops.plain, ()), 0, (replace(creep, chi2=leak.chi2 - 1.0), leak))
    effects = (CREEP, BYPASS)
    beside = droops.fitted(droops.with_effects(effects, {**TRUTH, **creep.fit.chain.values}), effects)
    (found,) = crossed(droops, beside, before, Round(creep, 0, (beside,)))
    assert found.effects == (BOTH, BYPASS)
    assert found.chi2 < beside.chi2
    told = replace(before, base=replace(before.base, chi2=0.0))  # nothing left to tell: no promise comes near
    assert crossed(droops, replace(beside, chi2=0.0), told, Round(creep, 0, (beside,))) == []


def test_two_laws_that_do_best_by_twos_are_fitted_though_neither_was_tried_alone() -> None:
    """As where each alone explains less than one wrong law does."""
    there = bench(Concealed("leak", {"rate": 0.1}), Concealed("feedthrough", {"k": 0.002}))
    base = there.fitted(there.plain, ())
    evidence = there.evidence(base)
    at = {LEAK: {"rate": 0.1}, BYPASS: {"k": 0.001}, CREEP: {"fraction": 0.001, "tau": 0.1}}
    promises = [promised(evidence, Candidate(law, values, 0.0)) for law, values in at.items()]
    pairs = together(evidence, promises)
    assert {law.candidate.effect for law in (pairs[0].one, pairs[0].other)} == {LEAK, BYPASS}
    assert pairs[0].gain > max(p.gain for p in promises)
    assert pairs[0].gain == pytest.approx(base.chi2 - base.count, rel=0.05)
    either = [*promises, promised(evidence, Candidate(BOTH, {"rate": 0.1, "bias": 0.0}, 0.0))]
    told = together(evidence, either)
    assert len(told) == len({frozenset((p.one.candidate.effect.id, p.other.candidate.effect.id)) for p in told})
    creep = there.fitted(there.with_effects((CREEP,), TRUTH), (CREEP,))
    before = Round(base, 0, (creep,), pairs=pairs)
    found = crossed(there, replace(creep, chi2=0.9 * base.chi2), before, Round(creep, 0, ()))
    best = min(found, key=lambda h: h.chi2)
    assert set(best.effects) == {LEAK, BYPASS}
    assert best.fit.chain.values["feedthrough.k"] == pytest.approx(0.002, rel=0.1)


def test_what_promises_too_little_alone_to_be_looked_at_closely_is_one_of_two_all_the_same(
    droops: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sixteen forms of bends promised more than a leak beside which one of them was all, and nothing was named."""
    monkeypatch.setattr("identify.explain.screen.LOOKED_AT", 1)
    there = replace(droops, asked={}, known={})
    (best, *_) = there.round(there.fitted(there.plain, ())).pairs
    assert "plateau_droop" in {best.one.candidate.effect.id, best.other.candidate.effect.id}
    assert best.gain > max(best.one.gain, best.other.gain)


@pytest.mark.parametrize(("law", "values", "coefficients"), [
    (catalogue()["self_heating"](Place.F), {"self_heating.k": 1e-4, "self_heating.tau": 1e-6}, {"k3": -0.0512}),
    (catalogue()["capacitor_nonlinearity"](Place.G1, "straight"),
     {"capacitor_nonlinearity.k1": 2e-3, "capacitor_nonlinearity.tau": 100.0}, {"k2": 0.008}),
], ids=["heat at once", "a capacitor that never discharges"])  # fmt: skip
def test_laws_whose_time_constants_do_not_matter_end_as_bent_borders(law, values, coefficients) -> None:
    there = bench()
    (seen,) = there.observations
    chain = there.with_effects((law,), {**there.plain.values, **values})
    y = seen.trace.y[:] + seen.residual(there.plain) - seen.residual(chain)
    there = replace(there, observations=(observed(replace(seen.trace, y=y), NOISE_V),), known={})
    found = plainer(there, there.fitted(chain, (law,)), law)
    assert found.names == ("curved_border",)
    for name, value in coefficients.items():
        assert found.fit.chain.values[f"curved_border.{name}"] == pytest.approx(value, rel=0.05)
    assert abs(found.misfit) < 0.05


def test_a_rig_without_a_gap_has_no_borders_that_a_law_could_end_as() -> None:
    straight = chain_of(model_of(LINEAR))
    warm, ceramic = catalogue()["self_heating"](Place.F), catalogue()["capacitor_nonlinearity"](Place.G1, "square")
    assert warm.plainer(warm.put_in(straight, {"k": 1e-3, "tau": 0.1})) is None
    assert ceramic.plainer(ceramic.put_in(straight, {"k2": 1e-3, "tau": 100.0})) is None


def test_a_compression_with_a_knee_is_the_diode_that_it_hardly_differs_from_and_a_tanh_is_none() -> None:
    there, law = bench(Concealed("diode_clamp", {"drop": 1e-6, "knee": 0.9})), SOFT(Place.F, "diode upper")
    start = {"soft_saturation.level": 12.5, "soft_saturation.knee": 0.9, "soft_saturation.slope": 0.0}
    soft = there.fitted(there.with_effects((law,), start), (law,))
    found = plainer(there, soft, law)
    assert found.effects == (catalogue()["diode_clamp"](Place.F, "upper"),)
    assert found.fit.chain.values["diode_clamp.n_vt"] == pytest.approx(0.9, rel=0.02)
    assert found.chi2 < soft.chi2
    tanh = SOFT(Place.F, "tanh both")
    assert tanh.plainer(tanh.put_in(there.plain, {"level": 20.0})) is None


@pytest.fixture(scope="module")
def tilted() -> Bench:
    """Return a bench with a way past the gap."""
    return bench(Concealed("plateau_tilt", {"k": 0.09}))


def test_a_second_gap_that_is_none_ends_as_the_way_past_the_gap_that_it_is(tilted: Bench) -> None:
    values = {"second_play.gap": 1e-3, "second_play.weight": 0.011}
    found = tilted.fitted(tilted.with_effects((SECOND,), values), (SECOND,))
    better = plainer(tilted, found, SECOND)
    assert better.effects == (TILT,)
    assert better.parameters == found.parameters - 1
    assert better.fit.chain.values["plateau_tilt.k"] == pytest.approx(0.09, abs=3.0 * better.fit.sd("plateau_tilt.k"))
    assert exchanged(tilted, found, []).effects == (TILT,)


def test_a_second_gap_worth_the_name_stays() -> None:
    there = bench(Concealed("second_play", {"gap": 1.3, "weight": 0.1}))
    values = {"second_play.gap": 1.3, "second_play.weight": 0.1}
    found = there.fitted(there.with_effects((SECOND,), values), (SECOND,))
    assert SECOND.plainer(found.fit.chain) is None
    assert plainer(there, found, SECOND) is found


def test_what_chance_would_make_with_one_law_of_many_is_weighed_against_nothing_and_dropped(tilted: Bench) -> None:
    """Beside a tilt that is there, a feedthrough that is not: what it gains is what noise gives away."""
    final = tilted.fitted(tilted.with_effects((TILT, BYPASS), {"plateau_tilt.k": 0.09}), (TILT, BYPASS))
    base = tilted.fitted(tilted.plain, ())
    alone = tilted.without(final, BYPASS)
    for gain, kept, least, most in ((7.0, False, 0.0, 0.5), (60.0, True, 0.85, 1.0)):
        tilted.known[(TILT,)] = replace(alone, chi2=final.chi2 + gain)
        rounds = [Round(base, 0, (alone,)), Round(alone, 0, (final,))]
        assert len(pruned(tilted, final).effects) == 1 + kept
        probability, _ = odds(tilted, final, BYPASS, rounds, Located(final, (), 1.0))
        assert least < probability < most
    tilted.known.clear()


def test_a_further_effect_counts_where_it_takes_nearly_all_that_is_left_however_little_that_is(tilted: Bench) -> None:
    start = replace(tilted.fitted(tilted.plain, ()), chi2=1e9)
    base = replace(start, chi2=2.0 * start.count)
    for share, is_counted in ((WHOLE + 0.02, True), (WHOLE - 0.02, False)):
        assert counts(start, base, replace(base, chi2=(2.0 - share) * base.count), float(base.count)) == is_counted
    assert counts(start, start, base, float(start.count))
    assert not counts(start, base, replace(base, chi2=base.chi2 - 1.0), 0.0)


def test_forms_that_contain_the_winner_s_are_compared_with_it_however_far_behind_they_are(tilted: Bench) -> None:
    """On the samples' grid a rounded slew limit may look worse than the sharp one that it contains."""
    sharp, rounded = (catalogue()["slew_limit"](Place.F, form) for form in ("", "rounded"))
    base = tilted.fitted(tilted.plain, ())
    won, far = replace(base, effects=(sharp,)), replace(base, effects=(rounded,), chi2=base.chi2 + 1e5)
    other = replace(base, effects=(TILT,), chi2=base.chi2 + 1e5)
    assert Round(base, 0, (won, other, far)).close == (won, far)


def test_what_no_first_order_foresees_is_fitted_unless_what_was_fitted_explains_it_all(
    tilted: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    monkeypatch.setattr("identify.explain.screen.unforeseen", lambda hopes, *rest: asked.append(len(hopes)) or [])
    few = replace(tilted, kinds=(catalogue()["plateau_tilt"],))
    base = few.fitted(few.plain, ())
    assert base.misfit > 0.05
    for known, looks in ((0.05, 0), (1e-9 - 1.0, 1), (1e3, 1)):  # explained; still much left; nothing known at all
        asked.clear()
        replace(few, noise_known=known, asked={}).round(base)
        assert len(asked) == looks


def test_a_creep_that_stands_in_for_a_leak_takes_no_more_than_half() -> None:
    """Without end it would become the leak, a share of many times the capacitor; nearly all of it would be a pole."""
    there = bench(Concealed("leak", {"rate": 3.0}))
    start = {"dielectric_absorption.fraction": 0.4, "dielectric_absorption.tau": 0.3}
    found = there.fitted(there.with_effects((CREEP,), start), (CREEP,))
    assert found.fit.chain.values["dielectric_absorption.fraction"] == pytest.approx(0.5)


def test_a_creep_is_never_the_wrong_way_round_and_a_capacitor_never_a_map_of_the_level(tilted: Bench) -> None:
    law = catalogue()["capacitor_nonlinearity"](Place.G2, "square")
    start = {"capacitor_nonlinearity.k2": 1e-3, "capacitor_nonlinearity.tau": 2e-3,
             "dielectric_absorption.fraction": 0.01, "dielectric_absorption.tau": 0.1}  # fmt: skip
    found = tilted.fitted(tilted.with_effects((CREEP, law), start), (CREEP, law), 1)
    names = {c.name: c for c in found.fit.coordinates}
    share, tau = names["dielectric_absorption.fraction"], names["capacitor_nonlinearity.tau"]
    assert share.value(share.bounded(-1e6)) == pytest.approx(0.0)
    assert [tau.value(tau.bounded(far)) / 2e-3 for far in (-99.0, 99.0)] == pytest.approx([0.1, 10.0])


def test_a_resonance_has_a_q_of_fifty_at_most(tilted: Bench) -> None:
    law = catalogue()["resonance"](Place.G1)
    start = {"resonance.w_n": 900.0, "resonance.zeta": 0.3}
    names = {c.name: c for c in tilted.fitted(tilted.with_effects((law,), start), (law,), 1).fit.coordinates}
    zeta = names["resonance.zeta"]
    assert zeta.value(zeta.bounded(-1e6)) == pytest.approx(0.5 / 50.0)
