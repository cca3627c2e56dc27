"""Is a uniform clock recognised through rounding and jitter, and a broken one named by its row?"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.trace import Array
from rig.errors import FileError
from rig.timebase import JITTER, TimeBase, uniform


def place(row: int) -> str:
    return f"row {row}"


def refused(times: Array) -> str:
    with pytest.raises(FileError) as caught:
        uniform(times, place)
    return str(caught.value)


@given(st.integers(2, 400), st.sampled_from([0.1, 1.0, 200.0, 1000.0, 44_100.0, 51_200.0, 1e6]), st.floats(-1e3, 1e3))
def test_a_uniform_clock_gives_its_plain_rate(size: int, rate: float, start: float) -> None:
    base = uniform(start + np.arange(size) / rate, place)
    assert base.start_s == start
    assert base.rate_hz == pytest.approx(rate, rel=1e-6)


def test_rounded_times_give_back_the_rate_they_were_made_with() -> None:
    times = np.array([float(f"{k / 51_200.0:.7f}") for k in range(5000)])
    assert uniform(times, place) == TimeBase(0.0, 51_200.0)
    assert uniform(np.arange(1000) * 0.001, place).rate_hz == 1000.0


def test_jitter_within_the_tolerance_is_taken_and_beyond_it_refused() -> None:
    rng = np.random.default_rng(1)
    jitter = rng.uniform(-1.0, 1.0, 1000)
    jitter[[0, -1]] = 0.0
    assert uniform(np.arange(1000) + 0.9 * JITTER * jitter, place).rate_hz == pytest.approx(1.0, rel=1e-3)
    jitter[500] = 3.0
    assert refused(np.arange(1000) + 0.9 * JITTER * jitter).startswith("row 500: the time base is not uniform")


@pytest.mark.parametrize(("change", "message"), [
    (lambda t: np.delete(t, 40), "row 40: the time base is broken: 0.041 s after 0.039 s; allowed: a row every 0.0"),
    (lambda t: np.insert(t, 40, t[40]), "row 41: the time base is broken: 0.04 s after 0.04 s; allowed: a row every"),
    (lambda t: np.concatenate([t, t]), "row 100: the time base is broken: 0 s after 0.099 s"),
    (lambda t: np.concatenate([t, t + 5.0]), "row 100: the time base is broken: 5 s after 0.099 s"),
])
def test_a_broken_clock_is_named_by_its_row(change: object, message: str) -> None:
    assert callable(change)
    assert refused(change(np.arange(100) * 1e-3)).startswith(message)


@pytest.mark.parametrize("times", [np.zeros(9), -np.arange(9.0)])
def test_a_clock_that_never_advances_is_refused(times: Array) -> None:
    assert "the time base is broken" in refused(times)
    assert "allowed: times in ascending order" in refused(times)


def test_a_rate_that_drifts_is_not_uniform() -> None:
    t = np.arange(1000.0)
    assert "the time base is not uniform" in refused(t + 1e-6 * t**2)
