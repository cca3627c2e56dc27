"""Is an averaged period what repeats, and its noise what does not?"""

import numpy as np
import pytest

from identify.harmonic.periods import periods
from identify.trace import Step, Trace

P, COUNT = 64, 400
TURN = 2.0 * np.pi * np.arange(P) / P


def trace(wave, u=None, noise_v=0.0, **options):
    y = np.tile(wave, COUNT) + np.random.default_rng(1).normal(0.0, 1.0, P * COUNT) * noise_v
    return Trace("run", 1000.0, np.tile(np.cos(TURN) if u is None else u, COUNT), y, **options)


def test_lines_are_complex_amplitudes_and_the_mean_counts_once() -> None:
    (found,) = periods(trace(0.5 + 2.0 * np.cos(TURN + 0.3) - np.sin(3 * TURN)), 0.0, 1.0)
    assert found.lines[:4] == pytest.approx([0.5, 2.0 * np.exp(0.3j), 0.0, 1j])
    assert found.mean_y_v() == pytest.approx(0.5 + 2.0 * np.cos(TURN + 0.3) - np.sin(3 * TURN))
    assert (found.played, found.count, found.base_hz) == ((1,), COUNT - 1, 1000.0 / P)


def test_noise_of_a_line_is_its_scatter_over_the_root_of_the_count() -> None:
    (found,) = periods(trace(np.cos(TURN), noise_v=0.1), 0.0, 1.0)
    expected = 0.1 * np.sqrt(2.0 / P / (COUNT - 1))
    assert found.sd_v[1:-1] == pytest.approx(expected, rel=0.1)
    assert found.sd_v[0] == pytest.approx(expected / np.sqrt(2.0), rel=0.1)


def test_a_single_period_takes_the_noise_it_is_told() -> None:
    one = Trace("run", 1000.0, np.tile(np.cos(TURN), 2), np.zeros(2 * P))
    (found,) = periods(one, 0.0, 0.1)
    assert found.count == 1
    assert found.sd_v[5] == pytest.approx(0.1 * np.sqrt(2.0 / P))


def test_periods_with_lost_samples_are_left_out() -> None:
    valid = np.ones(P * COUNT, dtype=bool)
    valid[[5 * P, 5 * P + 9, 77 * P + 1]] = False
    wild = trace(np.cos(TURN), valid=valid)
    y = np.where(valid, wild.y, 1e3)
    (found,) = periods(Trace("run", 1000.0, wild.u, y, valid=valid), 0.0, 1.0)
    assert found.count == COUNT - 3
    assert found.mean_y_v() == pytest.approx(np.cos(TURN))


@pytest.mark.parametrize(("between", "power"), [("held", 1), ("linear", 2), ("bandlimited", 0)])
def test_drive_is_what_reaches_g1_between_samples(between, power) -> None:
    """The first line of the voltage between samples, from a fine drawing of it."""
    (found,) = periods(trace(np.cos(TURN), intersample=between), 0.0, 1.0)
    fine = 1000
    at = (np.arange(P * fine) + 0.5) / fine
    u = np.append(np.cos(TURN), 1.0)
    drawn = {
        "held": u[at.astype(int)], "linear": np.interp(at, np.arange(P + 1), u), "bandlimited": np.cos(TURN[1] * at),
    }  # fmt: skip
    line = 2.0 * np.mean(drawn[between] * np.exp(-1j * TURN[1] * at))
    assert found.drive([1])[0] == pytest.approx(line, abs=1e-6)
    assert abs(found.drive([1])[0]) == pytest.approx(np.sinc(1.0 / P) ** power)


def test_each_stimulus_of_a_run_gives_a_period_and_what_is_no_sine_gives_none() -> None:
    triangle = 2.0 * np.abs(np.arange(P) / P - 0.5)
    u = np.concatenate([np.tile(np.cos(TURN), 5), np.zeros(P), np.tile(np.cos(2 * TURN), 5), np.tile(triangle, 5)])
    edges = np.array([0, 5, 6, 11, 16]) * P
    steps = tuple(Step(n, "sine", a, b) for n, a, b in zip("abcd", edges[:-1], edges[1:], strict=True))
    found = periods(Trace("run", 1000.0, u, u, steps=steps), 0.0, 1.0)
    assert [(p.name, p.played, p.u.size, p.count) for p in found] == [("a", (1,), P, 4), ("c", (1,), P // 2, 9)]
    assert len(periods(Trace("run", 1000.0, u, u, steps=steps), 3 * P / 1000.0, 1.0)) == 2
    assert not periods(Trace("run", 1000.0, u, u, steps=steps), 5 * P / 1000.0, 1.0)
