"""Do the intervals of a few calibrations hold the truth as often as those of 95 % do? The whole table is a command."""

from scipy.stats import binom

from tests.benchmarks.calibration import CASES, coverage

COUNT = 6
BY_CHANCE = 1e-3
"""Below it that few intervals hold the truth by bad luck alone."""


def test_a_few_calibrations_hold_the_truth() -> None:
    for row in coverage(CASES[0], COUNT, seed=0):
        assert binom.cdf(row.held, row.count, 0.95) > BY_CHANCE, row
        assert row.half > 0.0
