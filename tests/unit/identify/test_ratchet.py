"""Is the mean of a play under noise what many noisy benches have on the average?"""

import numpy as np
import pytest

from identify import altered_kernels
from identify.ratchet import PER_Z, SPEEDS, Kind, highest_of_low_passed, highest_of_white, rests, shaken
from tests.proof.ratchet import HALF_GAP_V, Noise, ratcheted, stairs, waves
from tests.proof.stimuli import RATE_HZ


def mean_level(
    v: np.ndarray, sd_v: float, renewed: float, kind: Kind, later_v=(0.0,), hold=altered_kernels.STILL
) -> np.ndarray:
    """Return the mean of w as the product has it, for borders of slope 1 of which contacts take hold ``later_v``."""
    later, out = np.array(later_v), np.empty(v.size)
    altered_kernels.noisy_plays(
        v - HALF_GAP_V, v + HALF_GAP_V, later, later, (sd_v, sd_v), shaken(kind, renewed), hold,
        (np.nan, np.nan), np.zeros(later.size), np.zeros(later.size), out,
    )  # fmt: skip
    return out


def test_the_highest_of_a_white_noise_is_that_of_many_stretches():
    bench = Noise(1.0, 1000.0, low_passed=False).drawn(np.random.default_rng(3), 1 << 19, 1.0 / 16e3)
    for times, near in ((1.0, 0.12), (10.0, 0.06), (100.0, 0.06)):
        each = round(16 * times)
        highest = bench[: bench.size // each * each].reshape(-1, each).max(axis=1)
        chance = 3.0 * float(highest.std()) / np.sqrt(highest.size)
        assert highest_of_white(np.array([times]))[0] == pytest.approx(highest.mean(), abs=near + chance)


def test_the_highest_of_a_low_passed_noise_begins_as_brownian_motion_and_grows_as_extremes_do():
    """At first sqrt(4 t / pi); late, passings of a level z are rare and come at the rate z exp(-z^2/2) / sqrt(2 pi)."""
    few = np.array([1e-2, 1e-1])
    assert np.allclose(highest_of_low_passed(few), np.sqrt(4.0 * few / np.pi), rtol=0.05)
    z = np.linspace(0.0, 9.0, 9001)
    late = np.array([1e4, 1e6])
    passed = [-np.expm1(-t * z * np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi)) for t in late]
    expected = [np.trapezoid(np.where(z < 1.0, 1.0, p), z) for p in passed]
    assert np.allclose(highest_of_low_passed(late), expected, rtol=0, atol=0.02)


@pytest.mark.parametrize("kind", ["low-pass", "white"])
@pytest.mark.parametrize("v", [stairs(0.03), waves()], ids=["stairs", "sine"])
@pytest.mark.parametrize("bandwidth_hz", [100.0, 1000.0])
def test_the_mean_is_that_of_many_benches(kind, v, bandwidth_hz):
    sd_v = 0.05
    bench = ratcheted(v, Noise(sd_v, bandwidth_hz, kind == "low-pass"), 60)
    per_hz = 1.0 if kind == "white" else 2.0 * np.pi
    mean = mean_level(v, sd_v, per_hz * bandwidth_hz / RATE_HZ, kind)
    chance = float(np.mean(bench.scatter**2)) / 60
    off = np.sqrt(max(float(np.mean((mean - bench.mean) ** 2)) - chance, 0.0))
    assert off < 0.25 * sd_v  # single benches scatter by 0.4 to 0.9 sd about their mean


def test_without_noise_to_speak_of_it_is_the_play():
    v, ideal = waves(), np.empty(waves().size)
    altered_kernels.held_play(v - HALF_GAP_V, v + HALF_GAP_V, altered_kernels.STILL, (0.0, 0.0), ideal)
    assert np.allclose(mean_level(v, 1e-9, 0.2, "low-pass"), ideal, rtol=0, atol=1e-8)


@pytest.mark.parametrize("kind", ["low-pass", "white"])
@pytest.mark.parametrize("sd_v", [5e-4, 0.02])
def test_a_step_may_be_long_beside_what_the_border_runs_through(kind, sd_v):
    """A sine of 250 V/s passes through the noise many times in a step: a grid 64 times as fine says the same."""
    coarse, fine = (2.0 * np.sin(2.0 * np.pi * 20.0 * np.arange(0.0, 0.1, 1.0 / rate)) for rate in (1e4, 64e4))
    means = [mean_level(v, sd_v, renewed, kind) for v, renewed in ((coarse, 0.5), (fine, 0.5 / 64))]
    assert np.sqrt(np.mean((means[0] - means[1][::64]) ** 2)) < 0.02 * sd_v


def test_a_fast_border_meets_a_low_passed_noise_as_brownian_motion():
    """Its mean height gains 2 / (pi h) a unit of time: it rests where that is the border's speed."""
    speeds = np.array([20.0, 100.0])
    x = np.sqrt(np.sqrt(speeds))
    found = np.interp(x / (1.0 + x), np.arange(SPEEDS) / SPEEDS, rests("low-pass")) / PER_Z
    assert np.allclose(found, 2.0 / (np.pi * speeds), rtol=0.03)


@pytest.mark.parametrize("hold", [altered_kernels.STILL, (0.999, 1e-4, 0.0, 1e-3, 2e-3)])
def test_contacts_that_shake_side_by_side_are_the_mean_of_each_alone(hold):
    v = 3.0 * HALF_GAP_V * np.sin(np.linspace(0.0, 20.0, 4000))
    v[1000:1500] = v[1000]
    contacts = np.array([-0.2, 0.05, 0.3]) * HALF_GAP_V
    each = [mean_level(v, 0.05 * HALF_GAP_V, 0.3, "low-pass", (later,), hold) for later in contacts]
    together = mean_level(v, 0.05 * HALF_GAP_V, 0.3, "low-pass", contacts, hold)
    assert np.ptp(each, axis=0).max() > 0.1 * HALF_GAP_V
    assert np.allclose(together, np.mean(each, axis=0), rtol=0.0, atol=1e-12)


def test_a_border_that_has_run_away_asks_for_no_place_outside_a_table():
    """Where a trial of a fit overflows, a border jumps to infinity, and w goes with it."""
    v = np.array([0.0, 0.1, np.inf, np.inf])
    with np.errstate(invalid="ignore"):
        w = mean_level(v, 0.05, 0.3, "white")
    assert np.all(np.isfinite(w[:2]))
    assert np.all(np.isinf(w[2:]))
    table = rests("white")
    assert altered_kernels._rest(np.inf, 1.0, table) == pytest.approx(table[-1])
