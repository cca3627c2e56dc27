"""Do the harmonics of sines give G1 and G2 of an independent integrator, and a reason where they cannot?"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from identify.harmonic.equations import equations
from identify.harmonic.measured import Known, exactly, linked, measured
from identify.harmonic.periods import periods
from identify.harmonic.steady import frequency_response
from identify.model import Backlash
from tests.proof.rigs import OP_AMP, SKEWED
from tests.proof.stimuli import sine
from tests.trials import model_of, noisy, recorded

NOISE_V = 0.002
SETTLE_S = 0.2


def sines(rig, *played, noise_v=NOISE_V, seed=0, count=12):
    """Return the averaged periods of sines (Hz, V)."""
    traces = [recorded(rig, sine(f"{f} Hz, {u} V", f, u, count, 1), fine=16) for f, u in played]
    return [p for i, t in enumerate(traces) for p in periods(noisy(t, noise_v, [seed, i]), SETTLE_S, noise_v)]


def z_of(point, block):
    """Return by how many standard deviations log gain and phase miss the truth."""
    (truth,) = frequency_response(block, [point.frequency_hz])
    gain, phase = point.gain, point.phase_rad
    apart = np.angle(np.exp(1j * (phase.value - np.angle(truth))))
    return (
        1.96 * np.log(gain.value / abs(truth)) / np.log(gain.high / gain.value),
        1.96 * apart / max(phase.high - phase.value, 1e-9),
    )


def gains(points):
    return {round(p.frequency_hz, 6): p.gain for p in points}


@pytest.fixture(scope="module")
def two_amplitudes():
    return sines(OP_AMP, (10.0, 3.4), (10.0, 2.6))


def test_two_amplitudes_at_one_frequency_separate_the_gains(two_amplitudes) -> None:
    model = model_of(OP_AMP)
    found = measured(two_amplitudes, exactly(model, two_amplitudes))
    (one,) = found.g1
    assert one.frequency_hz == pytest.approx(10.0)
    assert one.gain.high / one.gain.low < 1.01
    assert abs(z_of(one, model.g1)[0]) < 4.0
    odd = [p for p in found.g2 if p.gain and p.phase_rad]
    assert [round(p.frequency_hz) for p in odd[:3]] == [10, 30, 50]
    assert max(abs(z) for p in odd for z in z_of(p, model.g2)) < 4.0
    assert chi2.ppf(1e-4, found.freedom) < found.chi_squared < chi2.ppf(1.0 - 1e-4, found.freedom)
    assert "without dead time" in odd[0].assumed


def test_equal_slopes_leave_the_even_harmonics_without_a_number(two_amplitudes) -> None:
    found = measured(two_amplitudes, exactly(model_of(OP_AMP), two_amplitudes))
    even = [p for p in found.g2 if round(p.frequency_hz) in (20, 40)]
    assert len(even) == 2
    assert all(p.gain is None and p.phase_rad is None and "even" in p.because for p in even)
    assert even[0].to_dict()["gain"] is None


def test_a_sine_and_one_of_twice_its_frequency_do_not_separate_the_gains() -> None:
    """physics.md 1.2: they have no excited harmonic in common."""
    found = sines(OP_AMP, (10.0, 3.4), (20.0, 5.0))
    answer = measured(found, exactly(model_of(OP_AMP), found))
    assert gains(answer.g1) == {10.0: None, 20.0: None}
    assert all("not separated" in p.because for p in answer.g1)
    assert gains(answer.g2)[10.0] is gains(answer.g2)[20.0] is None


def test_a_sine_and_one_of_three_times_its_frequency_do() -> None:
    """30 Hz has a period of 333.3 samples: three of them are taken together."""
    model, found = model_of(OP_AMP), sines(OP_AMP, (10.0, 3.4), (30.0, 6.0), noise_v=1e-4, count=15)
    assert [p.played for p in found] == [(1,), (3,)]
    answer = measured(found, exactly(model, found))
    assert [round(p.frequency_hz) for p in answer.g1] == [10, 30]
    assert all(abs(z_of(p, model.g1)[0]) < 4.0 and p.gain.high / p.gain.low < 1.05 for p in answer.g1)


def test_unequal_slopes_and_the_mean_are_enough_for_one_sine() -> None:
    model, found = model_of(SKEWED), sines(SKEWED, (10.0, 3.4))
    answer = measured(found, exactly(model, found))
    assert abs(z_of(answer.g1[0], model.g1)[0]) < 4.0
    assert max(abs(z) for p in answer.g2 if p.gain and p.phase_rad for z in z_of(p, model.g2)) < 4.0
    assert 20 in [round(p.frequency_hz) for p in answer.g2 if p.gain]


def test_slopes_that_differ_by_chance_separate_nothing() -> None:
    """The start has slopes 0.1 % apart, no surer than 0.1 %."""
    found = sines(OP_AMP, (10.0, 3.4))
    model = replace(model_of(OP_AMP), f=Backlash(8.0, 1.25, 8.008, -1.25))
    known = replace(exactly(model, found), covariance=np.diag([0.008**2, 1e-6, 0.008**2, 1e-6, 1e-6]))
    assert gains(measured(found, known).g1) == {10.0: None}


def test_a_stuck_gap_is_named_with_the_amplitude_that_frees_it() -> None:
    """physics.md 1.4: 100 Hz would need 15.8 V."""
    found = sines(OP_AMP, (100.0, 10.0), count=40)
    answer = measured(found, exactly(model_of(OP_AMP), found))
    (one,) = answer.g1
    assert (one.gain, one.phase_rad, answer.g2) == (None, None, ())
    assert "stuck at U = 10 V" in one.because
    assert "15.8 V" in one.because


def test_unsure_borders_widen_the_intervals(two_amplitudes) -> None:
    known = exactly(model_of(OP_AMP), two_amplitudes)
    unsure = Known(known.model, known.phases_hz, np.diag([1e-4, 1e-5, 1e-4, 1e-5, 1e-4]))
    (sharp,), (wide,) = measured(two_amplitudes, known).g1, measured(two_amplitudes, unsure).g1
    assert wide.gain.high / wide.gain.low > sharp.gain.high / sharp.gain.low
    assert wide.phase_rad.high - wide.phase_rad.value == pytest.approx(1.96 * 0.01, rel=0.01)
    (stretched,) = measured(two_amplitudes, known, wider=7.0).g1
    assert np.log(stretched.gain.high / stretched.gain.low) > 4.0 * np.log(sharp.gain.high / sharp.gain.low)
    (hopeless,) = measured(two_amplitudes, known, wider=1e6).g1
    assert hopeless.gain is None
    assert "misses the recordings by 1e+06 times the noise" in hopeless.because


def test_sines_are_linked_by_the_harmonics_they_share() -> None:
    found = sines(OP_AMP, (10.0, 3.4), (10.0, 2.6), (20.0, 5.0), (50.0, 9.0))
    system, stuck = equations(found, model_of(OP_AMP))
    assert (linked(system), stuck) == ([[1], [0, 2]], ())


def test_intervals_cover_the_truth_over_many_noises() -> None:
    """chi-squared of 80 answers; a right interval fails this in one of ten thousand choices of the seeds."""
    model, trials = model_of(OP_AMP), 80
    clean = [recorded(OP_AMP, sine(f"{u} V", 10.0, u, 12, 1), fine=16) for u in (3.4, 2.6)]
    rows = []
    for seed in range(trials):
        seen = [p for i, t in enumerate(clean) for p in periods(noisy(t, 0.01, [seed, i]), SETTLE_S, 0.01)]
        answer = measured(seen, exactly(model, seen))
        two = {round(p.frequency_hz): p for p in answer.g2 if p.gain and p.phase_rad}
        rows.append([z_of(answer.g1[0], model.g1)[0], *z_of(two[10], model.g2), *z_of(two[30], model.g2)])
    sums = np.sum(np.square(rows), axis=0)
    assert np.all((chi2.ppf(1e-5, trials) < sums) & (sums < chi2.ppf(1.0 - 1e-5, trials)))
