"""Is a name never likelier than not while much of the mismatch is unexplained?"""

import pytest

from identify.explain.confirm import most_believed


@pytest.mark.parametrize(("met", "left", "most"), [
    (18.3, 7.5, 0.5),  # a sixth of the mismatch is left
    (18.3, 1.05, 1.0),
    (1.2, 1.15, 1.0),  # half of it is left, and it is little
    (400.0, 3.0, 1.0),  # one part in twenty thousand is left
    (3.4, 1.6, 0.5),
])
def test_what_is_left_bounds_what_is_believed(met: float, left: float, most: float) -> None:
    assert most_believed(met, left) == most
