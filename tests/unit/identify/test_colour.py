"""Is coloured noise known for what it is, and are intervals right under it?"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import binom

from identify.colour import WHITE, Colour, colour_of, grains_of, whitening
from identify.joint import identify, observed
from identify.model import Model
from identify.trace import Trace
from tests.proof.bench import answer
from tests.proof.integrator import Grid
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of

NOISE_V = 0.05
MODEL = replace(model_of(RC), noise_v=None)


def noise(size: int, taps: tuple[float, ...], seed: int) -> np.ndarray:
    """Return stationary noise of rms one with this autoregression."""
    long = lfilter([1.0], [1.0, *(-a for a in taps)], np.random.default_rng(seed).normal(size=size + 2000))[2000:]
    impulse = lfilter([1.0], [1.0, *(-a for a in taps)], np.eye(1, 2000)[0])
    return np.asarray(long / np.sqrt(impulse @ impulse))


@pytest.mark.parametrize("taps", [(0.7,), (-0.4,), (1.2, -0.6), (0.05,)])
def test_an_autoregression_is_found_with_its_order(taps):
    found = colour_of([noise(200_000, taps, 1)])
    assert len(found.taps) == len(taps)
    assert found.taps == pytest.approx(taps, abs=0.01)
    white = lfilter([1.0, *(-a for a in found.taps)], [1.0], noise(200_000, taps, 2))
    assert found.gain * np.std(white) == pytest.approx(1.0, abs=0.01)


def test_white_noise_stays_white():
    assert all(colour_of([noise(5000, (), seed)]) == WHITE for seed in range(100))


@pytest.mark.parametrize("slow", ["hum", "drift"])
def test_what_lasts_is_physics_and_no_colour(slow):
    t = np.arange(20_000) / 1e4
    added = 5.0 * np.sin(2.0 * np.pi * 50.0 * t + 1.0) if slow == "hum" else 3.0 * t
    assert colour_of([noise(t.size, (), 4) + added]) == WHITE


def test_the_filter_takes_any_chunks_and_leaves_out_what_has_no_past():
    colour, values = Colour((0.5, -0.2), 1.3), np.random.default_rng(3).normal(size=(50, 3))
    use = np.ones(50, dtype=bool)
    use[[20, 21, 35]] = False
    whole, parts = whitening(colour), whitening(colour)
    expected = whole(values, use)
    edges = [0, 1, 2, 17, 18, 19, 40, 50]
    again = [parts(values[a:b], use[a:b]) for a, b in pairwise(edges)]
    assert np.concatenate(again) == pytest.approx(expected)
    by_hand = np.array([1.3 * (values[k] - 0.5 * values[k - 1] + 0.2 * values[k - 2]) for k in range(2, 50)])
    left_out = [k for k in range(50) if use[k] and (k < 2 or not use[k - 1] or not use[k - 2])]
    at = np.cumsum(use) - 1
    assert not expected[at[left_out]].any()
    kept = [k for k in range(2, 50) if use[k] and k not in left_out]
    assert expected[at[kept]] == pytest.approx(by_hand[np.array(kept) - 2])


PLAYED = (staircase("stairs", FIG13_LEVELS_V[::3], 0.25), sine("sine", 20.0, 5.0, 4, 4))
CLEAN = tuple(answer(RC, s.u, Grid(s.rate_hz, s.u.size, 32)) for s in PLAYED)


def recorded(taps: tuple[float, ...], seed: int) -> list[Trace]:
    both = zip(PLAYED, CLEAN, strict=True)
    return [
        Trace(s.name, s.rate_hz, s.u, y + NOISE_V * noise(y.size, taps, 2 * seed + k)) for k, (s, y) in enumerate(both)
    ]


def test_the_colour_is_told_from_what_repeats():
    grains = grains_of(recorded((0.9,), 1), 0.15)
    assert grains[10_000.0].colour.taps[0] == pytest.approx(0.9, abs=0.05)
    assert grains[10_000.0].rms_v == pytest.approx(NOISE_V, rel=0.15)  # 10 000 readings of which each 20 are one
    assert grains_of(recorded((), 1), 0.15) == {}


REALISATIONS = 12


def test_intervals_under_coloured_noise_hold_the_truth_where_white_ones_do_not():
    """Borders and both time constants: six quantities, 95 % intervals of which each hold the truth 19 times in 20."""
    true = {"G1.den.s1": 0.02, "G2.den.s1": 0.002, "F.S_L": 8.0, "F.D_L": 1.25, "F.S_U": 8.0, "F.D_U": -1.25}
    held, bare = [], []
    for seed in range(REALISATIONS):
        traces = recorded((0.9,), seed)
        found = identify(MODEL, traces)
        told = found.to_dict()["fit"]
        assert told["noise_colour"][0]["autoregression"][0] == pytest.approx(0.9, abs=0.06)
        assert found.noise.rms_v == pytest.approx(NOISE_V, rel=0.15)
        sure = found.certainty
        held.append([sure.interval(n).low <= value <= sure.interval(n).high for n, value in true.items()])
        bare.append(uncorrected(MODEL, traces, true))
    count = REALISATIONS * len(true)
    assert np.sum(held) >= binom.ppf(0.001, count, 0.95)
    assert np.sum(bare) < binom.ppf(0.001, count, 0.95)


def uncorrected(model: Model, traces: list[Trace], true: dict[str, float]) -> list[bool]:
    """Return which truths lie in the intervals of a fit that takes the noise for white."""
    from identify.chain import plain_chain
    from identify.fit import fit

    white = [replace(o, colour=WHITE) for o in observed(model, traces)[0]]
    found = fit(plain_chain(model), white)
    return [low <= true[n] <= high for n in true for low, high in [found.ci95(n)]]
