"""Do the settled points of a staircase know their branch, and the borders through them?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.observe import Observation
from identify.staircase import border, borders, staircase
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP, SKEWED
from tests.proof.stimuli import FIG13_LEVELS_V
from tests.proof.stimuli import staircase as walk
from tests.trials import observed, recorded

NOISE_V = 0.01
SETTLE_S = 0.2


def points(rig=OP_AMP, scale=1.0, physics=(), noise_v=NOISE_V):
    stimulus = walk("walk", tuple(scale * level for level in FIG13_LEVELS_V), 0.25)
    return staircase(observed(recorded(rig, stimulus, physics, noise_v, seed=3, fine=8), noise_v), SETTLE_S)


def test_the_branches_of_fig_13_are_those_the_gap_makes() -> None:
    found = [p.branch for p in points()]
    assert found[0] == "unloading"  # from rest down to -3 V
    assert found[1:5] == ["plateau"] * 4  # -2.5 to -1 V: inside the gap of 2.5 V; -0.5 V just meets the border
    assert found[6:13] == ["loading"] * 7
    assert found[13:17] == ["plateau"] * 4
    assert found[18:] == ["unloading"] * 8


def test_the_means_are_those_of_the_play_operator_within_their_intervals() -> None:
    inside = []
    w = 0.0
    for level, point in zip(FIG13_LEVELS_V, points(), strict=True):
        w = min(max(w, 8.0 * (level - 1.25)), 8.0 * (level + 1.25))
        inside.append(point.mean_v.low <= w <= point.mean_v.high)
        assert point.mean_v.value == pytest.approx(w, abs=6e-3)  # what 0.2 s leave of the step
    assert point.mean_v.high - point.mean_v.low == pytest.approx(2 * 1.96 * NOISE_V / np.sqrt(499), rel=0.01)


def test_the_borders_come_out_of_the_points_on_them_alone() -> None:
    found = borders(points(SKEWED), 1.0, 1.0)
    assert found["F.S_L"] == pytest.approx(7.0, rel=2e-3)
    assert found["F.D_L"] == pytest.approx(1.0, abs=5e-3)
    assert found["F.S_U"] == pytest.approx(8.5, rel=2e-3)
    assert found["F.D_U"] == pytest.approx(-1.3, abs=5e-3)


def test_points_on_a_rail_are_set_apart_and_the_borders_stay() -> None:
    rails = (Concealed("saturation", {"upper": 10.0, "lower": -10.0}),)
    found = points(physics=rails)
    assert sum(p.branch == "saturated" for p in found) >= 14
    assert all(abs(p.mean_v.value) > 9.9 for p in found if p.branch == "saturated")
    lower = border(points(scale=0.6, physics=rails), "loading")
    assert lower is not None
    assert lower.slope == pytest.approx(8.0, rel=2e-3)


def test_gains_around_f_are_taken_out() -> None:
    found = borders(points(), 2.0, 0.5)
    assert found["F.S_L"] == pytest.approx(8.0, rel=2e-3)
    assert found["F.D_L"] == pytest.approx(2.5, rel=5e-3)


@pytest.mark.parametrize(("before", "behind"), [(-1.0, 1.0), (1.0, -1.0), (-2.0, -0.5)])
def test_negative_gains_turn_the_staircase_and_leave_the_borders(before: float, behind: float) -> None:
    rig = replace(SKEWED, g1_num=(1000.0 * before,), g2_num=(1000.0 * behind,), s_l=7.0, d_l_v=1.0 * abs(before))
    stimulus = walk("walk", FIG13_LEVELS_V, 0.25)
    found = staircase(observed(recorded(rig, stimulus, (), NOISE_V, seed=3, fine=8), NOISE_V), SETTLE_S, before)
    assert found[0].branch == ("unloading" if before > 0.0 else "loading")
    assert found[0].level_v == -3.0
    values = borders(found, before, behind)
    assert values["F.S_L"] == pytest.approx(7.0, rel=5e-3)
    assert values["F.D_L"] == pytest.approx(abs(before), abs=1e-2)
    assert values["F.S_U"] == pytest.approx(8.5, rel=5e-3)
    assert values["F.D_U"] == pytest.approx(-1.3, abs=1e-2)
    assert borders(found, before, -behind) == {}


def test_too_few_dwells_are_no_staircase() -> None:
    stimulus = walk("short", (1.0, 2.0, 3.0), 0.25)
    observation = observed(recorded(OP_AMP, stimulus, (), NOISE_V, fine=8), NOISE_V)
    assert staircase(observation, SETTLE_S) == ()
    assert isinstance(observation, Observation)
    assert border((), "loading") is None
    assert borders((), 1.0, 1.0) == {}
