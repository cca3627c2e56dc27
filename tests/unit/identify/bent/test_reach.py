"""Are bent borders of a rig file cut to what the recordings reach, and only then?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.bent.curved import CurvedPlay
from identify.bent.reach import cut, within_reach
from identify.chain import plain_chain
from identify.fit import fit
from identify.identifiability.visits import Range
from identify.joint import identify
from identify.model import CurvedBacklash
from identify.trace import Trace
from tests.benchmarks.bent_borders import NOISE_V, RIG, SHAPES, clean
from tests.trials import model_of, noisy, observed

POINTS = ((-6.0, -50.0), (-1.0, -14.0), (1.0, 0.0), (2.0, 7.0), (9.0, 60.0))


def far(points):
    """Return borders through levels that are only roughly right, with points no run comes near."""
    slopes = ((RIG.s_l, RIG.d_l_v), (RIG.s_u, RIG.d_u_v))
    return CurvedBacklash(*(tuple((v, 1.1 * s * (v - d)) for v in points) for s, d in slopes))


def test_points_beyond_the_stretch_give_way_to_its_ends():
    shortened = cut(POINTS, Range(-0.5, 3.0))
    assert [v for v, _ in shortened] == [-0.5, 1.0, 2.0, 3.0]
    assert np.array(shortened[1:3]) == pytest.approx(np.array(POINTS[2:4]))
    assert np.all(np.diff([w for _, w in shortened]) > 0.0)


def test_points_within_the_stretch_stay_as_they_are():
    assert cut(POINTS, Range(-7.0, 9.5)) == POINTS
    assert cut(POINTS[1:4], Range(-1.05, 2.0)) == POINTS[1:4]


def test_a_rig_file_with_points_too_far_out_is_fitted_where_there_are_data():
    model = replace(model_of(RIG), f=far((-9.0, -2.0, 0.0, 2.0, 8.0)), noise_v=NOISE_V)
    found = identify(model, [noisy(trace, NOISE_V, i) for i, trace in enumerate(clean(SHAPES[1]))])
    for points, (slope, crossing) in (
        (found.bend.curves["L"], (RIG.s_l, RIG.d_l_v)), (found.bend.curves["U"], (RIG.s_u, RIG.d_u_v)),
    ):  # fmt: skip
        assert -4.0 < points[0].v_v < points[-1].v_v < 4.0
        for point in points:
            x, half = point.v_v - crossing, 0.5 * (point.w_v.high - point.w_v.low)
            assert abs(point.w_v.value - x * (slope + 0.05 * x * x)) < 2.5 * half
    assert any("the rig file's points at v = -9" in item.because for item in found.not_identifiable)


@pytest.mark.parametrize("held", ["F", "F.L"])
def test_a_border_that_is_held_or_never_ridden_keeps_its_points(held):
    u = np.concatenate((np.linspace(0.0, 3.0, 500), np.full(500, 3.0)))
    observation = observed(Trace("up only", 1e4, u, np.zeros(u.size)), NOISE_V)
    chain = plain_chain(replace(model_of(RIG), f=far((-9.0, 0.0, 8.0))))
    start = fit(chain, [observation], fixed=("G1", "G2", "F"), iterations=1)
    kept = within_reach(start, [observation], (held, "G1", "G2")).chain.stage_of(CurvedPlay).start
    assert [v for v, _ in kept.unloading] == [-9.0, 0.0, 8.0]
    assert [v for v, _ in kept.loading] == [-9.0, 0.0, 8.0]
