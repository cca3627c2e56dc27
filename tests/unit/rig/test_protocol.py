"""Is a protocol file read as meant, and is a wrong one refused with file, line, key and what to write?"""

from pathlib import Path

import pytest

from rig.errors import FileError
from rig.protocol import Limits, Protocol, parse_protocol, read_protocol

HEAD = """\
spec: 1
title: a test
question: does it move?
limits: {level: 10 V}
acquisition: {rate: 10 kHz}
"""
STEPS = "steps:\n  - sine: {frequency: 50 Hz, amplitude: 3 V, periods: 4}\n"


def protocol(steps: str = STEPS, head: str = HEAD) -> Protocol:
    return parse_protocol(head + steps, "p.yaml")


def refused(steps: str = STEPS, head: str = HEAD) -> str:
    with pytest.raises(FileError) as caught:
        protocol(steps, head)
    assert caught.value.exit_code == 2
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_protocol_says_what_its_file_says() -> None:
    read = protocol("safe_level: 100 mV\nramp: 20 ms\nrepeats: 3\ndevice: 'loopback:'\n" + STEPS)
    assert (read.title, read.question, read.rate_hz, read.repeats) == ("a test", "does it move?", 1e4, 3)
    assert (read.safe_level_v, read.ramp_s, read.device) == (0.1, 0.02, "loopback:")
    assert read.limits == Limits(-10.0, 10.0, None)
    assert read.text.startswith("spec: 1")


def test_a_step_knows_its_place_its_label_and_its_repeats() -> None:
    step, second = protocol(STEPS + "  - {label: pause, repeats: 2, hold: {level: 0 V, time: 1 s}}\n").steps
    assert (step.label, step.repeats, step.where) == ("sine 50 Hz 3 V", 1, "p.yaml:7: steps[0].sine")
    assert (second.label, second.repeats, second.stimulus.kind) == ("pause", 2, "hold")


def test_limits_can_be_lopsided() -> None:
    head = HEAD.replace("{level: 10 V}", "{low: -1 V, high: 5 V, slew: 2 V/ms}")
    assert protocol(head=head).limits == Limits(-1.0, 5.0, 2000.0)


def test_the_rate_may_be_a_multiple_of_a_stimulus_frequency() -> None:
    assert protocol(head=HEAD.replace("10 kHz", "200 x 50 Hz")).rate_hz == pytest.approx(1e4)


@pytest.mark.parametrize(("wrong", "right", "message"), [
    ("amplitude: 3", "amplitude: 3 V",
     "p.yaml:7: steps[0].sine.amplitude: a number without a unit: 3; allowed: a voltage; write '3 V'"),
    ("frequncy: 50 Hz", "frequency: 50 Hz",
     "p.yaml:7: steps[0].sine.frequncy: unknown key 'frequncy'; allowed: amplitude, frequency, offset, periods, phase; "
     "did you mean 'frequency'?"),
    ("amplitude: 3 Hz", "amplitude: 3 V", "steps[0].sine.amplitude: wrong unit 'Hz'; allowed: a voltage, as in '3 V'"),
    ("frequency: -50 Hz", "frequency: 50 Hz", "p.yaml:7: steps[0].sine.frequency: must be greater than 0: '-50 Hz'"),
    ("periods: 2.5", "periods: 4", "p.yaml:7: steps[0].sine.periods: must be a valid integer: 2.5"),
    ("periods: 0", "periods: 4", "p.yaml:7: steps[0].sine.periods: must be greater than or equal to 1: 0"),
    ("sinus:", "sine:", "p.yaml:7: steps[0].sinus: unknown key 'sinus'"),
])
def test_a_wrong_value_in_a_step_is_named_with_its_line(wrong: str, right: str, message: str) -> None:
    assert message in refused(STEPS.replace(right, wrong))


@pytest.mark.parametrize(("head", "message"), [
    (HEAD.replace("spec: 1", "spec: 2"), "p.yaml:1: spec: must be 1: 2"),
    (HEAD.replace("title: a test\n", ""), "p.yaml:1: the key 'title' is missing; add 'title:'"),
    (HEAD.replace("limits: {level: 10 V}\n", ""), "the key 'limits' is missing"),
    (HEAD.replace("level: 10 V", "level: 10"), "p.yaml:4: limits.level: a number without a unit: 10"),
    (HEAD.replace("level: 10 V", "low: -1 V"), "p.yaml:4: limits: limits are given in one of two ways"),
    (HEAD.replace("level: 10 V", "level: 1 V, low: -1 V, high: 1 V"), "limits are given in one of two ways"),
    (HEAD.replace("level: 10 V", "low: 2 V, high: 1 V"), "p.yaml:4: limits: the limits are exchanged"),
    (HEAD.replace("rate:", "rates:"), "p.yaml:5: acquisition.rates: unknown key 'rates'; allowed: inputs, rate; did"),
    (HEAD + "limit: 3\n", "p.yaml:6: limit: unknown key 'limit'"),
    (HEAD + "rig: none.yaml\n", "p.yaml:6: rig: no such rig file: none.yaml"),
    (HEAD.replace("a test", "''"), "p.yaml:2: title:"),
])
def test_a_wrong_head_is_named_with_its_line(head: str, message: str) -> None:
    assert message in refused(head=head)


@pytest.mark.parametrize(("steps", "message"), [
    ("steps: []\n", "p.yaml:6: steps: there is nothing to play; allowed: at least one step"),
    ("steps: 3\n", "p.yaml:6: steps: must be a valid list: 3"),
    ("", "p.yaml:1: the key 'steps' is missing"),
    ("steps: [sine]\n", "p.yaml:6: steps[0]: a step is a mapping: 'sine'; allowed: staircase, sine"),
    ("steps:\n  - {label: x}\n", "p.yaml:7: steps[0]: a step has one stimulus: none"),
    ("steps:\n  - sine: {}\n    hold: {}\n", "p.yaml:7: steps[0]: a step has one stimulus: sine and hold"),
    ("steps:\n  - sine: 3 V\n", "p.yaml:7: steps[0].sine: a mapping is needed: '3 V'"),
    ("steps:\n  - repeats: 0\n    hold: {level: 0 V, time: 1 s}\n", "p.yaml:7: steps[0].repeats: must be greater"),
])
def test_wrong_steps_are_refused(steps: str, message: str) -> None:
    assert message in refused(steps)


@pytest.mark.parametrize(("inputs", "message"), [
    ("[]", "the inputs are y and further ones, each named once: none; allowed: for example [y, u_measured, v]"),
    ("[v, y]", "the inputs are y and further ones"), ("[y, v, v]", "each named once: y, v, v"),
    ("[y, u]", "u is what is put out, not an input; call an input that reads it back 'u_measured'"),
    ("[y, 'v w']", "not a name for an input: 'v w'"), ("[y, ../v]", "not a name for an input: '../v'"),
    ("4", "must be a valid list: 4"),
])
def test_inputs_that_cannot_be_are_refused_at_their_line(inputs: str, message: str) -> None:
    told = refused(head=HEAD.replace("10 kHz", f"10 kHz, inputs: {inputs}"))
    assert told.startswith("p.yaml:5: acquisition.inputs")
    assert message in told


def test_inputs_are_named_in_the_order_of_their_wires() -> None:
    assert protocol().inputs == ("y",)
    several = protocol(head=HEAD.replace("10 kHz", "10 kHz, inputs: [y, w, u_measured]"))
    assert several.inputs == ("y", "w", "u_measured")


def test_an_empty_file_says_how_a_protocol_starts() -> None:
    with pytest.raises(FileError, match="the file is empty; a protocol starts with 'spec: 1'"):
        parse_protocol("", "p.yaml")


def test_a_rig_is_found_beside_the_protocol_first(tmp_path: Path) -> None:
    wire = "{num: [1], den: [1]}"
    (tmp_path / "mine.yaml").write_text(f"spec: 1\nrig: mine\nG1: {wire}\nF: linear\nG2: {wire}\n")
    path = tmp_path / "p.yaml"
    path.write_text(HEAD + "rig: mine.yaml\n" + STEPS)
    read = read_protocol(path)
    assert read.rig is not None
    assert read.rig.model.title == "mine"
    assert read.rig_path == str(tmp_path / "mine.yaml")


def test_a_shipped_rig_is_found_from_anywhere() -> None:
    read = protocol(head=HEAD + "rig: rigs/paper_simulation.yaml\n")
    assert read.rig is not None
    assert read.rig.model.g2.dead_time_s == 5.0
