"""Are mean and scatter of readings behind coarse steps of an ADC those of very many of them?"""

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import norm

from identify.effects.adc_quantisation import rounded_mean, rounded_sd

LEVELS = np.linspace(-0.73, 0.91, 57)
LSB = 0.31


@pytest.mark.parametrize("noise", [0.01, 0.05, 0.12, 0.3])
def test_the_mean_reading_is_that_of_many(noise: float) -> None:
    every = norm.ppf((np.arange(40_000) + 0.5) / 40_000) * noise
    many = LSB * np.rint((LEVELS[:, None] + every) / LSB)
    assert rounded_mean(LEVELS, LSB, noise) == pytest.approx(np.mean(many, axis=1), abs=2e-5)
    assert np.square(rounded_sd(LEVELS, LSB, noise)) == pytest.approx(np.var(many, axis=1), rel=1e-3, abs=1e-5)


@pytest.mark.parametrize("width", [0.02, 0.05, 0.3, 0.9])
def test_the_table_of_a_step_is_exact_to_a_ten_millionth_of_it(width: float) -> None:
    edges = (np.arange(-20, 20) + 0.5) * LSB
    exact = LSB * (np.sum(ndtr((LEVELS[:, None] - edges) / (width * LSB)), axis=1) - 20.0)
    assert rounded_mean(LEVELS, LSB, width * LSB) == pytest.approx(exact, abs=1e-7 * LSB)


def test_an_answer_that_is_no_number_is_none_behind_the_steps_either() -> None:
    read = rounded_mean(np.array([np.nan, np.inf, -np.inf, 0.4 * LSB, 1e300]), LSB, 0.1 * LSB)
    assert np.isfinite(read).tolist() == [False, False, False, True, True]
