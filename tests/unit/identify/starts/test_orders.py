"""Are values found where a rig file gives orders alone, with a staircase and without, and is the sign of G2 told?"""

from dataclasses import replace

import pytest

from identify.chain import plain_chain
from identify.joint import identify
from identify.model import Backlash, LinearF, Model, Rational
from identify.starts.orders import valued
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, recorded

NOISE_V = 0.02
STAIRS = staircase("stairs", FIG13_LEVELS_V, 0.08)
SINES = (sine("sine_31hz", 31.25, 8.0, 10, 2), sine("sine_10hz", 10.0, 3.4, 3, 2))
NOTHING = Model(
    "", Rational((1.0,), (1.0, 1.0)), Backlash(1.0, 1.0, 1.0, -1.0), Rational((1.0,), (1.0, 1.0)),
    unknown=("G1", "F", "G2", "G2.gain"),
)  # fmt: skip
UPSIDE_DOWN = replace(RC, g2_num=(-1000.0,))


def traces(rig, stimuli):
    return [recorded(rig, stimulus, noise_v=NOISE_V, seed=7, fine=8) for stimulus in stimuli]


@pytest.mark.parametrize(("rig", "stimuli", "sign"), [
    (RC, (STAIRS, SINES[0]), 1.0),
    (RC, SINES, 1.0),
    (UPSIDE_DOWN, (STAIRS, SINES[0]), -1.0),
])  # fmt: skip
def test_orders_alone_lead_to_the_rig(rig, stimuli, sign):
    found = identify(NOTHING, traces(rig, stimuli))
    assert found.fit.converged
    assert found.rms_v == pytest.approx(NOISE_V, rel=0.05)
    assert found.model.g2.dc_gain == sign
    truth = {"S_L": 8.0, "D_L": 1.25, "S_U": 8.0, "D_U": -1.25}
    for name, interval in found.own_scale.items():
        assert abs(interval.value - truth[name]) < 2.0 * (interval.high - interval.low), name
    assert found.fit.chain.values["G1.den.s1"] == pytest.approx(0.02, rel=0.02)
    assert found.model.unknown == ()


def test_what_the_file_gives_is_kept_as_a_start():
    known = replace(model_of(RC), f=NOTHING.f, unknown=("F",))
    found = valued(known, traces(RC, (STAIRS,)))
    assert found.f.d_l_v == pytest.approx(1.25, rel=0.05)
    assert found.g1.den[0] / found.g1.den[1] == pytest.approx(0.02, rel=0.05)
    assert valued(model_of(RC), []) == model_of(RC)


def test_a_linear_rig_needs_no_borders():
    linear = replace(NOTHING, f=LinearF(), unknown=("G1", "G2"))
    silent = replace(RC, d_l_v=0.0, d_u_v=0.0)
    found = identify(linear, traces(silent, SINES))
    assert found.rms_v == pytest.approx(NOISE_V, rel=0.05)
    assert found.model.f.gain == pytest.approx(8.0, rel=0.01)


def test_a_model_without_values_is_not_simulated():
    with pytest.raises(ValueError, match="G1 has no values"):
        plain_chain(NOTHING)
