"""Is a rig played block by block the rig of the model, with its noise and its clock?"""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.chain import signals, simulate
from identify.effects import chain_of
from identify.model import Physics
from identify.simulate import SUBSTEPS, Player
from identify.stage import Place
from identify.trace import Trace
from tests.proof.rigs import OP_AMP, RC
from tests.proof.stimuli import FIG13_LEVELS_V, staircase
from tests.trials import model_of, recorded

ROUNDING_V = 1e-11
U = np.repeat(FIG13_LEVELS_V[::3], 500)
PHYSICS = (
    Physics("saturation", {"upper": 10.0, "lower": -9.0}), Physics("dead_time", {"delay": 2.3e-4}),
    Physics("offset_drift", {"rate": 0.3}), Physics("hum", {"amplitude": 0.2}), Physics("plateau_droop", {"rate": 3.0}),
)  # fmt: skip
RIG = model_of(OP_AMP, PHYSICS)
QUIET = replace(RIG, noise_v=None)


@settings(deadline=None, max_examples=25)
@given(st.lists(st.integers(0, 2000), min_size=1, max_size=8), st.sampled_from([0.0, 12.5]))
def test_a_player_answers_what_simulation_answers_however_it_is_asked(sizes, start_s):
    u = np.resize(U, max(sum(sizes), 1))
    sizes = sizes if sum(sizes) else [1]
    player = Player(QUIET, 1e4, start_s=start_s)
    played = np.concatenate([player.play(piece) for piece in np.split(u, np.cumsum(sizes)[:-1])])
    trace = Trace("played", 1e4, u, u, start_s=start_s)
    assert np.allclose(played, simulate(chain_of(QUIET), trace, SUBSTEPS), rtol=0, atol=ROUNDING_V)


def test_a_plain_rig_plays_what_the_independent_integrator_answers():
    trace = recorded(RC, staircase("stairs", FIG13_LEVELS_V[::3], 0.05), fine=128)
    assert np.ptp(trace.y) > 5.0
    assert np.abs(Player(replace(model_of(RC), noise_v=None), 1e4).play(trace.u) - trace.y).max() < 5e-5


def test_equal_seeds_give_equal_noise_and_others_do_not():
    first, again, other = (Player(RIG, 1e4, seed=seed).play(U) for seed in (7, 7, 8))
    assert np.array_equal(first, again)
    assert not np.any(first == other)


def test_noise_is_white_gaussian_of_the_model_s_size():
    noise = Player(RIG, 1e4, seed=3).play(np.resize(U, 20_000)) - Player(QUIET, 1e4).play(np.resize(U, 20_000))
    assert np.std(noise) == pytest.approx(0.010, rel=4.0 / np.sqrt(2 * noise.size))
    assert abs(np.mean(noise)) < 4.0 * 0.010 / np.sqrt(noise.size)
    assert abs(np.corrcoef(noise[1:], noise[:-1])[0, 1]) < 4.0 / np.sqrt(noise.size)


def test_noise_does_not_depend_on_the_cut():
    player = Player(RIG, 1e4, seed=3)
    pieces = np.concatenate([player.play(U[:37]), player.play(U[37:38]), player.play(U[38:])])
    assert np.allclose(pieces, Player(RIG, 1e4, seed=3).play(U), rtol=0, atol=ROUNDING_V)


@pytest.mark.parametrize("piece", PHYSICS, ids=lambda piece: piece.id)
def test_every_piece_of_physics_is_played(piece):
    without = replace(QUIET, physics=tuple(p for p in PHYSICS if p is not piece))
    assert np.abs(Player(QUIET, 1e4).play(U) - Player(without, 1e4).play(U)).max() > 0.01


def test_nothing_played_is_nothing_read():
    assert Player(RIG, 1e4).play(np.empty(0)).size == 0


def test_reading_comes_before_the_update_of_the_same_instant():
    y = Player(replace(model_of(RC), noise_v=None), 1e3).play(np.array([50.0, 50.0, 50.0]))
    assert y[0] == 0.0
    assert y[1] > 1.0


def test_unknown_physics_is_refused():
    with pytest.raises(ValueError, match="no effect 'gremlins' in the catalogue"):
        Player(replace(QUIET, physics=(Physics("gremlins", {"count": 3.0}),)), 1e4)


def test_probes_read_the_signal_before_and_behind_the_gap():
    """What is behind F is what F makes of what is before it, and y is the same with probes and without."""
    player = Player(QUIET, 1e4, probes=("G1", "F"))
    y, v, w = np.concatenate([player.probed(part) for part in np.array_split(U, 3)], axis=1)
    assert np.allclose(y, Player(QUIET, 1e4).play(U), rtol=0, atol=ROUNDING_V)
    traced = Trace("probed", 1e4, U, U)
    chain = chain_of(QUIET)
    taps = signals(chain, traced, SUBSTEPS)
    assert np.allclose(v, taps[chain.index(Place.G1) - 1], rtol=0, atol=ROUNDING_V)
    assert np.allclose(w, taps[chain.index(Place.F) - 1], rtol=0, atol=ROUNDING_V)
    assert np.ptp(v) > 0.1
    assert np.abs(v - w).max() > 0.1
