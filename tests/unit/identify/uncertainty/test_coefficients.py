"""Do the named numbers of a model make it, and can any of them be moved alone?"""

import pytest

from identify.model import Backlash, CurvedBacklash, LinearF, Model, Physics, Rational
from identify.uncertainty.coefficients import coefficients, with_coefficients

G1 = Rational((2.0, 6.0), (0.5, 4.0, 2.0), 0.1)
G2 = Rational((-3.0,), (1.0, 2.0))
CURVED = CurvedBacklash(((0.0, -1.0), (1.0, 0.5), (2.0, 3.0)), ((-1.0, -0.5), (0.0, 1.0)))


@pytest.mark.parametrize("f", [Backlash(8.0, 1.0, 7.0, -1.0), LinearF(2.0, 0.1), CURVED])
def test_the_numbers_make_the_model_and_each_moves_alone(f):
    model = Model("m", G1, f, G2, physics=(Physics("saturation", {"upper": 9.0, "lower": -9.0}),))
    numbers = coefficients(model)
    assert coefficients(with_coefficients(model, {})) == pytest.approx(numbers)
    for name, value in numbers.items():
        moved = coefficients(with_coefficients(model, {name: value + 0.125}))
        assert moved == pytest.approx({**numbers, name: value + 0.125})


def test_blocks_are_told_with_constant_terms_of_one_and_keep_their_gain():
    model = Model("m", G1, LinearF(), G2)
    assert coefficients(model)["G1.num.s1"] == pytest.approx(1.0 / 3.0)
    assert coefficients(model)["G1.den.s2"] == pytest.approx(0.25)
    assert with_coefficients(model, {"G1.num.s1": 0.5}).g1 == Rational((3.0, 6.0), (0.5, 4.0, 2.0), 0.1)
