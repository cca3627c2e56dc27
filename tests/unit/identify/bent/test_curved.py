"""Does a backlash with bent borders play as eq. (7) says, and is it the straight one where its borders are straight?"""

import numpy as np
import pytest

from identify.bent.border import of_points
from identify.bent.curved import CurvedPlay
from identify.chain import f_stage, model_of, plain_chain, simulate
from identify.model import Backlash, CurvedBacklash, Model, Rational
from identify.stage import Block, Grid, Ramp
from identify.trace import Trace

GRID = Grid("run", 1e-4)
BENT = CurvedBacklash(((-1.0, -20.0), (0.5, -5.0), (1.1, -1.0), (3.0, 18.0)), ((-3.0, -18.0), (-1.0, 3.0), (1.0, 15.0)))
STRAIGHT = Backlash(8.0, 1.25, 7.0, -1.0)
AS_POINTS = CurvedBacklash(
    tuple((v, 8.0 * (v - 1.25)) for v in (-2.0, 0.0, 0.4, 3.0)), tuple((v, 7.0 * (v + 1.0)) for v in (-3.0, 1.0))
)


def wandering(count=4000):
    return np.cumsum(np.random.default_rng(3).normal(0.0, 0.12, count)) % 8.0 - 4.0


def played(stage, values, v):
    run, _ = stage.begin(values, GRID, Ramp())
    return np.concatenate([run(Block(part, part, 0, GRID)) for part in np.array_split(v, 7)])


def test_the_compiled_operator_is_eq_7_written_out():
    stage, v, w = CurvedPlay(BENT), wandering(), 0.0
    low, high = of_points(BENT.loading).at(v), of_points(BENT.unloading).at(v)
    expected = np.array([w := min(max(w, a), b) for a, b in zip(low, high, strict=True)])
    assert played(stage, stage.start_values(), v) == pytest.approx(expected, abs=1e-12)


def test_straight_points_are_the_straight_operator():
    stage, straight, v = CurvedPlay(AS_POINTS), f_stage(STRAIGHT), wandering()
    expected = played(straight, straight.start_values(), v)
    assert played(stage, stage.start_values(), v) == pytest.approx(expected, abs=1e-11)


def test_values_and_points_are_two_forms_of_one_thing():
    stage = CurvedPlay(BENT)
    assert len(stage.parameters()) == len(stage.start_values()) == 7
    back = stage.backlash(stage.start_values())
    assert np.array(back.loading) == pytest.approx(np.array(BENT.loading))
    assert np.array(back.unloading) == pytest.approx(np.array(BENT.unloading))
    assert "rise of the unloading border, v = -3 to -1 V" in {p.label for p in stage.parameters()}


def test_a_model_with_bent_borders_becomes_a_chain_and_comes_back():
    bent = Model("bent", Rational((1.0,), (0.02, 1.0)), BENT, Rational((1.0,), (2e-3, 1.0)))
    straight = Model("straight", bent.g1, STRAIGHT, bent.g2)
    points = Model("points", bent.g1, AS_POINTS, bent.g2)
    assert isinstance(model_of(plain_chain(bent), bent).f, CurvedBacklash)
    trace = Trace("run", 1e4, wandering(), np.zeros(4000))
    one, two = (simulate(plain_chain(model), trace, 2) for model in (straight, points))
    assert one == pytest.approx(two, abs=1e-10)
