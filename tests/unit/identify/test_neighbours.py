"""Is a law that could rest at several values told with all of them?"""

import pytest

from identify.effects import catalogue, chain_of
from identify.explain.bench import Bench
from identify.explain.neighbours import WITHIN, settled, spanning
from identify.stage import Place
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 2e-3
SECOND, FEEDTHROUGH = catalogue()["second_play"](Place.F), catalogue()["feedthrough"](Place.SENSE)
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
