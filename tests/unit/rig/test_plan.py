"""Are the samples of a plan exactly those asked for, and is what must not be played refused at its line?"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.trace import Step
from rig.errors import RefusedError
from rig.plan import Plan, plan, whole_rate_hz
from rig.protocol import Limits, parse_protocol

HEAD = """\
spec: 1
title: a test
question: does it move?
limits: {level: 10 V}
acquisition: {rate: 10 kHz}
"""


def planned(steps: str, head: str = HEAD, rate_hz: float | None = None) -> Plan:
    return plan(parse_protocol(f"{head}steps:\n{steps}", "p.yaml"), rate_hz)


def refused(steps: str, head: str = HEAD) -> str:
    with pytest.raises(RefusedError) as caught:
        planned(steps, head)
    assert caught.value.exit_code == 1
    return str(caught.value)


def test_steps_follow_each_other_and_repeats_are_numbered() -> None:
    made = planned("  - {label: a, repeats: 2, hold: {level: 1 V, time: 1 ms}}\n  - hold: {level: 2 V, time: 2 ms}\n",
                   HEAD + "repeats: 2\n")
    assert made.steps == (
        Step("a", "hold", 0, 10, 0), Step("a", "hold", 10, 20, 1),
        Step("hold 2 V for 0.002 s", "hold", 20, 40, 0),
        Step("a", "hold", 40, 50, 2), Step("a", "hold", 50, 60, 3),
        Step("hold 2 V for 0.002 s", "hold", 60, 80, 1),
    )
    assert made.u.tolist() == [1.0] * 20 + [2.0] * 20 + [1.0] * 20 + [2.0] * 20


def test_the_samples_cannot_be_changed_after_the_check() -> None:
    made = planned("  - hold: {level: 1 V, time: 1 ms}\n")
    with pytest.raises(ValueError, match="read-only"):
        made.u[0] = 99.0


def test_what_an_operator_wants_to_know_before() -> None:
    made = planned("  - staircase: {levels: [1 V, -3 V], dwell: 500 ms}\n")
    assert (made.duration_s, made.peak_v, made.slew_v_per_s) == (1.0, 3.0, pytest.approx(4.0e4))
    assert made.memory_bytes == 170_000
    assert made.disk_bytes > 2 * made.memory_bytes


def test_levels_are_written_out_from_ranges_and_scaled() -> None:
    made = planned("  - staircase: {levels: [{from: -1 V, to: 1 V, step: 500 mV}, 3 V], dwell: 100 us, scale: 0.5}\n")
    assert made.u.tolist() == [-0.5, -0.25, 0.0, 0.25, 0.5, 1.5]


def test_a_dwell_waits_for_the_rig_to_settle() -> None:
    head = HEAD + "rig: rigs/paper_simulation.yaml\n"
    head = head.replace("10 kHz", "10 Hz")
    made = planned("  - staircase: {levels: [1 V, 2 V], dwell: {settle: 0.1 %, hold: 10 s}}\n", head)
    assert made.steps[0].stop == 2 * 578
    assert "settles to 0.001 of a step in 47.82 s" in made.notes[0]


@pytest.mark.parametrize(("stimulus", "samples"), [
    ("sine: {frequency: 50 Hz, amplitude: 1 V, periods: 3}", 600),
    ("triangle: {frequency: 50 Hz, amplitude: 1 V, periods: 3}", 600),
    ("multisine: {frequencies: [10 Hz, 30 Hz], peak: 5 V, time: 200 ms}", 2000),
    ("multisine: {frequencies: [10 Hz, 30 Hz], amplitude: 1 V, phases: zero, periods: 2}", 2000),
    ("minor_loops: {amplitudes: [2 V, 1 V], slope: 100 V/s, loops: 2}", 2400),
    ("table: {times: [0 s, 10 ms, 30 ms], levels: [0 V, 1 V, 2 V], between: linear}", 300),
    ("hold: {level: 1 V, time: 25 ms}", 250),
])
def test_every_stimulus_has_its_length(stimulus: str, samples: int) -> None:
    made = planned(f"  - {stimulus}\n")
    assert made.u.size == samples
    assert made.notes == ()


def test_a_multisine_reaches_its_peak() -> None:
    assert planned("  - multisine: {frequencies: [10 Hz, 30 Hz], peak: 5 V, time: 1 s}\n").peak_v == pytest.approx(5.0)


def test_a_table_may_stand_in_a_file(tmp_path: object) -> None:
    folder = str(tmp_path)
    with open(f"{folder}/drive.csv", "w", encoding="utf-8") as file:
        file.write("t,level\n0,1\n0.001,-1\n0.002,-1\n")
    text = f"{HEAD}steps:\n  - table: {{file: {{path: drive.csv, time: t, level: level}}}}\n"
    assert plan(parse_protocol(text, f"{folder}/p.yaml")).u.tolist() == [1.0] * 10 + [-1.0] * 10


def test_periods_that_do_not_fit_are_told_with_a_rate_that_fits() -> None:
    made = planned("  - sine: {frequency: 31 Hz, amplitude: 1 V, periods: 10}\n")
    assert made.notes == (
        "sine 31 Hz 1 V: its whole periods take 3225.81 samples, 3226 are played",
        "acquisition.rate 10000.6 Hz samples every period exactly",
    )
    assert planned("  - sine: {frequency: 31 Hz, amplitude: 1 V, periods: 10}\n", rate_hz=10000.6).notes == ()


def test_lines_that_do_not_fit_the_time_of_a_multisine_are_told() -> None:
    made = planned("  - multisine: {frequencies: [10 Hz, 30.5 Hz], peak: 5 V, time: 1 s}\n")
    assert made.notes == ("multisine of 2 lines, 10 to 30.5 Hz: 30.5 Hz makes 30.5 periods, not a whole number",)


@settings(deadline=None)
@given(st.lists(st.tuples(st.integers(1, 400), st.integers(1, 50)), min_size=1, max_size=3), st.floats(2e3, 1e5))
def test_a_proposed_rate_makes_every_time_whole(sines: list[tuple[int, int]], near_hz: float) -> None:
    timed = [(float(frequency), periods / frequency) for frequency, periods in sines]
    rate = whole_rate_hz(timed, near_hz)
    if rate is None:
        return
    assert near_hz / 2 < rate < 2 * near_hz
    for _, time in timed:
        assert time * rate == pytest.approx(round(time * rate), rel=1e-9)


def test_no_rate_is_proposed_where_none_can_fit() -> None:
    assert whole_rate_hz([], 1e4) is None
    assert whole_rate_hz([(10.0, 0.1), (np.sqrt(2) * 10, 0.1 / np.sqrt(2))], 1e4) is None
    assert whole_rate_hz([(10.5, 1.0)], 1e4) is None


@pytest.mark.parametrize(("steps", "message"), [
    ("  - sine: {frequency: 50 Hz, amplitude: 12 V, periods: 4}\n",
     "p.yaml:7: steps[0].sine: a level of 'sine 50 Hz 12 V' is over the limit: 12 V; allowed: -10 to 10 V; lower the"),
    ("  - hold: {level: 1 V, time: 1 s}\n  - staircase: {levels: [1 V, -11 V], dwell: 1 s}\n",
     "p.yaml:8: steps[1].staircase: a level of 'staircase of 2 levels, -11 to 1 V' is over the limit: -11 V"),
    ("  - sine: {frequency: 5 kHz, amplitude: 1 V, periods: 4}\n",
     "p.yaml:7: steps[0].sine: frequency above Nyquist: 5000 Hz; allowed: below 5000 Hz, half of acquisition.rate"),
    ("  - multisine: {frequencies: [1 Hz, 9 kHz], peak: 1 V, time: 1 s}\n",
     "steps[0].multisine: frequency above Nyquist"),
    ("  - triangle: {frequency: 6 kHz, amplitude: 1 V, periods: 4}\n", "steps[0].triangle: frequency above Nyquist"),
    ("  - hold: {level: 1 V, time: 10 us}\n",
     "p.yaml:7: steps[0].hold: the hold is shorter than a sample: 1e-05 s; allowed: at least 0.0001 s at 10000 Hz"),
    ("  - hold: {level: 1 V, time: 30 h}\n",
     "p.yaml:7: steps[0].hold: the hold is too long: 108000 s; allowed: up to 100000 s (1000000000 samples)"),
    ("  - staircase: {levels: [1 V], dwell: 1e30 s}\n", "the staircase is too long"),
    ("  - repeats: 6\n    hold: {level: 1 V, time: 20000 s}\n",
     "p.yaml:8: steps[0].hold: the protocol is too long: 120000 s up to here"),
    ("  - staircase: {levels: [1 V], dwell: {settle: 1 %}}\n",
     "p.yaml:7: steps[0].staircase: a dwell that waits for settling needs a rig; name one under 'rig:'"),
    ("  - {label: a, hold: {level: 1 V, time: 1 s}}\n  - {label: a, hold: {level: 2 V, time: 1 s}}\n",
     "p.yaml:8: steps[1].hold: two different steps have one label: 'a'"),
    ("  - table: {times: [0 s, 1 s, 1 s], levels: [0 V, 1 V, 2 V]}\n", "the times of a table start at 0 s and ascend"),
    ("  - table: {times: [0 s, 1 s], levels: [0 V]}\n", "times and levels do not pair up: 2 and 1"),
])
def test_what_must_not_be_played_is_refused_at_its_line(steps: str, message: str) -> None:
    assert message in refused(steps)


def test_the_safe_level_is_held_to_the_limits_too() -> None:
    text = refused("  - hold: {level: 1 V, time: 1 s}\n", HEAD + "safe_level: 11 V\n")
    assert "p.yaml:6: safe_level: the safe level is over the limit: 11 V" in text


@pytest.mark.parametrize(("steps", "blamed"), [
    ("  - hold: {level: 1 V, time: 1 ms}\n", "p.yaml:7: steps[0].hold: too steep: 10000 V/s, first at 0 s"),
    ("  - triangle: {frequency: 10 Hz, amplitude: 2 V, periods: 1}\n  - hold: {level: 1 V, time: 1 ms}\n",
     "p.yaml:8: steps[1].hold: too steep"),
    ("  - triangle: {frequency: 10 Hz, amplitude: 3 V, periods: 1}\n", "steps[0].triangle: too steep: 120 V/s"),
])
def test_a_slope_beyond_the_slew_limit_is_refused_the_jump_into_a_step_included(steps: str, blamed: str) -> None:
    head = HEAD.replace("{level: 10 V}", "{level: 10 V, slew: 100 V/s}")
    assert blamed in refused(steps, head)


def test_a_ramp_to_the_safe_level_beyond_the_slew_limit_is_refused() -> None:
    head = HEAD.replace("{level: 10 V}", "{level: 10 V, slew: 100 V/s}")
    steps = "  - triangle: {frequency: 10 Hz, amplitude: 2 V, periods: 1}\n"
    text = refused(steps, head + "ramp: 10 ms\n")
    assert text == ("p.yaml:6: ramp: the ramp to the safe level is too steep: 2 V in 0.01 s; "
                    "allowed: at most 100 V/s (limits.slew); write 'ramp: 0.02 s' or longer")
    assert planned(steps, head + "ramp: 20 ms\n").ramp_s == 0.02


def test_a_slope_within_the_slew_limit_is_played() -> None:
    head = HEAD.replace("{level: 10 V}", "{level: 10 V, slew: 100 V/s}")
    made = planned("  - triangle: {frequency: 10 Hz, amplitude: 2.5 V, periods: 2}\n", head)
    assert made.slew_v_per_s == pytest.approx(100.0)
    assert made.limits == Limits(-10.0, 10.0, 100.0)


def test_a_level_at_the_limit_is_played() -> None:
    assert planned("  - sine: {frequency: 50 Hz, amplitude: 10 V, periods: 4}\n").peak_v == 10.0
