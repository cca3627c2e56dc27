"""Is the source voltage the same, drawn at once or where it is read?"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.between import Drawn, source_of, source_voltage
from identify.trace import Trace
from tests.trials import Shelf

U = np.random.default_rng(0).normal(size=400)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(["held", "linear"]), st.integers(1, 5), st.integers(0, 2000), st.integers(0, 2000))
def test_a_stretch_is_what_the_whole_has_there(intersample, substeps, start, length):
    whole = source_voltage(U, intersample, substeps)
    drawn = Drawn(U.size * substeps, Shelf(U.size, U), intersample, substeps)
    assert drawn.size == whole.size
    assert np.array_equal(drawn[start : start + length], whole[start : start + length])


@pytest.mark.parametrize("substeps", [1, 2, 5])
def test_a_band_limited_signal_is_drawn_through_its_samples_and_right_between_them(substeps):
    instants = np.arange(1000 * substeps) / substeps
    true = np.sin(2.0 * np.pi * 0.31 * instants) + 0.5 * np.cos(2.0 * np.pi * 0.45 * instants)
    drawn = Drawn(true.size, Shelf(1000, true[::substeps]), "bandlimited", substeps)
    inner = slice(100 * substeps, 900 * substeps)
    assert np.allclose(drawn[inner], true[inner], rtol=0, atol=2e-6)
    assert np.allclose(drawn[:][::substeps], true[::substeps], rtol=0, atol=1e-12)
    assert np.array_equal(drawn[517:1003], drawn[:][517:1003])


def test_what_is_in_memory_and_small_is_kept():
    trace = Trace("t", 1e3, U, U)
    assert np.array_equal(source_of(trace, 3), source_voltage(U, "held", 3))
    assert isinstance(source_of(Trace("t", 1e3, Shelf(U.size, U), U), 3), Drawn)
