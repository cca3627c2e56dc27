"""Are the closed-form harmonics those of a finely sampled play, of python-control, and of their own derivatives?"""

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.harmonic.harmonics import PARAMETERS, coefficients, slopes, threshold_v
from identify.model import Backlash
from tests.proof.integrator import play

SKEWED = Backlash(7.0, 1.0, 8.5, -1.3)
ORDERS = np.arange(12)
FINE = 1 << 18


def sampled(amplitude_v: float, phase_rad: float, borders: Backlash, rest_w: float = 0.0) -> np.ndarray:
    """Return c_n from the second of two periods through the independent integrator's play."""
    v = amplitude_v * np.cos(2.0 * np.pi * np.arange(2 * FINE) / FINE + phase_rad)
    lower, upper = borders.s_l * (v - borders.d_l_v), borders.s_u * (v - borders.d_u_v)
    spectrum = np.fft.rfft(play(lower, upper, rest_w, 1.0, 0.0)[FINE:])[: ORDERS.size] / FINE
    return np.where(ORDERS == 0, spectrum, 2.0 * spectrum)


@given(
    st.floats(0.5, 5.0), st.floats(-40.0, 40.0), st.floats(0.5, 9.0), st.floats(0.8, 1.25), st.floats(-3.0, 3.0),
    st.floats(0.5, 3.0), st.floats(-5.0, 5.0),
)  # fmt: skip
@settings(max_examples=60, deadline=None)
def test_closed_form_is_the_transform_of_a_sampled_play(amplitude, phase, slope, ratio, crossing, gap, rest) -> None:
    borders = Backlash(slope, crossing + 0.5 * gap, slope * ratio, crossing - 0.5 * gap)
    v = amplitude * np.array([-1.0, 1.0])
    crossed = np.any(borders.s_l * (v - borders.d_l_v) > borders.s_u * (v - borders.d_u_v))
    if crossed and amplitude > threshold_v(borders):
        with pytest.raises(ValueError, match="cross"):
            coefficients(amplitude, phase, borders, ORDERS, rest)
    elif not crossed:
        closed = coefficients(amplitude, phase, borders, ORDERS, rest)
        assert closed == pytest.approx(sampled(amplitude, phase, borders, rest), abs=1e-7 * slope * amplitude)


@pytest.mark.parametrize("amplitude", [0.6, 1.0, 1.7, 8.0])
def test_first_harmonic_is_the_describing_function_of_python_control(amplitude) -> None:
    """Its play has slope 1 and a gap as wide as its argument; up to half of it nothing moves."""
    theirs = control.friction_backlash_nonlinearity(1.0).describing_function(amplitude)
    ours = coefficients(amplitude, 0.0, Backlash(1.0, 0.5, 1.0, -0.5), np.array([1]))[0] / amplitude
    assert ours == pytest.approx(theirs, abs=1e-12)
    assert control.friction_backlash_nonlinearity(1.0).describing_function(0.5) == 0.0


def test_within_the_gap_w_rests_where_it_was_pushed_to() -> None:
    edge = threshold_v(SKEWED)
    assert 7.0 * (edge - 1.0) == pytest.approx(8.5 * (-edge + 1.3))
    assert not coefficients(0.99 * edge, 1.0, SKEWED, ORDERS)[1:].any()
    assert coefficients(1.1, 0.0, SKEWED, ORDERS, -9.0)[0] == pytest.approx(7.0 * 0.1)
    assert coefficients(1.1, 0.0, SKEWED, ORDERS, 9.0)[0] == pytest.approx(8.5 * 0.2)
    assert not slopes(0.5 * edge, 0.0, SKEWED, ORDERS).any()


def test_equal_slopes_leave_no_even_harmonic_and_a_mean_that_knows_no_amplitude() -> None:
    """physics.md 1.2, also for a gap off the centre."""
    borders = Backlash(1.7535, 0.3564, 1.7535, -1.7821)
    for amplitude in (1.5, 3.5, 20.0):
        found = coefficients(amplitude, 0.3, borders, ORDERS)
        assert abs(found[2::2]) == pytest.approx(0.0, abs=1e-13)
        assert found[0].real == pytest.approx(-1.7535 * 0.5 * (0.3564 - 1.7821))


def test_a_phase_of_v_turns_harmonic_n_by_n_times_as_much() -> None:
    still, turned = (coefficients(3.0, phase, SKEWED, ORDERS) for phase in (0.0, 7.7))
    assert turned == pytest.approx(still * np.exp(7.7j * ORDERS))


@pytest.mark.parametrize("row", range(len(PARAMETERS)), ids=PARAMETERS)
def test_slopes_are_differences_of_the_coefficients(row) -> None:
    at = np.array([2.2, 7.0, 1.0, 8.5, -1.3])

    def around(move: float) -> np.ndarray:
        moved = at.copy()
        moved[row] += move
        return coefficients(moved[0], 0.4, Backlash(*moved[1:]), ORDERS)

    numeric = (around(1e-6) - around(-1e-6)) / 2e-6
    assert slopes(2.2, 0.4, SKEWED, ORDERS)[row] == pytest.approx(numeric, abs=1e-6)
