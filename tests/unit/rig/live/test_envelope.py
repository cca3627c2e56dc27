"""Does a picture of few columns keep every extreme of all samples, however they arrive?"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.live.envelope import Envelope, Hull, Latest, Means, drawn

SIZES = st.integers(1, 400)
CUTS = st.lists(st.integers(1, 60), min_size=1, max_size=40)


def pieces(size: int, cuts: list[int]) -> list[tuple[int, int]]:
    """Return [0, size) in stretches of the lengths ``cuts``, over and over."""
    found, at, k = [], 0, 0
    while at < size:
        found.append((at, min(at + cuts[k % len(cuts)], size)))
        at, k = found[-1][1], k + 1
    return found


def readings(size: int) -> np.ndarray:
    """Return levels of which some were lost."""
    values = np.random.default_rng(size).standard_normal(size)
    values[np.random.default_rng(size + 1).random(size) < 0.2] = np.nan
    return values


@given(SIZES, CUTS, st.integers(1, 30))
def test_columns_hold_extremes_and_means_of_their_samples(size: int, cuts: list[int], columns: int) -> None:
    values = readings(size)
    envelope, means = Envelope(size, columns), Means(size, columns)
    for first, stop in pieces(size, cuts):
        envelope.add(first, values[first:stop])
        means.add(first, values[first:stop])
    assert envelope.low.size <= columns
    for at in range(envelope.low.size):
        held = values[at * envelope.width : (at + 1) * envelope.width]
        held = held[np.isfinite(held)]
        expected = (held.min(), held.max(), held.mean()) if held.size else (np.nan,) * 3
        found = (envelope.low[at], envelope.high[at], means.means()[at])
        np.testing.assert_allclose(found, expected, rtol=1e-12)


def test_a_spike_of_one_sample_in_an_hour_is_seen() -> None:
    size, at = 2_000_000, 1_234_567
    envelope = Envelope(size)
    for first in range(0, size, 1 << 15):
        values = np.zeros(min(1 << 15, size - first))
        if first <= at < first + values.size:
            values[at - first] = 7.0
        envelope.add(first, values)
    assert envelope.low.size <= 600
    assert np.flatnonzero(envelope.high) == [at // envelope.width]
    assert envelope.high.max() == 7.0


@given(SIZES, CUTS)
def test_the_last_samples_are_kept_and_no_others(size: int, cuts: list[int]) -> None:
    values, latest = np.arange(float(size)), Latest(("y",), 50)
    for first, stop in pieces(size, cuts):
        latest.add(first, {"y": values[first:stop]})
    assert latest.first == max(size - 50, 0)
    assert np.array_equal(latest.signals["y"], values[-50:])


@given(st.integers(0, 10_000), st.integers(1, 3000), st.integers(1, 200))
def test_a_line_is_short_and_stands_still_while_samples_move_on(first: int, size: int, columns: int) -> None:
    values = readings(size)
    index, drawn_values = drawn(values, first, columns)
    assert index.size == drawn_values.size <= max(2 * columns, size if size <= columns else 0)
    assert np.all(np.diff(index) > 0.0)
    if size > columns:
        width = -(-size // columns)
        assert np.allclose((index[::2] - 0.25 * width) % width, 0.0)
        assert np.all(index >= first)
        assert np.all(index < first + size)


def test_the_outline_of_loops_widens_and_loses_nothing() -> None:
    hull, rng = Hull(16), np.random.default_rng(5)
    v = np.concatenate([scale * rng.uniform(-1.0, 1.0, 500) for scale in (1e-3, 0.1, 3.0, 40.0)])
    y = rng.standard_normal(v.size)
    for at in range(0, v.size, 77):
        hull.add(v[at : at + 77], y[at : at + 77])
    assert hull.levels_v().size == 32
    column = np.floor(v / hull.width_v).astype(int) + 16
    for at in range(32):
        inside = y[column == at]
        expected = (inside.min(), inside.max()) if inside.size else (np.nan, np.nan)
        assert (hull.low[at], hull.high[at]) == pytest.approx(expected, nan_ok=True)


def test_what_is_no_number_leaves_no_trace_in_the_outline() -> None:
    hull = Hull()
    hull.add(np.array([np.nan, 1.0]), np.array([1.0, np.nan]))
    assert np.isnan(hull.low).all()
