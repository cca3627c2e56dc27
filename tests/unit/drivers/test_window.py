"""Does a window over a long series hold what is in use, and nothing else?"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.window import LEAST, Window

MOVE = st.tuples(st.integers(0, 3 * LEAST), st.integers(1, 2 * LEAST), st.integers(0, 4 * LEAST))


@given(st.lists(MOVE, max_size=12))
def test_a_window_is_the_series_from_its_first_entry_on(moves: list[tuple[int, int, int]]) -> None:
    window, series, first = Window(np.int32), np.zeros(200_000, dtype=np.int32), 0
    for skip, count, forgotten in moves:
        start = first + skip
        if start + count > series.size:
            break
        window.part(start, start + count)[:] = np.arange(start, start + count) + 1
        series[start:start + count] = np.arange(start, start + count) + 1
        first = min(first + forgotten, series.size - 8 * LEAST)
        window.forget(first)
        assert np.array_equal(window.part(first, first + 5 * LEAST), series[first:first + 5 * LEAST])


def test_memory_is_that_of_what_is_in_use() -> None:
    window = Window(np.int32, 4)
    for start in range(0, 10**7, 1000):
        window.part(start, start + 1000)[:] = 1
        window.forget(start)
    assert window.part(10**7 - 1000, 10**7).base is not None
    assert window.part(10**7 - 1000, 10**7).base.shape == (LEAST, 4)


def test_entries_that_are_gone_are_not_read() -> None:
    window = Window(np.uint8)
    window.part(0, 3 * LEAST)
    window.forget(3 * LEAST)
    with pytest.raises(ValueError, match="entry 0 is gone"):
        window.part(0, 1)
