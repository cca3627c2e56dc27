"""Are waves and walks read off the samples as they were played?"""

import numpy as np
import pytest

from identify.model import Rational
from identify.planning import excitation
from identify.planning.excitation import Walk, Wave, excitations
from identify.trace import Array, Step, Trace

RATE_HZ = 1000.0
T = np.arange(2000) / RATE_HZ
LAG = Rational((1.0,), (0.02, 1.0))


def read(u: Array, kind: str = "") -> Wave | Walk | None:
    steps = (Step("a", kind, 0, u.size), Step("a", kind, 0, u.size, 1)) if kind else ()
    found = list(excitations(Trace("t", RATE_HZ, u, np.zeros(u.size), steps=steps)))
    assert len(found) <= 1
    return found[0] if found else None


@pytest.mark.parametrize("kind", ["", "sine"])
def test_a_sine_is_one_line_of_its_amplitude(kind: str) -> None:
    wave = read(0.5 + 3.0 * np.sin(2 * np.pi * 10.0 * T), kind)
    assert isinstance(wave, Wave)
    assert wave.is_sine
    assert wave.lines_hz.tolist() == [10.0]
    assert wave.size_v == pytest.approx(3.0)
    assert wave.offset_v == pytest.approx(0.5)
    assert wave.period_s == pytest.approx(0.1)
    gain = abs(1.0 / (1.0 + 2j * np.pi * 10.0 * 0.02))
    assert wave.swing_behind(LAG) == pytest.approx((3.0 * gain, -3.0 * gain))


def test_a_multisine_swings_as_its_settled_answer_does() -> None:
    from scipy.signal import lfilter

    u = np.sin(2 * np.pi * 5.0 * T) + np.cos(2 * np.pi * 35.0 * T)
    wave = read(u, "multisine")
    assert isinstance(wave, Wave)
    assert wave.lines_hz.tolist() == [5.0, 35.0]
    fine = np.interp(np.arange(0, 2.0, 1e-5), T, u)
    decay = np.exp(-1e-5 / 0.02)
    settled = lfilter([1.0 - decay], [1.0, -decay], fine)[-20_000:]
    high, low = wave.swing_behind(LAG)
    assert high == pytest.approx(settled.max(), abs=5e-3)
    assert low == pytest.approx(settled.min(), abs=5e-3)


@pytest.mark.parametrize("kind", ["", "staircase"])
def test_a_staircase_is_its_levels_and_its_shortest_dwell(kind: str) -> None:
    walk = read(np.concatenate((np.zeros(300), np.full(400, 1.0), np.full(250, -2.0))), kind)
    assert isinstance(walk, Walk)
    assert walk.levels_v.tolist() == [0.0, 1.0, -2.0]
    assert walk.dwell_s == pytest.approx(0.25)


def test_a_slow_wave_whose_samples_stand_still_is_a_wave_where_the_protocol_says_so() -> None:
    u = np.round(100.0 * np.sin(2 * np.pi * 0.5 * T)) / 100.0
    assert isinstance(read(u, "sine"), Wave)


def test_what_is_neither_is_left_out() -> None:
    assert read(np.random.default_rng(1).normal(size=2000)) is None


def test_all_levels_of_a_walk_are_seen_however_long_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    u = np.repeat([-3.0, -2.5, 0.0, 2.5], [400, 300, 500, 600])
    short = read(u, "staircase")
    monkeypatch.setattr(excitation, "LONGEST", 500)
    long = read(u, "staircase")
    assert isinstance(short, Walk)
    assert isinstance(long, Walk)
    assert long.levels_v.tolist() == short.levels_v.tolist() == [-3.0, -2.5, 0.0, 2.5]
    assert long.dwell_s == short.dwell_s == 0.3
