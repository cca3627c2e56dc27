"""Do the tables come out: bounds as in physics.md 1.8, ours near them, and no number where there can be none?"""

import numpy as np
import pytest

from tests.benchmarks.paper_experiments import (
    LEVELS,
    TABLE_3,
    M,
    level_slopes,
    real_tone,
    settled_levels,
    tone,
    values_with,
    walk,
)
from tests.benchmarks.paper_tables import (
    W1_HZ,
    Simulation,
    harmonic,
    levels,
    measured_bound,
    real_parts,
    spread,
)

NOISE_V = tone(1, 3.5, 1).noise_v(34.45)


@pytest.fixture(scope="module")
def stairs():
    return walk(values_with(TABLE_3))


@pytest.mark.parametrize(("decibels", "rms"), [(32.0, 0.0020), (64.6, 4.6e-5), (11.0, 0.022), (10.0, 0.025)])
def test_bound_on_the_26_levels(stairs, decibels, rms) -> None:
    slopes = level_slopes(TABLE_3)
    covariance = np.linalg.inv(slopes.T @ slopes) * stairs.noise_v(decibels) ** 2 / M
    assert np.sqrt(np.mean(np.diag(slopes @ covariance @ slopes.T))) == pytest.approx(rms, rel=0.02)
    if decibels == 32.0:
        assert np.sqrt(np.diag(covariance)) == pytest.approx([1.2e-3, 1.3e-3, 1.1e-3, 7.8e-4], rel=0.05)


def test_truth_is_the_one_behind_table_3(stairs) -> None:
    printed = [-2.135, 0.252, 3.762, 4.635, 2.24, -3.016]
    assert settled_levels(TABLE_3)[[3, 7, 11, 15, 19, 25]] == pytest.approx(printed, abs=0.009)
    settled = stairs.clean[stairs.used].reshape(LEVELS.size, M).mean(axis=1)
    assert settled == pytest.approx(settled_levels(TABLE_3), abs=1e-5)


def test_levels_are_found_to_the_bound(stairs) -> None:
    """Two realisations: rms over bound scatters by about a third."""
    found = levels(stairs, 32.0, range(2))
    rms = [np.sqrt(np.mean(np.square(x - found.truth))) for x in (found.ours, found.paper)]
    assert rms[0] < 2.0 * np.sqrt(np.mean(np.square(found.bound)))
    assert rms[0] < rms[1]


def test_bound_of_two_amplitudes_at_one_frequency() -> None:
    best = measured_bound([tone(1, 3.5, 50), tone(1, 2.0, 50)], NOISE_V)
    g2 = [spread(harmonic(best.g2, n * W1_HZ)) for n in (1, 3, 5)]
    assert 100.0 * spread(best.g1[0]) == pytest.approx(0.074, rel=0.03)
    assert 100.0 * np.array(g2) == pytest.approx([0.11, 0.13, 0.34], rel=0.03)


def test_what_the_paper_could_not_have_measured_has_no_number() -> None:
    made = Simulation.of(*(tone(times, 3.5, 30) for times in (1, 5, 10)))
    one, two = made.parts(NOISE_V, 0, ({}, {}))
    assert harmonic(one.read, 10 * W1_HZ).gain is None
    assert "not separated" in harmonic(one.read, 10 * W1_HZ).because
    assert all(harmonic(two.read, k * W1_HZ).gain is None for k in (2, 4))
    for n in (1, 5):  # nor could it have come as near as it printed
        assert abs(np.log(harmonic(one.read, n * W1_HZ).gain.value / abs(one.truth(n)))) < 4.0 * one.limits(n)[0]
        assert one.limits(n)[0] > 0.04
        assert one.limits(n)[1] < 2e-4


def test_a_stuck_gap_has_no_number_but_the_amplitude_that_frees_it() -> None:
    sines = [real_tone(times, 10.0, 4) for times in (1, 2, 5)]
    assert [float(np.ptp(made.clean[made.used])) for made in sines[1:]] == [0.0, 0.0]
    one, _ = real_parts(sines, 0, ({}, {}))
    text = "\n".join(one.rows())
    assert "raise it above 15.8 V" in text
    assert "raise it above 39.3 V" in text
