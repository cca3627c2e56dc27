"""Is what changed said, from the recordings to the sentence: nothing, a value, or physics that appeared?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.chain import simulate
from identify.compared import compare
from identify.compared.sentence import probability
from identify.effects import chain_of
from identify.model import Backlash, Model, Physics, Rational
from identify.trace import Step, Trace

NOISE_V, RATE_HZ = 0.01, 1000.0
MODEL = Model("quick", Rational((1.0,), (0.02, 1.0)), Backlash(2.0, 0.5, 2.0, -0.5), Rational((1.0,), (0.005, 1.0)))
STAIRS = np.repeat([0.0, 1.5, -1.5, 0.7, -1.1, 1.3], 120)
U = np.concatenate([STAIRS, 1.4 * np.sin(2.0 * np.pi * np.arange(1000) / 250)])
STEPS = (Step("stairs", "staircase", 0, STAIRS.size), Step("sine", "sine", STAIRS.size, U.size))
RAIL = Physics("saturation", {"upper": 1.2, "lower": -1.2}, "F", "both")


def day(seed: int, model: Model = MODEL) -> list[Trace]:
    blank = Trace(f"day{seed}", RATE_HZ, U, np.zeros_like(U), steps=STEPS)
    y = simulate(chain_of(model), blank, 8) + np.random.default_rng(seed).normal(0.0, NOISE_V, U.size)
    return [replace(blank, y=y)]


def test_physics_that_appeared_is_named_and_moves_no_value() -> None:
    found = compare(MODEL, day(1), day(2, replace(MODEL, physics=(RAIL,))))
    assert found.verdict == "changed"
    assert [(piece.id, piece.state) for piece in found.physics] == [("saturation", "appeared")]
    assert found.sentence == "Saturation in F appeared: the earlier recording would have shown it, and does not."
    assert [c.name for c in found.changes if c.state == "changed"] == []
    assert found.to_dict()["explained"] == ["consistent", "explained"]


@pytest.mark.parametrize("moved", [0.0, 0.02])
def test_a_value_is_said_to_have_changed_where_it_has(moved: float) -> None:
    rig = replace(MODEL, f=replace(MODEL.f, d_l_v=0.5 + moved))
    found = compare(MODEL, day(3), day(4, rig), physics=False)
    assert found.verdict == ("changed" if moved else "no change seen")
    assert ("F.D_L by +" in found.sentence) == bool(moved)
    assert (found.account is not None and found.account.names[0] == "F.D_L") == bool(moved)
    told = {c.name: c for c in found.changes}
    assert told["F.D_L"].by.low < moved < told["F.D_L"].by.high
    assert {"F.S_L", "F.S_U", "F.D_U", "G1.den.s1", "G2.den.s1", "noise"} <= told.keys()


def test_a_probability_nobody_counts_is_told_by_a_bound() -> None:
    assert (probability(0.032), probability(0.0)) == ("= 0.032", "< 1e-09")
