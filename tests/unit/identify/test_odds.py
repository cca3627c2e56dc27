"""Are findings, starts and doubts weighed as the statistics they are taken from say?"""

import importlib
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from identify.chain import plain_chain, simulate
from identify.colour import Colour, Sizes
from identify.effects import catalogue, chain_of
from identify.effects.effect import Effect
from identify.explain import explain
from identify.explain.bench import Bench
from identify.explain.confirm import improvement, unconfirmed
from identify.explain.hypothesis import FALSE_DISCOVERIES, Hypothesis, is_discovery
from identify.explain.locate import Located
from identify.explain.rivals import UNHEARD, _of_every_name, odds, ordinary, unheard
from identify.explain.round import Round
from identify.explain.warrant import Warranted
from identify.fit import fit
from identify.levels import merit
from identify.stage import Place
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP, RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, noisy, observed, recorded

NOISE_V = 0.01
PLAIN = plain_chain(model_of(OP_AMP))
CLEAN = recorded(OP_AMP, sine("sine", 31.25, 8.0, 8, 1), (), fine=1)
SEEN = [observed(noisy(replace(CLEAN, y=simulate(PLAIN, CLEAN)), NOISE_V, seed), NOISE_V, 1) for seed in range(200)]


def test_one_test_is_a_discovery_at_its_level_and_many_need_more():
    assert is_discovery(0.99 * FALSE_DISCOVERIES, 1)
    assert not is_discovery(0.99 * FALSE_DISCOVERIES, 2)
    assert is_discovery(FALSE_DISCOVERIES / (3 * (1 + 1 / 2 + 1 / 3)) * 0.999, 3)


def test_a_start_of_the_wrong_size_keeps_what_its_shape_would_gain():
    assert merit(2.0 * 9.0 - 9.0, 9.0, 9.0) == pytest.approx(9.0)  # the right size: its gain
    assert merit(2.0 * 27.0 - 81.0, 27.0, 81.0) == pytest.approx(4.5)  # three times too large: half of it
    assert merit(-18.0 - 9.0, -9.0, 9.0) == 0.0  # the wrong way
    assert merit(0.0, 1.0, float("inf")) == 0.0


def test_held_out_data_of_a_clean_rig_side_with_a_change_as_seldom_as_a_normal_number_does():
    moved = PLAIN.with_values({"F.D_L": PLAIN.values["F.D_L"] + 2e-4})
    sides = np.array([improvement(moved, PLAIN, [seen]) for seen in SEEN])
    assert np.mean(sides > 1.0) < 2.0 * norm.sf(1.0)


def test_held_out_data_side_with_what_is_true():
    moved = PLAIN.with_values({"F.D_L": PLAIN.values["F.D_L"] + 5e-3})
    size = float(np.linalg.norm(simulate(moved, CLEAN) - simulate(PLAIN, CLEAN)) / NOISE_V)
    sides = np.array([improvement(PLAIN, moved, [seen]) for seen in SEEN[:50]])
    assert np.mean(sides) == pytest.approx(size, rel=0.2)


def test_held_out_data_convince_of_what_is_true_as_often_as_a_normal_number_does():
    """By how much less the right answer leaves scatters twice as much: that would convince of it more seldom."""
    moved = PLAIN.with_values({"F.D_L": PLAIN.values["F.D_L"] + 1.3e-4})
    size = float(np.linalg.norm(simulate(moved, CLEAN) - simulate(PLAIN, CLEAN)) / NOISE_V)
    often, seldom = norm.sf(2.0 - size), norm.sf(0.5 * (2.0 - size))
    assert np.mean([improvement(PLAIN, moved, [seen]) > 2.0 for seen in SEEN]) > 0.5 * (often + seldom)


@pytest.mark.parametrize(("side", "told", "fallen", "against"), [
    (-5.0, 1.9, 30.0, False),  # they cannot tell
    (1.2, 2.7, 30.0, False),  # chance may keep a right finding from the two that convince
    (0.6, 2.7, 30.0, True),
    (0.6, 2.7, 400.0, False),  # chance may not have made it
    (-0.4, 2.7, 400.0, True),
    (2.1, 50.0, 30.0, False),
    (1.9, 50.0, 400.0, True),
])
def test_held_out_data_speak_against_a_finding_only_where_they_can_tell(side, told, fallen, against):
    assert unconfirmed(side, told, fallen) is against


def test_physics_of_no_catalogue_is_the_less_likely_the_less_a_name_leaves():
    found = fit(PLAIN, SEEN[:1], fixed=("G1", "F", "G2"))
    base = Hypothesis((), found, 5000.0, 5000)
    doubts = [unheard(Located(base, (), 1.0), told) for told in (100.0, 1e4, 1e6)]
    assert doubts == sorted(doubts, reverse=True)
    assert doubts[0] < UNHEARD
    assert unheard(Located(base, (), 1e-6), 100.0) > 5.0 * doubts[0]


def test_a_misfit_that_the_noise_may_be_is_no_reason_to_ask_for_a_share_of_it():
    found = fit(PLAIN, [observed(noisy(recorded(OP_AMP, sine("a", 10.0, 3.0, 2, 1)), 0.01, 1), 0.01)], iterations=0)
    for noise_known, enough in ((0.01, False), (0.025, True)):
        base = Hypothesis((), found, 5150.0, 5000, noise_known)  # 3 % more than noise of which so much is known
        assert replace(base, chi2=5145.0).gains_enough(base) is enough


def test_a_name_is_said_before_another_one_is_said_twice():
    pole, own = ("extra_pole", Place.G1), ("extra_pole", Place.G2)
    source, delay = ("source_pole", Place.SOURCE), ("dead_time", Place.G2)
    ranked = [(pole, 0.5), (source, 0.4), (delay, 0.3)]
    assert [kind for kind, _ in _of_every_name(own, ranked)] == [source, delay]
    assert [kind for kind, _ in _of_every_name(delay, ranked[:2])] == [pole, source]
    assert [kind for kind, _ in _of_every_name(own, ranked[:2])] == [pole, source]


@pytest.mark.parametrize(("zeta", "sure"), [(0.4, True), (0.95, False)])
def test_a_resonance_that_peaks_nowhere_may_be_any_quick_filter(zeta, sure):
    """An average over some readings has its shape, too, to what the noise leaves to be seen."""
    concealed = Concealed("resonance in G2", {"w_n": 2000.0, "zeta": zeta})
    seen = observed(recorded(RC, sine("sine", 31.25, 8.0, 8, 1), (concealed,), NOISE_V, fine=8), NOISE_V)
    bench = Bench(chain_of(model_of(RC)), (seen,), (), ())
    law, plain = catalogue()["resonance"](Place.G2), bench.fitted(bench.plain, ())
    found = bench.fitted(law.put_in(bench.plain, {"w_n": 2000.0, "zeta": zeta}), (law,))
    probability, _ = odds(bench, found, law, [Round(plain, 1, (found,))], Located(found, (), 1.0))
    assert (probability > 0.9, probability <= 0.5) == (sure, not sure)
    assert probability > 0.4


@pytest.mark.parametrize(("tau", "much"), [(0.02, False), (0.03, False), (2e-3, True), (5e-6, True)])
def test_a_capacitor_that_makes_no_slow_lag_of_its_block_may_be_much_else(tau, much):
    """G1 has 20 ms, and 5 us that nobody sees: a delay that hangs on the level is such a capacitor, too."""
    law = catalogue()["capacitor_nonlinearity"](Place.G1, "straight")
    chain = law.put_in(chain_of(model_of(OP_AMP)), {"k1": 0.02, "tau": tau})
    assert law.ordinary(chain) is much


@pytest.mark.parametrize(("tau", "uneven", "much"), [(2e-4, True, True), (2e-3, True, False), (2e-4, False, False)])
def test_beside_readings_that_scatter_unlike_each_other_two_samples_may_be_their_moments(tau, uneven, much):
    """Readings that are an earlier one once more were a pole of a sample, with 0.7."""
    trace = recorded(RC, sine("sine", 31.25, 8.0, 2, 1), (), NOISE_V)
    sizes = Sizes(np.linspace(0.5, 1.5, trace.size)) if uneven else None
    seen = replace(observed(trace, NOISE_V), colour=Colour(sizes=sizes))
    bench, law = Bench(chain_of(model_of(RC)), (seen,), (), ()), catalogue()["extra_pole"](Place.G2)
    found = bench.fitted(law.put_in(bench.plain, {"tau": tau}), (law,), 0)
    assert trace.rate_hz == 1e4
    assert ordinary(bench, found, law) is much


def test_who_reads_of_a_law_with_much_company_is_told_so_and_where_else_that_may_be(monkeypatch):
    asked, doubts = [], []
    monkeypatch.setattr("identify.explain.answer.doubted", lambda _, found: doubts.append(found) or found)

    def elsewhere(bench, base):
        asked.append(base.names)
        return SimpleNamespace(places={Place.G2: 0.6, Place.F: 0.39, Place.SENSE: 0.01})

    monkeypatch.setattr("identify.explain.answer.located", elsewhere)
    concealed = (Concealed("resonance in G2", {"w_n": 2000.0, "zeta": 0.95}),)
    played = sine("sine", 31.25, 8.0, 8, 1), staircase("walk", FIG13_LEVELS_V, 0.03), sine("other", 20.0, 7.0, 20, 1)
    *seen, held_out = (recorded(RC, s, concealed, NOISE_V, i, 3.0 * i, 8) for i, s in enumerate(played))
    told = explain(model_of(RC), seen, [held_out])
    assert [(effect.id, effect.stage) for effect in told.effects] == [("resonance", "G2")]
    assert told.effects[0].probability <= 0.5
    assert told.location is not None
    assert (told.location.alternatives, told.location.same_data) == (("sense", "F"), ("sense",))
    assert "; at sense the same law would give exactly the same data; " in told.location.sentence
    assert asked == [()]  # beside what else was named: nothing here
    assert (told.verdict, doubts) == ("explained", [])  # where what little is left enters is not asked for
    assert any(text.startswith("resonance at G2 has values with which much") for text in told.warnings)


def test_what_sided_with_a_law_for_the_chance_beside_it_is_asked_again_without_that(monkeypatch):
    """Held-out runs scatter as chance would: once it is dropped, that speaks for nothing any more."""
    way = importlib.import_module("identify.explain.explain")
    law, chance = catalogue()["input_clipping"](Place.SOURCE), catalogue()["process_noise"](Place.G1)

    @dataclass(frozen=True)
    class Asked:
        effects: tuple[Effect, ...]

    class Taken:
        def without(self, hypothesis: Asked, effect: Effect) -> Asked:
            return Asked(tuple(e for e in hypothesis.effects if e is not effect))

    def speaks_against(_bench: Taken, hypothesis: Asked, effect: Effect, _test: object) -> bool:
        return effect is chance or chance not in hypothesis.effects

    monkeypatch.setattr(way, "_speaks_against", speaks_against)
    monkeypatch.setattr(way, "settled", lambda _bench, hypothesis: (hypothesis, ()))
    monkeypatch.setattr(way, "located", lambda _bench, hypothesis: Located(hypothesis, (), 1.0))
    kept, dropped = way.confirmed(Taken(), Warranted(Asked((law, chance)), Located(Asked((law,)), (), 1.0)), ())
    assert (kept.hypothesis.effects, dropped) == ((), (chance, law))
