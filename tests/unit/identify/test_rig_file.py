"""Is it told which values of the rig file the recordings say are others, and how far a simulation with them is off?"""

from dataclasses import replace

import pytest

from identify.explain.explain import explain
from identify.explain.explanation import Explanation
from identify.model import Model
from identify.trace import Trace
from tests.proof.cases import Concealed
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, recorded

NOISE_V = 0.01
STAIRS, SINE = staircase("stairs", FIG13_LEVELS_V, 0.05, 1), sine("sine", 10.0, 3.4, 10, 1)


@pytest.fixture(scope="module")
def traces() -> list[Trace]:
    return [recorded(RC, stimulus, (), NOISE_V, i, 3.0 * i) for i, stimulus in enumerate((STAIRS, SINE))]


def told(model: Model, traces: list[Trace]) -> Explanation:
    answer = explain(model, traces[:1], traces[1:])
    assert answer.verdict == "consistent"
    return answer


def test_a_rig_file_that_is_right_is_agreed_with(traces: list[Trace]) -> None:
    answer = told(model_of(RC), traces)
    assert answer.sentence == "Simulation and recordings agree to the noise: nothing is missing from the model."
    assert answer.rig_file.rms_v == pytest.approx(NOISE_V, rel=0.03)


@pytest.mark.parametrize("gain", [1000.0, 10.0, 0.1, -1.0])
def test_slopes_of_another_size_or_sign_are_told(traces: list[Trace], gain: float) -> None:
    """Millivolts, an attenuator, an amplifier that inverts: nothing is missing, and the rig file is wrong."""
    answer = told(model_of(RC), [replace(t, y=gain * t.y) for t in traces])
    found = {value.name: value for value in answer.rig_file.moved}
    for name in ("S_L", "S_U"):
        assert (found[name].rig_file, found[name].fitted.value) == (8.0, pytest.approx(8.0 * gain, rel=0.01))
        assert found[name].fitted.low < found[name].fitted.value < found[name].fitted.high
    assert (set(found) >= {"D_L", "D_U"}) == (gain < 0.0)  # where w goes down as v goes up the borders change sides
    assert "agree to the noise once its values are fitted: nothing is missing" in answer.sentence
    assert f"farthest off: {answer.rig_file.moved[0].name} is " in answer.sentence
    assert answer.rig_file.rms_v > 100.0 * NOISE_V * abs(gain)


def test_a_clock_that_runs_twice_as_fast_is_told_by_the_lags(traces: list[Trace]) -> None:
    answer = told(model_of(RC), [replace(t, rate_hz=2.0 * t.rate_hz, steps=()) for t in traces])
    found = {value.name: value.fitted.value / value.rig_file for value in answer.rig_file.moved}
    assert found["G1.den.s1"] == pytest.approx(0.5, rel=0.01)
    assert found["G2.den.s1"] == pytest.approx(0.5, rel=0.01)


def test_values_are_told_beside_physics_that_is_missing(traces: list[Trace]) -> None:
    model = model_of(replace(RC, d_l_v=1.4))
    physics = (Concealed("dead_time", {"delay": 1e-3}),)
    late = [recorded(RC, stimulus, physics, NOISE_V, i) for i, stimulus in enumerate((STAIRS, SINE))]
    answer = explain(model, late[:1], late[1:])
    assert [effect.id for effect in answer.effects] == ["dead_time"]
    said = answer.to_dict()["rig_file"]
    assert isinstance(said, dict)
    (first, *_) = said["values"]
    assert (first["name"], first["unit"], first["rig_file"]) == ("D_L", "V", 1.4)
    low, high = first["ci95"]
    assert low < 1.25 < high
    assert said["over_noise"] == pytest.approx(said["rms"] / answer.noise.rms_v, rel=1e-3)


def test_what_the_rig_file_holds_fixed_is_no_value_of_the_recordings(traces: list[Trace]) -> None:
    model = replace(model_of(RC), fixed=("G1",))
    assert not [value for value in told(model, traces).rig_file.moved if value.name.startswith("G1")]
