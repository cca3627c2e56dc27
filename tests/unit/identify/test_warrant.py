"""When does what a name leaves speak against the name?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.effects import catalogue, chain_of
from identify.explain.bench import Bench
from identify.explain.locate import Located
from identify.explain.round import Round
from identify.explain.suspect import Suspect
from identify.explain.warrant import misplaced, warranted
from identify.stage import Place
from identify.unnamed.correction import Correction
from identify.unnamed.linear import Filter
from identify.unnamed.maps import LevelMap
from identify.unnamed.timed import OffsetOverClock
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V, TOLD = 0.010, 1e5
CLOCK, LEVEL = OffsetOverClock(Place.SENSE, (0.0, 0.1, 0.2), "map"), LevelMap(Place.SENSE, (-5.0, 0.0, 5.0), "map")
TABLE = OffsetOverClock(Place.SENSE, tuple(float(i) for i in range(500)), "map")


@pytest.mark.parametrize(
    ("name", "correction", "left", "earned"),
    [
        ("feedthrough", LEVEL, 0.03, True),
        ("feedthrough", LEVEL, 0.1, False),
        ("feedthrough", CLOCK, 0.1, True),  # what goes with the clock is no failing of a law that does not
        ("feedthrough", CLOCK, 0.7, False),  # but it must not be most of it
        ("offset_drift", CLOCK, 0.1, False),
    ],
)
def test_a_name_is_earned_unless_its_own_law_should_have_explained_what_is_left(
    name: str, correction: Correction, left: float, earned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    walk = observed(recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), (), NOISE_V, seed=7), NOISE_V)
    bench = Bench(chain_of(model_of(OP_AMP)), (walk,), (), tuple(catalogue().values()))
    effect = catalogue()[name](Place.SENSE)
    plain = bench.fitted(bench.plain, ())
    final = bench.fitted(bench.with_effects([effect], {}), [effect])
    base, winner = replace(plain, chi2=final.chi2 + (1.0 + left) * TOLD), replace(final, chi2=final.chi2 + left * TOLD)

    def beyond(_: Bench, hypothesis: object) -> Located:
        return Located(winner, ((correction, final),), 1e-12) if hypothesis is winner else Located(base, (), 1.0)

    monkeypatch.setattr("identify.explain.warrant.located", beyond)
    found = warranted(bench, base, winner, [Round(base, 0, (winner,), settled=winner)])
    assert (found.hypothesis.effects == (effect,)) is earned


@pytest.mark.parametrize(("here", "earned"), [(290.0, False), (50.0, True)])
def test_what_a_name_leaves_is_what_corrections_find_of_it(
    here: float, earned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tenth of what it explained, hidden in what nobody knows of the noise's size."""
    walk = observed(recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), (), NOISE_V, seed=7), NOISE_V)
    bench = Bench(chain_of(model_of(OP_AMP)), (walk,), (), tuple(catalogue().values()))
    effect = catalogue()["feedthrough"](Place.SENSE)
    winner = replace(bench.fitted(bench.with_effects([effect], {}), [effect]), chi2=96_000, count=96_000)
    base = replace(bench.fitted(bench.plain, ()), chi2=99_000, count=96_000)
    assert 0.4 * winner.noise_known * winner.count > 300.0
    found = ((replace(LEVEL, place=Place.F), 300.0), (LEVEL, here))
    fitted = tuple((free, replace(winner, chi2=winner.chi2 - fall)) for free, fall in found)

    def left(_: Bench, hypothesis: object) -> Located:
        return Located(winner, fitted, 1e-12) if hypothesis is winner else Located(base, (), 1.0)

    monkeypatch.setattr("identify.explain.warrant._challenged", lambda *asked: False)
    monkeypatch.setattr("identify.explain.warrant.located", left)
    told = warranted(bench, base, winner, [Round(base, 0, (winner,), settled=winner)])
    assert (told.hypothesis.effects == (effect,)) is earned


def _map_at(place: Place) -> LevelMap:
    """Return a map of the level at a place."""
    return LevelMap(place, (-5.0, 0.0, 5.0), "map")


@pytest.mark.parametrize(
    ("free", "alone", "both", "earned"),
    [
        (_map_at(Place.F), -2000.0, -2000.0, False),  # elsewhere it does better alone, and the law adds nothing
        (_map_at(Place.F), -2000.0, -2500.0, True),  # both are needed: two things differ
        (_map_at(Place.F), 20.0, -2000.0, True),  # alone it does no better than the law
        (_map_at(Place.SENSE), -2000.0, -2000.0, True),  # at the place of the law it is that law, drawn more freely
        (_map_at(Place.G2), -2000.0, -2000.0, True),  # what G2 puts out is what is read
        (Filter(Place.G2, (1e-3,), "filter"), -2000.0, -2000.0, False),  # but dynamics are those of G2 first
    ],
)
def test_no_name_is_earned_where_a_correction_elsewhere_does_better_without_it(
    free: Correction, alone: float, both: float, earned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    walk = observed(recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), (), NOISE_V, seed=7), NOISE_V)
    bench = Bench(chain_of(model_of(OP_AMP)), (walk,), (), tuple(catalogue().values()))
    effect = catalogue()["feedthrough"](Place.SENSE)
    law = replace(bench.fitted(bench.with_effects([effect], {}), [effect]), chi2=1e5, count=96_000)
    base = replace(bench.fitted(bench.plain, ()), chi2=3e5, count=96_000)

    def left(_: Bench, hypothesis: object) -> Located:
        of_law = hypothesis is law
        fitted = replace(law, chi2=1e5 + (both if of_law else alone))
        return Located(law if of_law else base, ((free, fitted),), 1e-12)

    monkeypatch.setattr("identify.explain.warrant.located", left)
    found = warranted(bench, base, law, [Round(base, 0, (law,), settled=law)])
    assert (found.hypothesis.effects == (effect,)) is earned


@pytest.mark.parametrize(
    ("count", "promised", "one", "alone", "earned"),
    [
        (2, 0.0, False, -2000.0, False),  # were two names right, no single correction could do better
        (2, 0.0, False, 5.0, False),  # nor as well: that two laws came together is a coincidence
        (2, 0.0, False, 20.0, True),
        (1, 1.1, False, -2000.0, False),  # nor were one
        (1, 1.1, False, 20.0, True),
        (1, 0.9, False, -2000.0, True),  # which is not asked where none promises as much
        (1, 0.9, True, -2000.0, False),  # unless its first fit shows that it is one thing
    ],
)
def test_no_names_are_earned_where_one_correction_does_better_alone(
    count: int, promised: float, one: bool, alone: float, earned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    walk = observed(recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), (), NOISE_V, seed=7), NOISE_V)
    bench = Bench(chain_of(model_of(OP_AMP)), (walk,), (), tuple(catalogue().values()))
    effects = tuple(catalogue()[name](Place.SENSE) for name in ("feedthrough", "offset_drift"))[:count]
    names = replace(bench.fitted(bench.with_effects(effects, {}), effects), chi2=1e5, count=96_000)
    base = replace(bench.fitted(bench.plain, ()), chi2=3e5, count=96_000)
    better = replace(base, chi2=1e5 + alone)
    promise = Suspect(LEVEL, np.ones(3), np.full(3, promised * 2e5 / 3.0), {})

    def left(_: Bench, hypothesis: object) -> Located:
        return Located(base, ((LEVEL, better),), 1e-12, (5.0,)) if hypothesis is base else Located(names, (), 1.0)

    monkeypatch.setattr(Bench, "suspects", lambda bench, base: [promise])
    monkeypatch.setattr("identify.explain.warrant.located", left)
    monkeypatch.setattr("identify.explain.warrant.told_by_one", lambda *asked: one)
    monkeypatch.setattr("identify.explain.warrant.within_reach", lambda *asked: True)
    found = warranted(bench, base, names, [Round(base, 0, (names,), settled=names)])
    assert (found.hypothesis.effects == effects) is earned
    asked: list[float] = []
    monkeypatch.setattr("identify.explain.warrant.within_reach", lambda bench, base, chi2: bool(asked.append(chi2)))
    found = warranted(bench, base, names, [Round(base, 0, (names,), settled=names)])
    assert found.hypothesis.effects == effects  # none is gone after whose first fit is far behind the names
    assert asked == ([names.chi2] if promised != 0.9 or one else [])


@pytest.mark.parametrize(("slow", "strays"), [
    (Concealed("slow_g1", {"rate": 100.0}), {"slew_limit"}), (Concealed("slew_limit", {"rate": 800.0}), set()),
], ids=["G1", "F"])  # fmt: skip
def test_a_law_that_does_better_where_it_is_other_physics_earns_no_name(slow: Concealed, strays: set[str]) -> None:
    """An amplifier of G1 that is too slow moves w, too, too slowly: nearly as one of F does."""
    runs = (sine("fast", 10.0, 4.0, 8, 2), staircase("walk", FIG13_LEVELS_V, 0.02))
    seen = tuple(observed(recorded(OP_AMP, run, (slow,), NOISE_V, seed=3), NOISE_V) for run in runs)
    bench = Bench(chain_of(model_of(OP_AMP)), seen, (), tuple(catalogue().values()))
    effect = catalogue()["slew_limit"](Place.F)
    named = bench.fitted(bench.with_effects([effect], {"slew_limit.rate": 800.0}), [effect])
    assert misplaced(bench, named) == strays


def test_what_a_law_is_called_elsewhere_is_a_law_there() -> None:
    kinds = catalogue()
    named = [(kind, place, other) for kind in kinds.values() for place, other in kind.elsewhere.items() if other]
    assert len(named) >= 6
    assert all(place in kinds[other].places and place not in kind.places for kind, place, other in named)


@pytest.mark.parametrize(
    ("correction", "explains", "line", "swell", "earned"),
    [
        (LEVEL, 0.9, 1.0, 20.0, False),  # a law of few numbers foretells what was called chance
        (LEVEL, 0.3, 1.0, 20.0, True),
        (TABLE, 0.99, 1.0, 20.0, True),  # a table foretells nothing
        (LEVEL, 0.3, 1e-9, 20.0, False),  # chance makes no line that goes on from repeat to repeat
        (LEVEL, 0.3, 1e-9, 1.0, False),  # nor where it is in the weights of the readings
    ],
)
def test_chance_is_believed_last(
    correction: Correction, explains: float, line: float, swell: float, earned: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    walk = observed(recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), (), NOISE_V, seed=7), NOISE_V)
    bench = Bench(chain_of(model_of(OP_AMP)), (walk,), (), tuple(catalogue().values()))
    effect = catalogue()["process_noise"](Place.G1)
    base = replace(bench.fitted(bench.plain, ()), chi2=3e5, count=96_000)
    chance = replace(bench.fitted(bench.with_effects([effect], {}), [effect]), chi2=1e5, count=96_000, swell=swell)
    bench.known[()] = base
    told = replace(base, chi2=3e5 - explains * 2e5)

    def left(_: Bench, hypothesis: object) -> Located:
        return Located(base, ((correction, told),), 1e-12) if hypothesis is base else Located(chance, (), 1.0)

    monkeypatch.setattr("identify.explain.warrant.located", left)
    monkeypatch.setattr("identify.explain.anew.line_anew", lambda chain, seen: (330.0, line))
    found = warranted(bench, base, chance, [Round(base, 0, (chance,), settled=chance)])
    assert (found.hypothesis.effects == (effect,)) is earned
