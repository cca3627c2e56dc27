"""Do scipy's linear systems and python-control's backlash answer as our blocks and our simulation, to 1e-6?

The describing function of python-control is held against our harmonics in tests/unit/identify/test_harmonics.py.
"""

import control
import numpy as np
import pytest
from scipy import signal

from identify.chain import plain_chain, signals, simulate
from identify.harmonic.steady import frequency_response
from identify.model import Backlash, LinearF, Model, Rational
from identify.trace import Trace

RATE_HZ = 2000.0
LAG = Rational((1000.0,), (1e-4, 20.0, 1000.0))
RINGING = Rational((2.0e4,), (1.0, 40.0, 2.0e4))
WITH_ZERO = Rational((3.0, 500.0), (0.01, 4.0, 500.0))
THIRD = Rational((8e4,), (1.0, 160.0, 6.8e3, 8e4))
BLOCKS = pytest.mark.parametrize("block", [LAG, RINGING, WITH_ZERO, THIRD], ids=["lag", "ringing", "zero", "third"])
ONE = Rational((1.0,), (1.0,))
PEERS = 1e-6  # of the largest value


def played(size: int = 600) -> np.ndarray:
    """Return levels that walk about, held for 7 samples each."""
    return np.repeat(np.random.default_rng(1).normal(0.0, 2.0, size // 7 + 1), 7)[:size]


def peer(block: Rational) -> signal.lti:
    return signal.lti(block.num, block.den)


def response_of(block: Rational, u: np.ndarray, straight: bool) -> np.ndarray:
    """Return scipy's answer at the instants of u, which is held between them, or straight."""
    return signal.lsim(peer(block), u, np.arange(u.size) / RATE_HZ, interp=straight)[1]


def ours(model: Model, u: np.ndarray, intersample: str = "held") -> Trace:
    return Trace("peer", RATE_HZ, u, np.zeros(u.size), intersample)


def same(one, other) -> None:
    assert one == pytest.approx(other, abs=PEERS * float(np.max(np.abs(other))))


@BLOCKS
def test_frequency_response(block) -> None:
    f = np.geomspace(0.1, 900.0, 50)
    same(frequency_response(block, f), peer(block).freqresp(2.0 * np.pi * f)[1])


@BLOCKS
def test_step_response(block) -> None:
    model = Model("peer", block, LinearF(), ONE)
    at = np.arange(400) / RATE_HZ
    same(simulate(plain_chain(model), ours(model, np.ones(400))), signal.step(peer(block), T=at)[1])


@BLOCKS
def test_levels_held_between_samples(block) -> None:
    model = Model("peer", block, LinearF(), ONE)
    same(simulate(plain_chain(model), ours(model, played())), response_of(block, played(), straight=False))


@BLOCKS
def test_straight_lines_between_samples(block) -> None:
    """At rest before the first sample: scipy begins there too."""
    model, u = Model("peer", block, LinearF(), ONE), np.concatenate(([0.0], np.cumsum(played())))
    found = simulate(plain_chain(model, "linear"), ours(model, u, "linear"))
    same(found, response_of(block, u, straight=True))


def test_play_operator() -> None:
    """Theirs has slope 1 and as much gap as its argument; it moves one value at a time."""
    theirs, v = control.friction_backlash_nonlinearity(1.4), np.cumsum(np.random.default_rng(2).normal(0.0, 0.3, 500))
    model = Model("peer", ONE, Backlash(1.0, 0.7, 1.0, -0.7), ONE)
    found = signals(plain_chain(model, "linear"), ours(model, v, "linear"))
    same(found[2], np.array([theirs(x) for x in v]))


@BLOCKS
def test_whole_signal_path(block) -> None:
    """G1 of scipy, backlash of python-control, G2 of scipy, one after the other on the samples; ours in one loop."""
    model = Model("peer", LAG, Backlash(8.0, 1.25, 8.0, -1.25), block)
    theirs = control.friction_backlash_nonlinearity(2.5)
    u = 2.0 * played()
    w = 8.0 * np.array([theirs(v) for v in response_of(LAG, u, straight=False)])
    same(simulate(plain_chain(model), ours(model, u)), response_of(block, w, straight=True))
