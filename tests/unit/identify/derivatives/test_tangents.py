"""Are the derivatives that run beside the signals those of the simulation, whatever the blocks and the grid?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.chain import plain_chain, simulate
from identify.derivatives import tangents as tangents_module
from identify.derivatives.sensitivities import sensitivities
from identify.derivatives.tangents import tangents
from identify.effects import chain_of
from identify.model import Backlash, LinearF, Model, Physics, Rational
from identify.observe import Observation
from identify.stage import Grid
from identify.trace import Trace

RATE_HZ = 1e4
STEP = 1e-6  # of the central differences, relative
POLES = {
    0: [], 1: [-900.0], 2: [-700 + 900j, -700 - 900j], 3: [-400, -900 + 500j, -900 - 500j],
    4: [-500, -1500, -800 + 1200j, -800 - 1200j],
}  # fmt: skip
PLAY, LINE = Backlash(1.7, 0.4, 1.5, -0.9), LinearF(-2.0, 0.3)
TIME_S = np.arange(1501) / RATE_HZ
SWEEP = 3.0 * np.sin(2.0 * np.pi * (60.0 + 400.0 * TIME_S) * TIME_S) + np.sin(2.0 * np.pi * 37.0 * TIME_S + 1.0)


def block(order, zeros=(), gain=1.0):
    den, num = np.atleast_1d(np.poly(POLES[order])).real, np.atleast_1d(np.poly(zeros)).real
    return Rational(tuple(gain * num / num[-1]), tuple(den / den[-1]))


def chain_with(g1, f, g2, delay_s=0.0, intersample="held"):
    return plain_chain(Model("rig", g1, f, replace(g2, dead_time_s=delay_s)), intersample)


def observed(intersample="held", substeps=1, y=0.0, use=None):
    trace = Trace("run", RATE_HZ, SWEEP, SWEEP * 0.0 + y, intersample)
    return Observation(trace, np.ones(SWEEP.size, dtype=bool) if use is None else use, 1.0, substeps)


def own_sizes(chain):
    return {p.name: abs(chain.values[p.name]) or p.scale for p in chain.parameters()}


def central(chain, name, size, seen):
    above, below = (
        simulate(chain.with_values({name: chain.values[name] + s * STEP * size}), seen.trace, seen.substeps)
        for s in (1.0, -1.0)
    )
    return (above - below) / (2.0 * STEP)


def assert_exact(chain, seen):
    sizes = own_sizes(chain)
    assert tangents(chain, sizes, Grid("run", 1.0 / RATE_HZ)) is not None
    for (name, size), slopes in zip(sizes.items(), sensitivities(chain, sizes, seen).slopes(), strict=True):
        expected = central(chain, name, size, seen)
        assert np.abs(expected).max() > 1e-3, name
        assert np.abs(slopes - expected).max() < 2e-6 * np.abs(expected).max(), name


@pytest.mark.parametrize("substeps", [1, 3, 8])
@pytest.mark.parametrize("intersample", ["held", "linear"])
@pytest.mark.parametrize(
    ("g1", "f", "g2"),
    [
        (block(3, [-2500.0], 0.9), PLAY, block(3)),  # the orders of the paper's simulated rig
        (block(0, gain=0.9), PLAY, block(2, [-3000.0])),
        (block(1), PLAY, block(4, [-3000 + 99j, -3000 - 99j, -4000.0, 5000.0], 1.2)),
        (block(4, [-2500.0, -3000.0, 4000.0]), PLAY, block(1, [-5000.0])),
        (block(2, [-2500.0, -3500.0]), PLAY, block(0, gain=-2.0)),
        (block(2, gain=-0.9), LINE, block(3)),
    ],
    ids=["3 and 3", "0 and 2", "1 and 4", "4 and 1", "2 and 0", "linear F"],
)
@pytest.mark.parametrize("delay_s", [0.0, 3.3e-4])
def test_derivatives_are_those_of_the_simulation(g1, f, g2, delay_s, intersample, substeps):
    assert_exact(chain_with(g1, f, g2, delay_s, intersample), observed(intersample, substeps))


def test_a_rig_with_nothing_but_a_gap_has_the_derivatives_of_its_borders():
    assert_exact(chain_with(block(0), PLAY, block(0)), observed())


@pytest.mark.parametrize(("at_once", "substeps"), [(300, 4), (301, 1), (303, 3)])
def test_cutting_the_run_changes_nothing(at_once, substeps, monkeypatch):
    chain, seen = chain_with(block(3), PLAY, block(3), 3.3e-4), observed(substeps=substeps)
    whole = sensitivities(chain, own_sizes(chain), seen).slopes()
    monkeypatch.setattr(tangents_module, "AT_ONCE", at_once)
    assert np.allclose(sensitivities(chain, own_sizes(chain), seen).slopes(), whole, rtol=0, atol=1e-12)


def test_only_what_is_asked_for_is_returned_in_its_order():
    chain, seen = chain_with(block(2), PLAY, block(2)), observed()
    sizes = own_sizes(chain)
    every = dict(zip(sizes, sensitivities(chain, sizes, seen).slopes(), strict=True))
    for names in (("F.S_U",), ("G2.den.s1", "F.D_U", "G1.den.s2"), ("F.D_L", "F.S_L")):
        some = sensitivities(chain, {name: 2.0 * sizes[name] for name in names}, seen).slopes()
        assert np.allclose(some, [2.0 * every[name] for name in names], rtol=0, atol=1e-12)


def test_residual_and_normal_equations_are_of_the_samples_that_count():
    use = np.random.default_rng(0).random(SWEEP.size) < 0.7
    chain, seen = chain_with(block(2), PLAY, block(2)), observed(y=0.5, use=use)
    found = sensitivities(chain, own_sizes(chain), seen)
    slopes = sensitivities(chain, own_sizes(chain), seen).slopes()
    matrix, right = found.normal()
    assert slopes.shape == (len(own_sizes(chain)), np.count_nonzero(use))
    assert np.allclose(matrix, slopes @ slopes.T, rtol=1e-9)
    assert np.allclose(right, slopes @ seen.used_residual(chain), rtol=1e-9)


def test_nothing_searched_is_nothing_found():
    matrix, right = sensitivities(chain_with(block(2), PLAY, block(2)), {}, observed()).normal()
    assert (matrix.shape, right.shape) == ((0, 0), (0,))


def test_other_chains_are_run_once_more_for_every_number():
    model = Model("rig", block(2), PLAY, block(2), physics=(Physics("feedthrough", {"k": 0.1}),))
    chain, seen = chain_of(model), observed(y=0.5)
    sizes = own_sizes(chain)
    assert tangents(chain, sizes, Grid("run", 1.0 / RATE_HZ)) is None
    for (name, size), slopes in zip(sizes.items(), sensitivities(chain, sizes, seen).slopes(), strict=True):
        expected = central(chain, name, size, seen)
        assert np.abs(slopes - expected).max() < 1e-2 * np.abs(expected).max(), name


@pytest.mark.parametrize("substeps", [2, 8])
def test_on_a_rougher_grid_slopes_are_nearly_the_same_and_residuals_exactly(substeps):
    use = np.random.default_rng(0).random(SWEEP.size) < 0.7
    model = Model("rig", block(2), PLAY, block(2), physics=(Physics("feedthrough", {"k": 0.1}),))
    chain, seen = chain_of(model), observed(y=0.5, use=use, substeps=substeps)
    rough = replace(seen, substeps=1)
    fine, short = (sensitivities(chain, own_sizes(chain), seen, grid) for grid in (seen, rough))
    residuals, rows = zip(*((left.copy(), slopes.copy()) for left, slopes in short.chunks), strict=True)
    assert np.allclose(np.concatenate(residuals), seen.used_residual(chain) / seen.noise_v, rtol=0, atol=1e-12)
    own = sensitivities(chain, own_sizes(chain), rough).slopes()
    assert np.allclose(np.concatenate(rows)[:, short.columns].T, own, rtol=0, atol=1e-9 * np.abs(own).max())
    expected = fine.slopes()
    assert 0.0 < np.abs(own - expected).max() < 0.1 * np.abs(expected).max()


def test_blocks_of_high_order_and_flat_borders_go_the_other_way():
    grid = Grid("run", 1.0 / RATE_HZ)
    fifth = Rational((1.0,), tuple(np.poly([-900.0] * 5) / 900.0**5))
    assert tangents(chain_with(fifth, PLAY, block(1)), {"F.S_L": 1.0}, grid) is None
    assert tangents(chain_with(block(1), Backlash(1.0, 0.5, 0.0, -0.5), block(1)), {"F.S_L": 1.0}, grid) is None


def test_a_leaking_play_is_not_taken_for_a_plain_one():
    """It is a play too, with a value more: its derivatives are differences."""
    model = Model("rig", block(1), PLAY, block(1), physics=(Physics("plateau_droop", {"rate": 2.0}),))
    chain, seen = chain_of(model), observed()
    sizes = own_sizes(chain)
    assert tangents(chain, sizes, Grid("run", 1.0 / RATE_HZ)) is None
    slopes = dict(zip(sizes, sensitivities(chain, sizes, seen).slopes(), strict=True))
    for name in ("F.D_L", "plateau_droop.rate"):
        expected = central(chain, name, sizes[name], seen)
        assert np.abs(slopes[name] - expected).max() < 1e-2 * np.abs(expected).max()
