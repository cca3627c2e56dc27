"""Does a picture in a notebook keep every peak, and show what is missing?"""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.notebook.plots import COLUMNS, extremes, signals
from identify.trace import Trace
from tests.trials import Shelf

LONG = 12 * COLUMNS + 5


@pytest.fixture(autouse=True)
def _closed() -> Iterator[None]:
    import matplotlib.pyplot as plt

    yield
    plt.close("all")


@settings(max_examples=25, deadline=None)
@given(at=st.integers(0, LONG - 1), size=st.sampled_from([60, 2 * COLUMNS, LONG]))
def test_a_peak_of_one_sample_is_kept_where_it_is(at: int, size: int) -> None:
    at %= size
    signal = np.zeros(size)
    signal[at] = 1.0
    first, low, high = extremes(Shelf(size, signal))
    (part,) = np.flatnonzero(high == 1.0)
    assert first[part] <= at
    assert part == first.size - 1 or at < first[part + 1]
    assert np.all(low[np.arange(first.size) != part] == 0.0)


def test_what_is_missing_is_a_gap_of_y_and_hatched_and_u_goes_on() -> None:
    for size in (300, LONG):
        valid = np.ones(size, dtype=bool)
        valid[size // 3 : size // 2] = False
        u, y = Trace("cut", 1e3, np.ones(size), np.full(size, 7.0), valid=valid, start_s=2.0).plot()
        assert [ax.get_ylabel() for ax in (u, y)] == ["u in V", "y in V"]
        assert y.get_xlabel() == "time in s"
        assert y.get_legend_handles_labels()[1] == ["recorded", "samples missing"]
        assert u.get_legend_handles_labels()[1] == ["recorded"]
        (span,) = y.collections[-1].get_paths()
        width = size / min(size, COLUMNS) / 1e3
        assert span.vertices[:, 0].min() == pytest.approx(2.0 + size // 3 / 1e3, abs=width)
        assert span.vertices[:, 0].max() == pytest.approx(2.0 + size // 2 / 1e3, abs=width)
    _, low, _ = extremes(np.full(LONG, 7.0), valid)
    assert np.isnan(low[COLUMNS // 3 + 1 : COLUMNS // 2 - 1]).all()


def test_one_lost_sample_of_many_is_seen() -> None:
    valid = np.ones(LONG, dtype=bool)
    valid[777] = False
    _, y = signals("cut", 1e3, {"u": np.zeros(LONG), "y": np.zeros(LONG)}, valid)
    assert len(y.collections[-1].get_paths()) == 1


def test_a_model_lies_on_top_of_y_alone() -> None:
    time = np.linspace(0.0, 6.0, 200)
    u, y = signals("my rig", 1e3, {"u": time, "y": np.sin(time)}, model=np.cos(time))
    assert y.get_legend_handles_labels()[1] == ["recorded", "model"]
    assert y.lines[1].get_zorder() >= y.lines[0].get_zorder()
    assert np.array_equal(y.lines[1].get_ydata(), np.cos(time))
    assert len(u.lines) == 1
