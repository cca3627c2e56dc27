"""Does one multisine give G1 of an independent integrator at all its lines, once F and G2 are known?"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from identify.harmonic.harmonics import coefficients
from identify.harmonic.multisine import Given, from_multisine
from identify.harmonic.periods import periods
from identify.harmonic.steady import beside_w, frequency_response, lines_of, settled, signal_of
from identify.model import Backlash
from tests.proof.rigs import OP_AMP, SKEWED
from tests.proof.stimuli import MULTISINE_HZ, multisine, sine
from tests.trials import model_of, noisy, recorded

BORDERS = Backlash(7.0, 1.0, 8.5, -1.3)
TURN = 2.0 * np.pi * np.arange(1 << 14) / (1 << 14)


@pytest.fixture(scope="module")
def clean():
    return recorded(OP_AMP, multisine("lines", 8.0, 3), fine=8)


def answered(trace, given, noise_v=0.01, seed=1, wider=1.0):
    (period,) = periods(noisy(trace, noise_v, seed), 0.2, noise_v)
    return from_multisine(period, given, wider)


def z_of(points, block):
    """Return by how many standard deviations log gain and phase miss the truth, shape (points, 2)."""
    truth = frequency_response(block, [p.frequency_hz for p in points])
    rows = []
    for p, t in zip(points, truth, strict=True):
        apart = float(np.angle(np.exp(1j * (p.phase_rad.value - np.angle(t)))))
        rows.append((np.log(p.gain.value / abs(t)) / np.log(p.gain.high / p.gain.value),
                     apart / (p.phase_rad.high - p.phase_rad.value)))
    return 1.96 * np.array(rows)


def test_g1_comes_out_at_every_line(clean) -> None:
    model = model_of(OP_AMP)
    found = answered(clean, Given(model))
    assert [p.frequency_hz for p in found] == pytest.approx(MULTISINE_HZ)
    assert all(p.origin == "multisine" and p.gain.high / p.gain.low < 1.02 for p in found)
    assert np.max(np.abs(z_of(found, model.g1))) < 4.5


def test_a_start_20_per_cent_off_comes_to_the_same(clean) -> None:
    model = model_of(OP_AMP)
    off = replace(model, g1=replace(model.g1, den=(1e-4, 24.0, 1000.0)))
    for one, other in zip(answered(clean, Given(model)), answered(clean, Given(off)), strict=True):
        assert one.gain.value == pytest.approx(other.gain.value, rel=1e-4)


def test_intervals_cover_the_truth_over_many_noises(clean) -> None:
    model, trials = model_of(OP_AMP), 12
    z = np.array([z_of(answered(clean, Given(model), seed=seed), model.g1) for seed in range(trials)])
    total = float(np.sum(np.square(z)))
    assert chi2.ppf(1e-4, z.size) < total < chi2.ppf(1.0 - 1e-4, z.size)


def test_what_is_unsure_of_f_and_g2_widens_the_intervals(clean) -> None:
    """A slope off by 1 % is G1 off by about as much; told that it may be, the answer covers the truth."""
    model = model_of(OP_AMP)
    wrong = replace(model, f=replace(model.f, s_l=8.08, s_u=8.08))
    moved = replace(model, f=replace(model.f, s_l=8.18, s_u=8.18))
    sure, unsure = answered(clean, Given(wrong)), answered(clean, Given(wrong, (moved,)))
    assert np.max(np.abs(z_of(sure, model.g1))) > 5.0
    assert np.max(np.abs(z_of(unsure, model.g1))) < 4.5
    assert unsure[0].gain.high / unsure[0].gain.low > sure[0].gain.high / sure[0].gain.low


def test_a_multisine_within_the_gap_tells_nothing() -> None:
    found = answered(recorded(OP_AMP, multisine("small", 1.0, 3), fine=4), Given(model_of(OP_AMP)))
    assert all(p.gain is None and p.phase_rad is None and "stuck during" in p.because for p in found)


def test_more_lines_than_can_be_taken_apart_are_refused_in_words(clean) -> None:
    (period,) = periods(noisy(clean, 0.01, 1), 0.2, 0.01)
    found = from_multisine(replace(period, played=tuple(range(1, 101))), Given(model_of(OP_AMP)))
    assert len(found) == 100
    assert all(p.gain is None and "too many lines" in p.because for p in found)


def test_settled_play_of_a_sine_has_the_closed_harmonics_and_their_slope() -> None:
    orders = np.arange(9)
    found = settled(3.0 * np.cos(TURN + 1.0), BORDERS)
    assert lines_of(found.w, 9) == pytest.approx(coefficients(3.0, 1.0, BORDERS, orders), abs=1e-5)
    there = lines_of(settled(3.0001 * np.cos(TURN + 1.0), BORDERS).w, 9)
    moved = lines_of(found.moved(np.cos(TURN + 1.0)), 9)
    assert moved == pytest.approx((there - lines_of(found.w, 9)) / 1e-4, abs=2e-2)
    assert signal_of(lines_of(found.w, 1000), TURN.size) == pytest.approx(found.w, abs=1e-2)
    assert not settled(0.5 * np.cos(TURN), BORDERS).moves
    assert not settled(0.5 * np.cos(TURN), BORDERS).moved(np.cos(TURN)).any()


def test_images_of_a_coarsely_held_sine_change_w_as_the_integrator_says() -> None:
    """40 samples to a period: without the images the first harmonic would be off by more."""
    model, trace = model_of(SKEWED), recorded(SKEWED, sine("coarse", 250.0, 60.0, 40, 3), fine=64)
    (period,) = periods(trace, 0.2, 1e-3)
    orders = np.arange(4)
    drive = period.drive([1])[0] * frequency_response(model.g1, [250.0])[0]
    pure = coefficients(abs(drive), float(np.angle(drive)), model.f, orders)
    w = period.lines[orders] / frequency_response(model.g2, 250.0 * orders)
    left = w - pure - beside_w(period, model, orders)
    assert np.max(np.abs(left)) < 0.2 * np.max(np.abs(w - pure))
