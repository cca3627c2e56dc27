"""Are blocks that cannot be played refused, and is the settling time that of the step response?"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import step

from rig.errors import MisfitError
from rig.linearblock import check_block, check_stable, may_start_unstable, settling_time_s


@pytest.mark.parametrize(("num", "den", "message"), [
    ([1], [0, 1], "leading coefficient of den is 0"),
    ([0, 0], [1, 1], "num is 0"),
    ([1, 0, 1], [1, 1], "more zeros than poles"),
    ([1, 0], [1, 1], "no gain at 0 Hz"),
])
def test_a_block_that_cannot_be_played_is_refused(num: list[float], den: list[float], message: str) -> None:
    with pytest.raises(MisfitError, match=message):
        check_block(num, den)


@pytest.mark.parametrize(("den", "message"), [
    ([1, -1], "not stable: a pole at 1 rad/s"),
    ([1, 0], "not stable"),
    ([1, 0, 1], "not stable"),
    ([1, 0.5, 1, 1], "not stable"),
])
def test_a_block_that_is_not_stable_is_refused_where_it_is_to_be_played(den: list[float], message: str) -> None:
    with pytest.raises(MisfitError, match=message):
        check_stable(den)
    with pytest.raises(MisfitError, match=message):
        settling_time_s([([1], [1, 1]), ([1], den)], 0.0, 1e-3)


def test_only_a_third_order_of_one_sign_may_start_unstable() -> None:
    assert may_start_unstable([1, 0.5, 1, 1])
    assert may_start_unstable([-1, -0.5, -1, -1])
    assert not may_start_unstable([1, -0.5, 1, 1])
    assert not may_start_unstable([1, 0.0, 1, 1])
    assert not may_start_unstable([1, 0.5, 1])


@pytest.mark.parametrize(("num", "den"), [([1], [1]), ([2, 1], [1, 1]), ([1000], [1e-4, 20, 1000])])
def test_a_proper_stable_block_is_taken(num: list[float], den: list[float]) -> None:
    check_block(num, den)
    check_stable(den)


def test_first_order_settles_after_the_logarithm_of_the_fraction() -> None:
    expected = 0.02 * np.log(1000.0)
    assert expected <= settling_time_s([([1], [0.02, 1])], 0.0, 1e-3) <= 1.01 * expected


def test_dead_time_comes_on_top() -> None:
    assert settling_time_s([([2], [1])], 5.0, 1e-3) == 5.0


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(1e-3, 1.0), min_size=1, max_size=4), st.sampled_from([0.1, 0.01, 0.001]))
def test_the_response_is_outside_before_and_inside_after(taus: list[float], fraction: float) -> None:
    settled = settling_time_s([([1.0], [tau, 1.0]) for tau in taus], 0.0, fraction)
    den = np.ones(1)
    for tau in taus:
        den = np.polymul(den, [tau, 1.0])
    times, response = step(([1.0], den), T=np.linspace(0.0, 2.0 * settled, 4001))
    left = np.abs(response - 1.0)
    assert left[times >= settled].max() <= fraction * 1.01
    assert left[times < 0.98 * settled].max() > fraction


def test_ringing_counts_until_its_last_excursion() -> None:
    settled = settling_time_s([([1], [1, 0.1, 1])], 0.0, 0.01)
    times, response = step(([1], [1, 0.1, 1]), T=np.linspace(0, 200, 20001))
    assert settled == pytest.approx(times[np.abs(response - 1) > 0.01][-1], rel=5e-3)
