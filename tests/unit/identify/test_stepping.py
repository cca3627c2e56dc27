"""Is what the samples' grid leaves out put back, against an integrator of its own?"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigvalsh

from identify.chain import plain_chain, simulate
from identify.derivatives.sensitivities import sensitivities
from identify.fit import fit
from identify.model import Backlash, Model, Rational
from identify.observe import Observation
from identify.stepping import corrected, settled, shown
from identify.trace import Trace
from tests.proof.rigs import OP_AMP, RC, toleranced
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, noisy, observed, recorded

STAIRS = recorded(RC, staircase("stairs", FIG13_LEVELS_V[::2], 0.02), fine=128)
FAST = recorded(RC, sine("sine", 500.0, 60.0, 100, 1), fine=128)
CHAIN = plain_chain(model_of(RC))


def seen(trace, noise_v, use=None):
    return Observation(trace, np.ones(trace.size, dtype=bool) if use is None else use, noise_v)


@pytest.mark.parametrize("noise_v", [0.1, 0.01, 0.003])
@pytest.mark.parametrize("trace", [STAIRS, FAST], ids=lambda trace: trace.name)
def test_no_error_is_left_that_a_matched_test_could_see(trace, noise_v):
    assert np.linalg.norm(corrected(seen(trace, noise_v), CHAIN).residual(CHAIN)) / noise_v < 0.15


def test_without_it_the_error_is_seen():
    assert np.linalg.norm(seen(FAST, 0.01).residual(CHAIN)) / 0.01 > 3.0
    assert corrected(seen(FAST, 0.01), CHAIN).left_out is not None


def test_a_grid_that_is_fine_already_is_left_alone():
    assert corrected(seen(STAIRS, 10.0), CHAIN).left_out is None


def test_a_pole_faster_than_a_step_is_met():
    trace = recorded(OP_AMP, staircase("stairs", FIG13_LEVELS_V[::2], 0.02), fine=128)
    chain = plain_chain(model_of(OP_AMP))
    assert np.linalg.norm(seen(trace, 0.01).residual(chain)) / 0.01 > 1.0
    assert np.linalg.norm(corrected(seen(trace, 0.01), chain).residual(chain)) / 0.01 < 0.15


def test_only_samples_that_count_ask_for_it():
    use = np.arange(FAST.size) < 5
    assert corrected(seen(FAST, 0.01, use), CHAIN).left_out is None


def test_it_is_measured_anew_and_not_added_up():
    once = corrected(seen(FAST, 0.01), CHAIN)
    twice = corrected(once, CHAIN)
    assert once.left_out is not None
    assert np.array_equal(once.left_out, twice.left_out)


def test_long_runs_are_walked_in_stretches(monkeypatch):
    whole = corrected(seen(FAST, 0.01), CHAIN)
    monkeypatch.setattr("identify.chain.CHUNK", 640)
    assert np.allclose(corrected(seen(FAST, 0.01), CHAIN).left_out, whole.left_out, rtol=0, atol=1e-3)


def test_a_fit_on_the_samples_grid_is_the_fit_on_a_fine_one():
    trace = noisy(FAST, 0.01, 1)
    start = plain_chain(model_of(toleranced(RC, 5, 0.1)))
    fine = fit(start, [observed(trace, 0.01, 32)])
    coarse = fit(start, [seen(trace, 0.01)])
    (corrected_once_more,), found = settled(coarse, (seen(trace, 0.01),), ())
    assert corrected_once_more.substeps > 1 or corrected_once_more.left_out is not None
    for name in ("G1.den.s1", "F.S_L", "F.D_L", "F.S_U", "F.D_U", "G2.den.s1"):
        assert abs(found.chain.values[name] - fine.chain.values[name]) < 0.03 * fine.sd(name)
        # How many instants rest on the loading border depends on the grid: 1 % between 16 and 32 of them, 4 % at 4.
        assert found.sd(name) == pytest.approx(fine.sd(name), rel=0.06)
    assert max(abs(coarse.chain.values[n] - fine.chain.values[n]) / fine.sd(n) for n in ("F.S_L", "F.D_L")) > 0.3
    assert np.allclose(simulate(found.chain, trace, 32), simulate(fine.chain, trace, 32), rtol=0, atol=1e-3)


def test_slopes_of_a_grid_that_is_too_coarse_are_not_used():
    """A sample a time constant: what is told least well would be told wrong, were only the answer put right."""
    trace = noisy(FAST, 1e-4, 2)
    fine = fit(plain_chain(model_of(RC)), [observed(trace, 1e-4, 32)])
    (finer,), found = settled(fit(CHAIN, [seen(trace, 1e-4)]), (seen(trace, 1e-4),), ())
    assert finer.substeps > 1
    for name in ("G1.den.s1", "G2.den.s1"):
        assert found.sd(name) == pytest.approx(fine.sd(name), rel=0.01)


def information_beside_a_fine_grid(observation, found):
    """Return the extreme ratios of what the grid of an observation tells to what a fine one tells."""
    scales = {c.name: c.slope(float(t)) for c, t in zip(found.coordinates, found.theta, strict=True)}
    own, fine = (
        sensitivities(found.chain, scales, replace(observation, substeps=n)).normal()[0]
        for n in (observation.substeps, 32)
    )
    ratios = eigvalsh(own, fine)
    return float(ratios[0]), float(ratios[-1])


def test_the_grid_of_a_fit_shows_what_its_values_do():
    u = multisine((1, 3, 7, 13, 25, 50), period=320, periods=4)
    trace = Trace("multisine", 2.0, u, np.zeros(u.size))
    g1, g2 = Rational((1.0,), (1.0, 1.5, 0.5)), Rational((1.0,), (2.5, 1.0))
    model = Model("slow", g1, Backlash(2.0, 0.2, 2.0, -0.2), g2)
    coarse = Observation(trace, np.ones(trace.size, dtype=bool), 0.01)
    found = fit(plain_chain(model), [coarse], iterations=0)
    (finer,) = shown(found, (coarse,))
    low, high = information_beside_a_fine_grid(coarse, found)
    assert low < 0.8 or high > 1.2
    low, high = information_beside_a_fine_grid(finer, found)
    assert 0.85 < low <= high < 1.15
    assert shown(found, (finer,))[0].substeps == finer.substeps


def multisine(lines, period, periods):
    turns = 2.0 * np.pi * np.arange(period) / period
    u = sum(0.8 * np.cos(k * turns - np.pi * i * (i + 1) / len(lines)) for i, k in enumerate(lines))
    return np.tile(u, periods)
