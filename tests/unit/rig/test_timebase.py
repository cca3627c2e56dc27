"""Is a uniform clock recognised through rounding and jitter, and a broken one named by its row?"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.trace import Array
from rig.errors import FileError
from rig.timebase import JITTER, TimeBase, clock, ticks, uniform


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
    (lambda t: np.delete(t, 40), "row 40: the time base is broken: 0.041 s after 0.039 s; in all 1 x gap (first at"),
    (lambda t: np.insert(t, 40, t[40]), "row 41: the time base is broken: 0.04 s after 0.04 s; in all 1 x time that"),
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


def test_all_that_is_amiss_is_told_with_its_first_place() -> None:
    t = np.delete(np.arange(300.0), [20, 21, 90])
    t[150] = t[149]
    t[200] -= 5.0
    told = refused(t)
    assert told.startswith("row 20: the time base is broken: 22 s after 19 s; in all 4 x gap (first at row 20), ")
    assert "1 x time that stands still (first at row 150)" in told
    assert "1 x step back (first at row 200)" in told
    assert "--gaps lost" not in told


def test_gaps_are_counted_in_ticks_of_the_clock_through_rounded_times() -> None:
    ticks_there = np.delete(np.arange(20_000), [*range(700, 8_123), 15_000])
    times = np.round(ticks_there / 51_200.0, 7)
    base, gaps = clock(times, place, gaps=True)
    assert base == TimeBase(0.0, 51_200.0)
    assert (gaps.rows.tolist(), gaps.missing.tolist()) == ([700, 15_000 - 7_423], [7_423, 1])
    assert np.array_equal(ticks(gaps, 0, times.size), ticks_there)


def test_a_clock_is_read_by_stretches_as_it_is_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    times = np.delete(np.arange(2_000), [40, 41, 1_500]) / 44_100.0
    whole = clock(times, place, gaps=True)
    monkeypatch.setattr("identify.trace.blocks.__defaults__", (64,))
    parts = clock(times, place, gaps=True)
    assert parts[0] == whole[0]
    assert np.array_equal(parts[1].rows, whole[1].rows)
    assert np.array_equal(parts[1].missing, whole[1].missing)


def test_rows_that_stray_are_counted() -> None:
    t = np.arange(100.0)
    t[30:33] += 0.2
    assert "row 30: the time base is not uniform: 30.2 s after 29 s; 3 rows stray, by 0.2 of a sample" in refused(t)
