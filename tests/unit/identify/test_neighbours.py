"""Is a law that could rest at several values told with all of them?"""

from math import exp, log1p

import pytest

from identify.effects import catalogue, chain_of
from identify.explain.bench import Bench
from identify.explain.neighbours import WITHIN, resettled, settled, spanning
from identify.stage import Place
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 2e-3
SECOND, FEEDTHROUGH = catalogue()["second_play"](Place.F), catalogue()["feedthrough"](Place.SENSE)
BARE, RESISTOR = (catalogue()["diode_clamp"](Place.F, form) for form in ("upper", "upper, resistor"))
SOFT = catalogue()["soft_saturation"](Place.F, "diode upper")
TRUE = {"gap": 1.0, "weight": 6e-4}


@pytest.fixture(scope="module")
def bench() -> Bench:
    run = recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), (Concealed("second_play", TRUE),), NOISE_V, 3)
    return Bench(chain_of(model_of(OP_AMP)), (observed(run, NOISE_V, 2),), (), ())


def test_a_fit_that_rests_at_the_wrong_place_moves_on_and_its_interval_holds_what_is_as_good(bench: Bench) -> None:
    wrong = bench.fitted(bench.with_effects([SECOND], {"second_play.gap": 2.4, "second_play.weight": 6e-4}), [SECOND])
    best, others = settled(bench, wrong)
    assert best.chi2 <= bench.finely(wrong).chi2
    assert all(best.fit.distance(other) > 0.3 for other in others)
    assert all(other.cost < best.fit.cost + 2.0 * WITHIN for other in others)
    for name, true in TRUE.items():
        told = spanning(f"second_play.{name}", 1.0, best.fit, others)
        assert told.low <= true <= told.high


def test_other_places_that_are_as_good_are_found_and_widen_the_interval(bench: Bench) -> None:
    high = bench.fitted(bench.with_effects([SECOND], {"second_play.gap": 3.5, "second_play.weight": 6e-4}), [SECOND])
    best, others = settled(bench, bench.finely(high))
    assert others
    told, own = spanning("second_play.gap", 1.0, best.fit, others), best.fit.ci95("second_play.gap")
    assert told.high - told.low > own[1] - own[0]
    assert (told.low, told.high) == (
        min(f.ci95("second_play.gap")[0] for f in (best.fit, *others)),
        max(f.ci95("second_play.gap")[1] for f in (best.fit, *others)),
    )


def test_a_law_of_one_number_has_no_second_place_to_rest_at(bench: Bench) -> None:
    only = bench.fitted(bench.with_effects([FEEDTHROUGH], {"feedthrough.k": 1e-3}), [FEEDTHROUGH])
    best, others = settled(bench, only)
    assert others == ()
    assert spanning("feedthrough.k", 1.0, best.fit, others).low == best.fit.ci95("feedthrough.k")[0]


def test_steps_of_a_dac_are_compared_once_more_beside_what_was_found_since(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Alone, the steps had been found at a size at which they stood in for a part of the feedthrough, too."""
    dac, true = catalogue()["dac_quantisation"](Place.SOURCE), {"lsb": 0.0373}
    hidden = (Concealed("dac_quantisation", true), Concealed("feedthrough", {"k": 0.02}))
    run = recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), hidden, NOISE_V, 3)
    there = Bench(chain_of(model_of(OP_AMP)), (observed(run, NOISE_V, 2),), (), ())
    alone = there.fitted(there.with_effects([dac], {"dac_quantisation.lsb": 0.0411}), [dac])
    both = there.with_effects([dac, FEEDTHROUGH], {"dac_quantisation.lsb": 0.0411, "feedthrough.k": 0.02})
    wrong = there.fitted(both, [dac, FEEDTHROUGH])
    found = resettled(there, wrong)
    assert found.effects == wrong.effects
    assert found.chi2 < wrong.chi2 - 100.0
    assert found.fit.chain.values["dac_quantisation.lsb"] == pytest.approx(true["lsb"], rel=2e-3)
    assert resettled(there, alone).fit.chain.values["dac_quantisation.lsb"] == pytest.approx(0.0411, rel=2e-2)
    rests = resettled(there, found)
    monkeypatch.setattr(Bench, "fitted", None)  # asked again of what rests, nothing is fitted
    assert resettled(there, rests) is rests


def diode(level: float, n_vt: float, series: float) -> tuple[Bench, dict[str, float]]:
    """Return a bench with a walk whose level a diode with a resistor in line clamps, and its values by full name."""
    values = {"level": level, "knee": n_vt, "series": series, "drop": n_vt * exp(-level / n_vt)}
    run = recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), (Concealed("diode_clamp", values),), NOISE_V, 3)
    told = {"knee": level - n_vt * log1p(series), "n_vt": n_vt, "slope": series / (1.0 + series)}
    there = Bench(chain_of(model_of(OP_AMP)), (observed(run, NOISE_V, 2),), (), (), noise_known=0.03)
    return there, {f"diode_clamp.{n}": v for n, v in told.items()}


def test_an_interval_holds_what_a_number_more_allows_that_the_data_do_not_ask_for() -> None:
    there, true = diode(13.0, 0.7, 0.25)
    bare = there.fitted(there.with_effects([BARE], true), [BARE])
    with_resistor = there.fitted(there.with_effects([RESISTOR], true), [RESISTOR])
    assert bare.advantage(with_resistor) > 0.0  # the resistor is not asked for
    best, others = settled(there, bare)
    own = best.fit.ci95("diode_clamp.knee")
    assert not own[0] <= true["diode_clamp.knee"] <= own[1]
    for name in ("diode_clamp.knee", "diode_clamp.n_vt"):
        told = spanning(name, 1.0, best.fit, others)
        assert told.low <= true[name] <= told.high
    (other,) = others
    low, high = other.ci95("diode_clamp.slope")
    assert low == 0.0 <= true["diode_clamp.slope"] <= high <= 0.97  # no slope is below none


def test_no_law_is_shut_out_for_a_number_it_was_not_given() -> None:
    there, true = diode(12.0, 0.9, 0.25)
    plain, bare = there.fitted(there.plain, ()), there.fitted(there.with_effects([BARE], true), [BARE])
    knee = {"soft_saturation.level": 11.3, "soft_saturation.knee": 0.9, "soft_saturation.slope": 0.5}
    soft = there.fitted(there.with_effects([SOFT], knee), [SOFT])
    assert soft.misfit < there.noise_known
    assert bare.advantage(soft) < -50.0
    ahead = max(there.fuller(plain, [soft, bare]), key=lambda h: h.advantage(soft))
    assert ahead.effects == (RESISTOR,)
    assert ahead.advantage(soft) > 0.0


def test_a_law_as_good_as_the_best_is_given_no_number_more() -> None:
    there, true = diode(13.0, 0.7, 0.25)
    plain, bare = there.fitted(there.plain, ()), there.fitted(there.with_effects([BARE], true), [BARE])
    knee = {"soft_saturation.level": 12.9, "soft_saturation.knee": 0.7, "soft_saturation.slope": 0.3}
    soft = there.fitted(there.with_effects([SOFT], knee), [SOFT])
    assert abs(soft.chi2 - bare.chi2) < 3.0
    best = min((soft, bare), key=lambda h: h.chi2)
    assert {h.effects[-1].id for h in there.fuller(plain, [soft, bare])} <= {best.effects[-1].id}
