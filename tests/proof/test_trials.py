"""Does the explainer find what an integrator it shares no code with has concealed, and stay silent where it must?

The thresholds of the explainer were chosen with these cases in sight; ``python -m tests.proof`` draws others.
"""

from dataclasses import dataclass

import pytest

from identify.explain import Explanation, explain
from identify.trace import Step, Trace
from tests.proof.bench import Run, record
from tests.proof.cases import CLEAN, IN_RED_NOISE, LIBRARY, OUTSIDE, PAIRS, Case, Concealed
from tests.proof.rigs import Rig
from tests.proof.stimuli import FIG13_LEVELS_V, HELD_OUT_LEVELS_V, Stimulus, multisine, sine, staircase
from tests.trials import model_of

SURE = 4.0  # standard deviations: of some thirty parameters none should be further off
TOLD_ELSEWHERE = {  # the contract of effects tries them, too, and python -m tests.proof draws others like them
    "dac_quantisation",
    "source_pole", "source_nonlinearity", "input_ac_coupling", "input_clipping", "resonance, G1", "resonance, G2",
    "clock_skew, fast ADC", "clock_skew, slow ADC", "slew_limit", "absorption", "absorption on plateaus",
    "diode_contact", "rate_dependent_gap", "process_noise", "adc_quantisation", "soft_saturation, upper", "soft_knee",
    "plateau_tilt", "plateau_droop, bias current", "extra_pole, G2", "offset_drift", "rectifying_sensor", "ac_coupling",
    "second_play", "soft_saturation", "curved_border", "gain_drift", "hum, G1", "unequal_slopes", "diode_clamp",
    "dead_time", "adc_nonlinearity", "self_heating, F", "capacitor_nonlinearity, G1", "capacitor_nonlinearity, G2",
    "hum, sense", "feedthrough",
    "saturation",  # the demo and its flow tests tell it, and a circuit of op-amps
    "plateau_droop, leak across", "hum, F",  # of each another form or place is in a pair or a circuit
    "plateau_droop, leak",  # a real resistor across a real capacitor is in tests/proof/circuit
}
TWINS = {"extra_pole, G1": ("source_pole", "source")}  # the same law before F: no recording tells one from the other
TOLD = [case for case in LIBRARY if case.name not in {*TOLD_ELSEWHERE, *TWINS}]
PLACED = {"crosstalk": "sense"}
WALK, TONE = staircase("staircase", FIG13_LEVELS_V, 0.05), sine("sine_10hz_3.4v", 10.0, 3.4, 2, 2)
ENOUGH = {  # what tells all of it, where less than what is played to the others does: they take as long again
    "crosstalk": (WALK, TONE),
    "saturation": (staircase("staircase", FIG13_LEVELS_V, 0.08), sine("sine_31hz_8v", 31.25, 8.0, 5, 4)),
    "saturation and hum": (WALK, sine("sine_50hz_9.5v", 50.0, 9.5, 5, 4)),
    "backlash": (WALK, TONE),
    "self_heating, G1": (WALK, TONE),
    "adc_clipping": (WALK, TONE),
    "adc_averaging": (WALK, TONE),
    "extra_pole, G1": (WALK, sine("sine_31hz_8v", 31.25, 8.0, 5, 4)),
}
KEPT_BACK = multisine("multisine", 5.6, 1), staircase("staircase_other", HELD_OUT_LEVELS_V, 0.05)


@dataclass(frozen=True)
class Shorter:
    """A case to which no more is played than tells all of it."""

    rig: Rig
    physics: tuple[Concealed, ...]
    training: tuple[Stimulus, ...]
    held_out: tuple[Stimulus, ...]
    seed: int


def trace_of(run: Run) -> Trace:
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in run.steps)
    return Trace(run.name, run.rate_hz, run.u, run.y, start_s=run.start_s, steps=steps)


def told(case: Case, *leave_out: str, kept_back: tuple[Stimulus, ...] = KEPT_BACK) -> Explanation:
    enough = ENOUGH.get(case.name)
    runs = record(Shorter(case.rig, case.physics, enough, kept_back, case.seed) if enough else case)
    train, test = ([trace_of(run) for run in runs if run.held_out is held] for held in (False, True))
    return explain(model_of(case.nominal), train, test, leave_out=leave_out)


def name(case: Case) -> str:
    return case.name


@pytest.mark.parametrize("case", CLEAN, ids=name)
def test_a_clean_rig_is_consistent(case: Case) -> None:
    found = told(case)
    assert (found.verdict, found.location, found.effects) == ("consistent", None, ())
    assert found.held_out.residuals.after_v <= 1.02 * found.noise.rms_v


@pytest.mark.parametrize("case", [*TOLD, *PAIRS], ids=name)
def test_concealed_physics_is_named_placed_measured_and_proven(case: Case) -> None:
    found = told(case)
    named_placed_and_measured(found, case)
    held = found.held_out.residuals
    assert held.after_v <= 1.1 * found.noise.rms_v < held.before_v


def named_placed_and_measured(found: Explanation, case: Case) -> None:
    assert found.verdict == "explained"
    assert sorted((f.id, f.stage) for f in found.effects) == sorted((f.id, f.stage) for f in case.expected)
    assert found.location is not None
    assert found.location.stage in {f.stage for f in case.expected}
    values = {f.id: f.parameters for f in found.effects}
    for truth in case.expected:
        for parameter, value in truth.parameters.items():
            interval = values[truth.id][parameter][0]
            sd = (interval.high - interval.low) / (2 * 1.96)
            assert abs(interval.value - value) < SURE * sd, (truth.id, parameter, value, interval)


def test_physics_is_found_in_red_noise_beside_which_nobody_sees_it() -> None:
    """It moves the readings less than the noise wanders; no law of the clock is made of that."""
    found = told(IN_RED_NOISE)
    named_placed_and_measured(found, IN_RED_NOISE)
    held = found.held_out.residuals
    assert max(held.after_v, held.before_v) <= 1.1 * found.noise.rms_v


@pytest.mark.parametrize("case", [case for case in LIBRARY if case.name in TWINS], ids=name)
def test_two_names_for_the_same_law_are_told_together_and_as_likely(case: Case) -> None:
    found = told(case)
    assert found.verdict == "explained"
    (finding,), (truth,) = found.effects, case.expected
    odds = {(finding.id, finding.stage): finding.probability}
    odds |= {(other.id, other.stage): other.probability for other in finding.could_also_be}
    assert odds[truth.id, truth.stage] == pytest.approx(odds[TWINS[case.name]], rel=0.02)
    assert sum(odds.values()) <= 1.0
    for parameter, value in truth.parameters.items():
        interval = finding.parameters[parameter][0]
        assert abs(interval.value - value) < SURE * (interval.high - interval.low) / (2 * 1.96)


@pytest.mark.parametrize("case", OUTSIDE, ids=name)
def test_physics_outside_the_library_is_proven_and_located_but_not_named(case: Case) -> None:
    found = told(case)
    assert found.verdict == "unexplained"
    assert found.p_value < 1e-6
    assert found.location is not None
    assert found.remaining.stage == found.location.stage
    assert [(f.id, f.stage) for f in found.effects] == [("unnamed", PLACED[case.name])]


def test_without_its_effect_in_the_catalogue_physics_ends_unnamed() -> None:
    (case,) = (c for c in LIBRARY if c.name == "saturation")
    (truth,) = case.expected
    found = told(case, truth.id, kept_back=case.held_out)
    assert found.verdict == "unexplained"
    assert [(f.id, f.stage) for f in found.effects] == [("unnamed", truth.stage)]
    assert found.location is not None
    assert (found.location.stage, found.location.alternatives) == (truth.stage, ("G1",))  # where v ends as high
    held = found.held_out.residuals
    assert held.after_v <= 1.1 * found.noise.rms_v < held.before_v  # corners at the levels of the rails are all of it
