"""Does the paper's method, as published, find what it can find?"""

import numpy as np
import pytest

from identify.harmonic import paper
from identify.harmonic.periods import periods
from identify.harmonic.steady import frequency_response
from identify.model import Rational
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import sine
from tests.trials import model_of, recorded

LEVELS = np.concatenate([np.arange(-3.0, 3.1, 0.5), np.arange(2.5, -3.6, -0.5)])


def settled(slope: float, d_l: float, d_u: float) -> np.ndarray:
    """Return the levels of w on the walk of Fig. 13, from rest."""
    w, found = 0.0, []
    for u in LEVELS:
        w = min(max(w, slope * (u - d_l)), slope * (u - d_u))
        found.append(w)
    return np.array(found)


def test_table_1_averages_and_draws_the_lines_from_the_first_point_that_moves() -> None:
    x = settled(1.7535, 0.3564, -1.7821)
    readings = x[:, None] + np.random.default_rng(1).normal(0.0, 0.07, (26, 200))
    points = paper.table_1(LEVELS, readings)
    assert points.means_v == pytest.approx(x, abs=5.0 * 0.07 / np.sqrt(200))
    assert points.errors_v == pytest.approx(0.07 / np.sqrt(200), rel=0.05)
    found = paper.borders(points)
    assert (found.s_l, found.d_l_v) == (pytest.approx(1.7535, rel=0.01), pytest.approx(0.3564, abs=0.01))
    assert (found.s_u, found.d_u_v) == (pytest.approx(1.7535, rel=0.01), pytest.approx(-1.7821, abs=0.01))


def test_a_walk_that_moves_nothing_has_no_borders() -> None:
    flat = np.random.default_rng(1).normal(0.0, 0.07, (26, 200))
    with pytest.raises(ValueError, match="fewer than two levels"):
        paper.borders(paper.table_1(LEVELS, flat))


def test_fourier_coefficients_keep_the_quadrant_and_count_the_mean_once() -> None:
    turn = 2.0 * np.pi * np.arange(64) / 64
    x, theta = paper.fourier(-1.5 + 2.0 * np.cos(turn + 2.5), np.arange(2))
    assert x == pytest.approx([1.5, 2.0])
    assert np.exp(1j * theta) == pytest.approx([-1.0, np.exp(2.5j)])


def test_table_2_finds_the_gains_where_two_amplitudes_separate_them() -> None:
    """Phases come out with a delay of their own between G1 and G2; their sum at one frequency is that of the rig."""
    model = model_of(OP_AMP)
    traces = [recorded(OP_AMP, sine(f"{u} V", 10.0, u, 4, 1), fine=16) for u in (3.4, 2.6)]
    seen = [p for t in traces for p in periods(t, 0.2, 1.0)]
    found = paper.table_2(seen, model.f, 50.0)
    assert found.g1_hz == pytest.approx([10.0])
    assert found.g2_hz == pytest.approx([10.0, 20.0, 30.0, 40.0, 50.0])
    odd = found.g2[::2]
    one, two = frequency_response(model.g1, [10.0]), frequency_response(model.g2, [10.0, 30.0, 50.0])
    assert np.abs(found.g1) == pytest.approx(np.abs(one), rel=1e-3)
    assert np.abs(odd) == pytest.approx(np.abs(two), rel=5e-3)
    turned = np.exp(-1j * np.array([1, 3, 5]) * np.angle(one / found.g1))
    assert odd * turned == pytest.approx(two, rel=1e-2)


@pytest.mark.parametrize(
    "block",
    [
        Rational((1.0,), (2.0, 3.0, 1.0)), Rational((0.3, 1.0), (0.01, 0.04, 1.0)),
        Rational((1.0,), (12.5, 20.0, 8.5, 1.0), 5.0),
    ],
)  # fmt: skip
def test_rational_fit_finds_the_function_its_points_come_from(block) -> None:
    f = np.geomspace(0.002, 1.0, 15)
    shape = Rational((1.0,) * len(block.num), (1.0,) * len(block.den), 0.9 * block.dead_time_s)
    found = paper.rational(f, frequency_response(block, f), shape)
    assert found.num == pytest.approx(block.num, rel=1e-6)
    assert found.den == pytest.approx(block.den, rel=1e-6)
    assert found.dead_time_s == pytest.approx(block.dead_time_s)
