"""Do the words of a law that chance puts together mean what they say, and does no law do anything where it is zero?"""

import numpy as np
import pytest

from tests.proof import composed
from tests.proof.bench import answer
from tests.proof.cases import Concealed
from tests.proof.composed import BY, COMPOSED, HOW, TAKEN, WHAT
from tests.proof.integrator import Grid
from tests.proof.physics import Scene
from tests.proof.rigs import SKEWED

GRID = Grid(1000.0, 400, 4, start_s=12.0)
T = GRID.run_s
U = np.concatenate([np.zeros(20), 4.0 * np.sin(np.arange(380) / 15.0)])
VALUES = {
    "top": 2.0, "speed": 50.0, "u": 4.0, "w": 20.0, "tau": 0.05, "pole": 0.005, "span": 100.0, "moment": 12.1,
    "frequency": 7.0,
}  # fmt: skip


def scene(**values: float) -> Scene:
    return Scene(GRID, SKEWED, U, {**VALUES, **values}, seed=5)


@pytest.mark.parametrize("what", WHAT)
def test_a_law_of_no_size_does_nothing_and_one_of_some_size_something(what):
    plain = answer(SKEWED, U, GRID)
    for name in (name for name in COMPOSED if name.startswith(f"{what} by ") and name.endswith("straight")):
        assert np.allclose(answer(SKEWED, U, GRID, (Concealed(name, {**VALUES, "k": 0.0}),)), plain, atol=1e-12), name
    moved = [np.ptp(answer(SKEWED, U, GRID, (Concealed(n, {**VALUES, "k": 0.3}),)) - plain)
             for n in COMPOSED if n.startswith(f"{what} by ")]  # fmt: skip
    assert np.isfinite(moved).all()
    assert np.mean(np.array(moved) > 1e-6) > 0.8  # some switch never goes on here


def test_what_the_catalogue_has_is_not_put_together():
    assert all(by in " ".join(COMPOSED) for by in BY)
    assert not TAKEN & set(COMPOSED)
    assert not any(name.startswith(("gain of w by level", "offset of y by size")) for name in COMPOSED)
    assert "gain of u by drive, square" not in COMPOSED  # a map of u is one of the source


def test_a_signal_is_followed_by_what_the_word_says():
    v = np.minimum(10.0 * T, 2.0)  # rises for 0.2 s, then rests
    at = scene()
    assert composed.level(v, at)[-1] == 1.0
    assert composed.speed(v, at)[: T.size // 4].tolist() == pytest.approx([0.2] * (T.size // 4))
    assert composed.clock(v, at)[0] == pytest.approx(0.12)
    assert composed.moment(v, at)[T > 0.1005].tolist() == [1.0] * int(np.sum(T > 0.1005))
    assert composed.load(v, at)[-1] == pytest.approx(1.0, abs=0.05)
    assert composed.history(-v, at)[-1] == pytest.approx(-1.0, abs=0.05)
    assert composed.work(v, at)[T > 0.39].max() < 0.01  # it has rested for long
    assert composed.work(v, at)[0] == pytest.approx(0.0, abs=0.01)  # and before the run
    assert composed.peak(-v, at)[-1] == 1.0


def test_a_turn_is_what_changes_the_way_and_time_counts_from_it():
    v = np.abs(T - 0.2)  # falls to zero at 0.2 s and rises again
    way, rest = composed.way(v, scene()), composed.rest(v, scene())
    assert way[1] == -1.0
    assert way[-1] == 1.0
    assert rest[np.searchsorted(T, 0.25)] == pytest.approx(1.0 - np.exp(-1.0), abs=0.02)


def test_what_is_read_is_stepped_by_samples():
    y = np.ones(GRID.samples)
    assert composed.run(y, scene())[-1] == pytest.approx(1.0 - np.exp(-GRID.sample_s[-1] / 0.25))
    assert composed.drive(y, scene()).tolist() == pytest.approx((U / 4.0).tolist())


def test_shapes_are_about_one_high():
    q = np.linspace(-1.0, 1.0, 101)
    for name, shape in HOW.items():
        assert 0.5 < np.abs(shape(q)).max() <= 1.0, name
