"""Is the mean power of a law over many lines what adding them up one by one tells?"""

import numpy as np
import pytest

from identify.readings.spectra import mean_law


@pytest.mark.parametrize("slope", [0.3, 0.999999, 1.0, 1.7, 3.0])
@pytest.mark.parametrize(("lowest_hz", "count"), [(0.04, 1), (0.04, 32), (0.5, 33), (0.04, 250_000)])
def test_the_mean_of_a_power_law_is_that_of_its_lines(lowest_hz: float, count: int, slope: float) -> None:
    lines = lowest_hz * np.arange(1, count + 1)
    assert mean_law(lines, slope) == pytest.approx(float(np.mean(lines**-slope)), rel=1e-8)
