"""Which corrections can held-out data prove, and what is said of where a mismatch enters where they do not?"""

from dataclasses import replace
from types import SimpleNamespace

import pytest

from identify.effects import catalogue, chain_of
from identify.explain import explain
from identify.explain.answer import Answer
from identify.explain.bench import Bench
from identify.explain.entered import entered
from identify.explain.locate import Located
from identify.explain.prove import foretells
from identify.explain.suspect import MOST
from identify.stage import Place
from identify.unnamed.correction import Correction
from identify.unnamed.linear import Bypass, Filter
from identify.unnamed.lines import Line
from identify.unnamed.maps import LevelMap, LevelTable
from identify.unnamed.timed import OffsetOverClock
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

KNOTS = (-4.0, -1.0, 2.0, 5.0)
WALK = observed(recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.01), (), 0.01, 5, 0.0, 2), 0.01)
BENCH = Bench(chain_of(model_of(OP_AMP)), (WALK,), (), ())
PLAIN = BENCH.fitted(BENCH.plain, (), 0)


@pytest.mark.parametrize(("correction", "p_value", "says"), [
    (LevelMap(Place.F, KNOTS), 1e-9, True),
    (LevelMap(Place.F, KNOTS), 0.5, False),  # noise may have made it
    (LevelMap(Place.F, tuple(map(float, range(MOST + 1)))), 1e-9, False),
    (LevelTable(Place.SOURCE, KNOTS), 1e-9, False),  # of other levels than those held it says nothing
    (OffsetOverClock(Place.SENSE, KNOTS), 1e-9, False),  # nor of another time
    (Line(Place.SENSE, (93.9,)), 1e-9, False),  # whose phase is another in every run
])  # fmt: skip
def test_a_law_says_something_of_other_runs_and_a_table_does_not(
    correction: Correction, p_value: float, says: bool
) -> None:
    assert foretells(Located(PLAIN, ((correction, PLAIN),), p_value)) is says


def test_where_held_out_data_are_no_better_for_a_correction_no_place_is_excluded() -> None:
    beyond = Located(PLAIN, ((LevelMap(Place.F, KNOTS), replace(PLAIN, chi2=0.5 * PLAIN.chi2)),), 1e-9, (5.0,))
    assert beyond.alternatives() == ()
    assert set(beyond.alternatives(True)) == set(Place) - {Place.F}


def test_a_place_that_gives_the_same_data_has_no_fit_of_its_own_whatever_else_fits_there() -> None:
    """What the best law does at G2 no stimulus tells from the reading, though a filter there does nearly as well."""
    table = OffsetOverClock(Place.F, tuple(map(float, range(MOST + 1))))
    laws = (LevelMap(Place.SENSE, KNOTS), 0.5), (Filter(Place.G2, (1e-3,)), 0.51), (table, 0.52)
    fitted = tuple((law, replace(PLAIN, chi2=share * PLAIN.chi2)) for law, share in laws)
    members = entered(Located(PLAIN, fitted, 1e-9, (5.0, 5.0, 5.0)), unproven=True)
    assert [(c.stage, c.exact, c.fit is not None) for c in members] == [("sense", False, True), ("G2", True, False)]
    assert entered(Located(PLAIN, fitted, 0.5, (5.0, 5.0, 5.0)), unproven=True) == ()
    bypass = Bypass(Place.SENSE, (0.0, 1e-3))
    assert (bypass.same_at, bypass.like_at) == ((Place.SENSE, Place.G2), (Place.SENSE, Place.G2, Place.F))


@pytest.mark.parametrize(("over", "verdict", "stage"), [(1.0, "explained", None), (1.2, "partly_explained", "F")])
def test_blemishes_alone_explain_nothing_that_noise_cannot_make(over: float, verdict: str, stage: str | None) -> None:
    """Though what is held out shows as little of it as that it bears no correction out."""
    left = replace(PLAIN, chi2=over * PLAIN.count)
    beyond = Located(left, ((LevelMap(Place.F, KNOTS), replace(left, chi2=0.9 * left.chi2)),), 1e-9, (5.0,))
    answer = Answer.__new__(Answer)
    readings = SimpleNamespace(found=(SimpleNamespace(id="missing_samples"),))
    vars(answer).update(
        better=left, beyond=beyond, readings=readings, proof=None, blemished=True, unproven=False, unvisited=None,
        left_open=None, named_over=1.01, after_v=0.0101, noise_v=0.01, by_chance=0.0,
    )  # fmt: skip
    assert answer.verdict == verdict
    assert answer.remaining().stage == stage
    assert answer.remaining().sentence.startswith("Nothing that any correction") is (stage is None)


@pytest.mark.parametrize(("size_v", "others", "told"), [
    (0.2, ("G2",), "; at G2 it would give exactly the same data."),
    (-0.2, ("source", "G1", "F", "G2"), "where the mismatch enters is open"),
])  # fmt: skip
def test_an_answer_says_that_a_place_is_open_where_held_out_runs_are_no_better_for_it(
    size_v: float, others: tuple[str, ...], told: str
) -> None:
    """Those here have what the others have, or the opposite of it."""
    here, there = (Concealed("crosstalk", {"size": size, "level": 0.7}) for size in (0.2, size_v))
    runs = (staircase("walk", FIG13_LEVELS_V, 0.02), sine("wave", 20.0, 3.0, 3, 1))
    train = [recorded(OP_AMP, run, (here,), 0.01, i, 3.0 * i, 8) for i, run in enumerate(runs)]
    test = [recorded(OP_AMP, sine("other", 12.5, 3.0, 2, 1), (there,), 0.01, 9, 9.0, 8)]
    answer = explain(model_of(OP_AMP), train, test, leave_out=tuple(catalogue()))
    assert answer.location is not None
    assert (answer.location.stage, set(answer.location.alternatives)) == ("sense", set(others))
    assert told in answer.location.sentence
    assert answer.location.to_dict()["same_data"] == ["G2"]
    assert answer.entered[0].stage == "sense"
    assert bool(answer.effects) is (size_v > 0.0)
    ends = "what it is stays open." if size_v > 0.0 else "The mismatch is not explained; where it enters is open."
    assert answer.remaining.sentence.endswith(ends)
