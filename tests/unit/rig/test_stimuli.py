"""Do the samples of every stimulus have the shape, the levels and the periods asked for?"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig import stimuli


def test_a_staircase_holds_each_level() -> None:
    assert stimuli.staircase([1.0, -2.0], 3).tolist() == [1, 1, 1, -2, -2, -2]


@given(st.integers(1, 50), st.integers(2, 200), st.integers(1, 4))
def test_whole_periods_repeat_to_the_last_bit(periods: int, samples: int, passes: int) -> None:
    at = stimuli.turns(samples * passes, 1000.0 * periods / samples, 1000.0)
    u = stimuli.sine(2.0, at)
    assert np.array_equal(u, np.tile(u[:samples], passes))


def test_a_sine_is_the_cosine_of_eq_20() -> None:
    at = stimuli.turns(8, 125.0, 1000.0)
    assert stimuli.sine(2.0, at, offset_v=1.0) == pytest.approx(1.0 + 2.0 * np.cos(2 * np.pi * np.arange(8) / 8))
    assert stimuli.sine(2.0, at, phase_rad=-np.pi / 2)[:2] == pytest.approx([0.0, 2.0 * np.sin(np.pi / 4)])


def test_periods_that_do_not_fit_keep_their_frequency() -> None:
    at = stimuli.turns(1000, 31.4, 1000.0)
    assert at == pytest.approx(np.arange(1000) * 0.0314)


def test_a_triangle_starts_at_its_offset_going_up() -> None:
    assert stimuli.triangle(4.0, stimuli.turns(8, 125.0, 1000.0), 1.0).tolist() == [1, 3, 5, 3, 1, -1, -3, -1]


@pytest.mark.parametrize("lines", [4, 9, 32])
def test_schroeder_phases_keep_the_peak_low(lines: int) -> None:
    at = np.arange(4096) / 4096
    def peak(phases: np.ndarray) -> float:
        return float(np.abs(sum(np.cos(2 * np.pi * (n + 1) * at + phases[n]) for n in range(lines))).max())

    assert peak(stimuli.schroeder_phases(lines)) < 1.9 * np.sqrt(lines)
    assert peak(np.zeros(lines)) == pytest.approx(lines)


def test_minor_loops_nest_at_one_slope() -> None:
    times, levels = stimuli.minor_loops([3.0, 1.0], 10.0, 2, 0.5)
    assert levels.tolist() == [0.5, 3.5, -2.5, 3.5, -2.5, 1.5, -0.5, 1.5, -0.5, 0.5]
    assert np.abs(np.diff(levels) / np.diff(times)) == pytest.approx(10.0)


def test_a_table_is_held_or_straight() -> None:
    points = np.array([0.0, 0.2, 0.4]), np.array([0.0, 2.0, 4.0])
    assert stimuli.table(points, 4, 10.0, straight=False).tolist() == [0.0, 0.0, 2.0, 2.0]
    assert stimuli.table(points, 4, 10.0, straight=True) == pytest.approx([0.0, 1.0, 2.0, 3.0])


def test_whole_is_whole_but_for_rounding() -> None:
    assert stimuli.is_whole(0.3 * 10)
    assert stimuli.is_whole(3e6 * (1 + 1e-12))
    assert not stimuli.is_whole(3.001)
    assert not stimuli.is_whole(0.0)
