"""Is the share of a pole's information that sampling keeps what the sums say?"""

import numpy as np
import pytest

from identify.model import Rational
from identify.planning.sampling import sampling_advice, share_kept


@pytest.mark.parametrize("x", [0.05, 0.3, 1.0, 2.0, 4.0])
def test_the_share_is_that_of_the_sampled_exponential(x: float) -> None:
    """Against readings a thousand times as fast, each weighing a thousandth."""

    def told(step: float) -> float:
        t = np.arange(step, 60.0, step)
        return float(np.sum(np.square(t * np.exp(-t))) * step)

    assert share_kept(-1.0, 1.0 / x) == pytest.approx(told(x) / told(1e-3 * x), rel=2e-3)


def test_slow_poles_keep_all_and_fast_ones_nothing() -> None:
    assert share_kept(-1e-3, 1.0) == pytest.approx(1.0, abs=1e-3)
    assert share_kept(-1e6, 1.0) == 0.0


def test_poles_of_the_paper_s_circuit_at_10_khz() -> None:
    found = list(sampling_advice("G1", Rational((1000.0,), (1e-4, 20.0, 1000.0)), 1e4))
    assert len(found) == 1
    assert "31.8 kHz lies above half the sample rate of 10 kHz: only the delay of 5 µs" in found[0]


def test_a_pole_between_is_worth_more_samples_and_a_pair_counts_once() -> None:
    found = list(sampling_advice("G2", Rational((1.0,), (1.0, 2.0, 100.0**2)), 50.0))
    assert len(found) == 1
    assert "loses 37 % of" in found[0]
    assert "sample at 100 Hz or faster" in found[0]
    assert not list(sampling_advice("G2", Rational((1.0,), (1.0, 2.0, 100.0**2)), 200.0))
