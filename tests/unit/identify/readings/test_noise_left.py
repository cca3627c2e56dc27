"""Is noise that hangs together told from what a model leaves, and physics that only looks slow not?"""

import numpy as np
import pytest

from identify.readings.noise_left import noise_left
from identify.trace import Trace

RATE_HZ, WHITE_V, SIZES = 10e3, 0.01, (20_000, 12_000, 16_000, 30_000)


def coloured(size: int, sd_v: float, slope: float, rng: np.random.Generator) -> np.ndarray:
    """Return noise whose power falls as 1 / f^slope from one period in it on."""
    spectrum = np.fft.rfft(rng.normal(size=size))
    frequency = np.fft.rfftfreq(size)
    shape = np.zeros(frequency.size)
    shape[1:] = frequency[1:] ** (-0.5 * slope)
    noise = np.fft.irfft(spectrum * shape, size)
    return sd_v * noise / np.sqrt(np.mean(shape[1:] ** 2))


def left(parts: list[np.ndarray]) -> list[Trace]:
    return [Trace(f"run {i}", RATE_HZ, np.zeros(part.size), part) for i, part in enumerate(parts)]


def runs(seed: int, sd_v: float, slope: float = 1.2) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [coloured(size, sd_v, slope, rng) + WHITE_V * rng.normal(size=size) for size in SIZES]


@pytest.mark.parametrize("slope", [0.7, 1.2])
def test_a_power_law_is_measured(slope: float) -> None:
    found = noise_left(left(runs(1, 0.004, slope)), left(runs(2, 0.004, slope)))
    assert found is not None
    assert found.sd_v == pytest.approx(0.004, rel=0.15)
    assert found.slope == pytest.approx(slope, abs=0.15)
    interval = found.blemish.values["slope"]
    assert interval.low < slope < interval.high


def test_white_noise_is_none() -> None:
    assert noise_left(left(runs(3, 0.0)), left(runs(4, 0.0))) is None


def test_what_is_missing_in_one_run_is_no_noise_of_the_reading() -> None:
    parts = runs(5, 0.006)
    parts[3] = WHITE_V * np.random.default_rng(6).normal(size=SIZES[3])
    assert noise_left(left(parts), left(runs(7, 0.006))) is None


def test_what_is_not_there_in_the_held_out_runs_is_none() -> None:
    assert noise_left(left(runs(8, 0.004)), left(runs(9, 0.0))) is None


def test_a_level_that_jumps_is_no_noise() -> None:
    rng = np.random.default_rng(10)
    jumps = [0.03 * np.sign(np.cumsum(rng.uniform(size=size) < 2e-3) % 2 - 0.5) for size in SIZES]
    noisy = [part + WHITE_V * rng.normal(size=part.size) for part in jumps]
    assert noise_left(left(noisy), left(noisy)) is None


def test_an_answer_of_the_rig_is_no_noise() -> None:
    rng = np.random.default_rng(11)
    answers = [0.01 * np.sin(2.0 * np.pi * 10.0 * np.arange(size) / RATE_HZ) for size in SIZES]
    noisy = [part + WHITE_V * rng.normal(size=part.size) for part in answers]
    assert noise_left(left(noisy), left(noisy)) is None


def test_a_level_that_jumps_below_the_noise_is_none_either() -> None:
    """Popcorn noise: its spectrum is that of a wandering level, and no single reading shows a jump."""
    rng = np.random.default_rng(12)
    jumps = [0.0035 * (np.cumsum(rng.uniform(size=size) < 2.7 / RATE_HZ) % 2) for size in (120_000, 150_000)]
    noisy = [part + WHITE_V * rng.normal(size=part.size) for part in jumps]
    assert noise_left(left(noisy), left(noisy)) is None


@pytest.mark.parametrize(("sizes_v", "there"), [((0.0025, 0.0025), True), ((0.0025, 0.001), False)])
def test_what_some_runs_have_more_of_than_others_is_none(sizes_v: tuple[float, float], there: bool) -> None:
    """Below the noise every single run looks as the law of all does: what the rig does in it differs all the same."""
    rng = np.random.default_rng(14)
    parts = [
        coloured(size, sizes_v[i % 3 == 1], 1.2, rng) + WHITE_V * rng.normal(size=size)
        for i, size in enumerate((*SIZES, *SIZES))
    ]
    assert (noise_left(left(parts[:4]), left(parts[4:])) is not None) is there
