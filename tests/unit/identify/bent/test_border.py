"""Is a border the monotone cubic it says it is, and does it refuse what does not rise?"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline

from identify.bent.border import border, crossing, of_points, slopes
from identify.model import CurvedBacklash

STEPS = st.lists(st.tuples(st.floats(0.01, 5.0), st.floats(0.001, 50.0)), min_size=1, max_size=12)


def points(steps):
    v, w = np.cumsum([(0.0, 0.0), *steps], axis=0).T
    return v - 1.7, w - 3.0


@settings(deadline=None, max_examples=200)
@given(STEPS)
def test_every_border_rises_everywhere_and_meets_its_points(steps):
    v, w = points(steps)
    found = border(v, w)
    at = np.linspace(v[0] - 2.0, v[-1] + 2.0, 4000)
    assert np.all(np.diff(found.at(at)) > -1e-12 * np.ptp(w))
    assert np.allclose(found.at(v), w, rtol=0, atol=1e-12 * (1.0 + np.ptp(w)))


def test_where_nothing_would_fall_it_is_the_spline_of_scipy():
    v = np.array([-2.0, -1.2, -0.1, 0.4, 1.5, 2.0])
    w, inside = 8.0 * np.sinh(v) - 3.0, np.linspace(-2.0, 2.0, 500)
    assert border(v, w).at(inside) == pytest.approx(CubicSpline(v, w)(inside), rel=1e-12, abs=1e-12)


def test_a_step_is_no_overshoot():
    v, w = np.arange(6.0), np.array([0.0, 0.01, 0.02, 9.0, 9.01, 9.02])
    assert np.min(np.diff(CubicSpline(v, w)(np.linspace(0.0, 5.0, 900)))) < 0.0
    assert np.min(np.diff(border(v, w).at(np.linspace(-1.0, 6.0, 900)))) > 0.0
    assert np.all(slopes(v, w) > 0.0)


def test_two_points_and_points_on_a_line_are_that_line():
    at = np.linspace(-5.0, 5.0, 101)
    for v in (np.array([-1.0, 2.0]), np.array([-1.0, 0.0, 0.3, 2.0])):
        assert border(v, 8.0 * (v - 1.25)).at(at) == pytest.approx(8.0 * (at - 1.25), abs=1e-12)


def test_a_cubic_is_met_exactly():
    v, at = np.array([-2.0, -0.7, 0.5, 2.5]), np.linspace(-2.0, 2.5, 101)
    assert border(v, 8.0 * v + 0.3 * v**3).at(at) == pytest.approx(8.0 * at + 0.3 * at**3, abs=1e-12)


def test_a_smooth_curve_is_met_to_the_fourth_order():
    at = np.linspace(-2.0, 2.0, 2001)

    def error(count):
        v = np.linspace(-2.0, 2.0, count)
        return np.max(np.abs(border(v, 8.0 * np.sinh(v)).at(at) - 8.0 * np.sinh(at)))

    assert error(41) < error(21) / 12.0 < error(11) / 144.0


@pytest.mark.parametrize(("wrong", "sentence"), [
    (((0.0, 0.0),), "two points"), (((0.0, 0.0), (0.0, 1.0)), "rise in v"), (((0.0, 0.0), (1.0, 0.0)), "rise in v"),
])
def test_what_is_no_border_is_refused(wrong, sentence):
    with pytest.raises(ValueError, match=sentence):
        of_points(wrong)


def test_borders_that_cross_are_told_where():
    apart = CurvedBacklash(((-1.0, -18.0), (3.0, 14.0)), ((-3.0, -14.0), (1.0, 18.0)))
    assert crossing(apart) is None
    met = crossing(CurvedBacklash(((-1.0, -8.0), (0.0, 0.0), (1.0, 30.0)), ((-1.0, -2.0), (1.0, 10.0))))
    assert met is not None
    assert met == pytest.approx((1.0, 30.0, 10.0))
