"""Which corrections can held-out data prove, and what is said of where a mismatch enters where they do not?"""

from dataclasses import replace

import pytest

from identify.effects import chain_of
from identify.explain.bench import Bench
from identify.explain.locate import Located
from identify.explain.prove import foretells
from identify.explain.suspect import MOST
from identify.stage import Place
from identify.unnamed.correction import Correction
from identify.unnamed.lines import Line
from identify.unnamed.maps import LevelMap, LevelTable
from identify.unnamed.timed import ClockMap
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, staircase
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
    (ClockMap(Place.SENSE, KNOTS), 1e-9, False),  # nor of another time
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
