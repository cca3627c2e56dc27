"""Do recordings with staircase, sines and a multisine give points of G1 and G2 without their rational form?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.harmonic.measured import MeasuredPoint
from identify.harmonic.nonparametric import scaled
from identify.harmonic.steady import frequency_response
from identify.interval import Interval
from identify.joint import identify
from identify.model import LinearF
from identify.page.rig_pictures import frequency_response as frequency_response_picture
from identify.trace import Step
from tests.proof.rigs import OP_AMP, toleranced
from tests.proof.stimuli import FIG13_LEVELS_V, multisine, sine, staircase
from tests.trials import model_of, recorded

NOISE_V = 0.01
STAIRS = staircase("stairs", FIG13_LEVELS_V[::2], 0.08)
TONES = (sine("low", 10.0, 3.4, 8, 1), sine("lower", 10.0, 2.6, 8, 1), sine("stuck", 62.5, 5.0, 30, 1))
LINES = multisine("lines", 8.0, 2)


def recorded_as(kind, *stimuli):
    traces = [recorded(OP_AMP, s, noise_v=NOISE_V, seed=i, fine=16) for i, s in enumerate(stimuli)]
    return [replace(t, steps=(Step(t.name, kind, 0, t.size),)) for t in traces]


@pytest.fixture(scope="module")
def found():
    traces = [*recorded_as("staircase", STAIRS), *recorded_as("sine", *TONES), *recorded_as("multisine", LINES)]
    return identify(model_of(toleranced(OP_AMP, 3)), traces)


def test_points_lie_about_the_truth(found) -> None:
    model, seen = model_of(OP_AMP), 0
    for points, block in ((found.measured.g1, model.g1), (found.measured.g2, model.g2)):
        for p in points:
            (truth,) = frequency_response(block, [p.frequency_hz])
            if p.gain:
                seen += 1
                assert abs(np.log(p.gain.value / abs(truth))) < 2.3 * np.log(p.gain.high / p.gain.value)
            if p.phase_rad:
                apart = np.angle(np.exp(1j * (p.phase_rad.value - np.angle(truth))))
                assert abs(apart) < 2.3 * (p.phase_rad.high - p.phase_rad.value)
    assert seen >= 11
    assert {p.origin for p in found.measured.g1 if p.gain} == {"harmonics", "multisine"}


def test_what_the_sines_do_not_tell_has_a_reason_and_no_number(found) -> None:
    stuck = next(p for p in found.measured.g1 if p.frequency_hz == pytest.approx(62.5))
    assert (stuck.gain, stuck.phase_rad) == (None, None)
    assert "stuck at U = 5 V" in stuck.because
    told = found.to_dict()["G1"]["measured"]
    assert {"frequency_hz", "gain", "phase_rad", "from"} <= told[0].keys()
    assert next(p for p in told if p["gain"] is None)["because"]


def test_points_are_drawn_over_the_curve(found) -> None:
    picture = frequency_response_picture(found)
    assert picture is not None
    assert "Squares are measured" in picture.caption


def test_sines_alone_do_not_tell_the_borders_apart_from_the_blocks() -> None:
    alone = identify(model_of(OP_AMP), recorded_as("sine", *TONES[:2]))
    assert [p.gain for p in alone.measured.g1] == [None]
    assert "a staircase would tell them" in alone.measured.g1[0].because
    assert alone.measured.g2 == ()


def test_a_rig_without_backlash_has_no_such_points() -> None:
    linear = replace(model_of(OP_AMP), f=LinearF(8.0, 0.0))
    assert identify(linear, recorded_as("staircase", STAIRS)).measured.g1 == ()


def test_scale_divides_gains_and_adds_its_doubt() -> None:
    point = MeasuredPoint(1.0, Interval(2.0, 1.9, 2.0 / 0.95), Interval(0.5, 0.4, 0.6), "harmonics")
    assert scaled(point, Interval(4.0, 4.0, 4.0)).gain.value == 0.5
    turned = scaled(point, Interval(-4.0, -4.4, -4.0 / 1.1))
    assert turned.gain.value == 0.5
    assert np.log(turned.gain.high / 0.5) == pytest.approx(np.hypot(np.log(1.0 / 0.95), np.log(1.1)))
    assert turned.phase_rad.value == pytest.approx(0.5 - np.pi)
    assert scaled(replace(point, gain=None), Interval(4.0, 4.0, 4.0)).gain is None
