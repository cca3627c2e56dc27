"""Which corrections are worth a fit, and what do they promise?"""

import numpy as np
import pytest

from identify.explain.corrections import with_zero
from identify.explain.suspect import MOST, Suspect, contenders, explainable, overlooked
from identify.stage import Place
from identify.unnamed.maps import LevelMap


def promising(place: Place, gain: float, knots: int = 8) -> Suspect:
    """Return a map of the level that promises a fall of chi-squared, its eight weights seen equally well."""
    law = LevelMap(place, tuple(np.linspace(-1.0, 1.0, knots).tolist()))
    return Suspect(law, np.full(8, 1e6), np.full(8, gain / 8), {})


@pytest.mark.parametrize(("gain", "fitted"), [(1e5, [Place.G1]), (900.0, [])])
def test_what_promises_a_part_is_fitted_too_where_the_mismatch_leaves_first_order(
    gain: float, fitted: list[Place]
) -> None:
    """Of all that were not: no second of those that were, none that promises little, none too fine to fit."""
    shares = {Place.F: 1.0, Place.G1: 0.4, Place.G2: 0.2}
    ranked = [promising(place, share * gain) for place, share in shares.items()]
    ranked.insert(1, promising(Place.SENSE, 0.9 * gain, 2 * MOST))
    assert [s.correction.place for s in overlooked(ranked, contenders(ranked[:1], 1.0))] == fitted


def test_what_corrections_find_beyond_chance_is_there_to_explain() -> None:
    """Eight weights gain eight from noise alone; what noise may make of the best of several is nothing."""
    chance, found = promising(Place.F, 12.0), promising(Place.G2, 200.0)
    assert explainable([chance, found]) == pytest.approx(192.0)
    assert explainable([chance]) == 0.0
    assert explainable([]) == 0.0


def test_the_inner_knot_next_to_zero_is_moved_there_and_no_other() -> None:
    assert with_zero((-3.0, -1.0, 0.4, 2.0)) == (-3.0, -1.0, 0.0, 2.0)
    assert with_zero((-0.1, 1.0, 2.0)) == (-0.1, 0.0, 2.0)  # the ends hold the range
    assert with_zero((0.5, 1.0, 2.0)) == (0.5, 1.0, 2.0)
