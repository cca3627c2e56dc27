"""Does every form of a step refuse what it cannot mean, and name itself well?"""

import re

import pytest

from rig.errors import FileError
from rig.protocol import parse_protocol
from rig.steps import STIMULI
from rig.stimulus import Stimulus

HEAD = "spec: 1\ntitle: t\nquestion: q?\nlimits: {level: 10 V}\nacquisition: {rate: 10 kHz}\nsteps:\n  - "

GOOD = {
    "staircase": "{levels: [1 V, -2 V], dwell: 10 ms}",
    "sine": "{frequency: 50 Hz, amplitude: 1 V, periods: 2, phase: 90 deg, offset: 100 mV}",
    "multisine": "{frequencies: [10 Hz, 30 Hz], peak: 1 V, periods: 2}",
    "triangle": "{frequency: 10 Hz, amplitude: 1 V, periods: 2}",
    "hold": "{level: 1 V, time: 1 s}",
    "minor_loops": "{amplitudes: [2 V, 1 V], slope: 100 V/s}",
    "table": "{times: [0 s, 1 s], levels: [1 V, 2 V]}",
}


def stimulus(kind: str, text: str) -> Stimulus:
    return parse_protocol(f"{HEAD}{kind}: {text}\n", "p.yaml").steps[0].stimulus


def refused(kind: str, text: str) -> str:
    with pytest.raises(FileError) as caught:
        stimulus(kind, text)
    return str(caught.value)


def test_there_is_a_good_example_of_every_stimulus() -> None:
    assert set(GOOD) == set(STIMULI)


@pytest.mark.parametrize(("kind", "title"), [
    ("staircase", "staircase of 2 levels, -2 to 1 V"), ("sine", "sine 50 Hz 1 V"),
    ("multisine", "multisine of 2 lines, 10 to 30 Hz"), ("triangle", "triangle 10 Hz 1 V"),
    ("hold", "hold 1 V for 1 s"), ("minor_loops", "minor loops of 2 amplitudes up to 2 V"),
    ("table", "table of 2 points"),
])
def test_a_step_without_a_label_is_named_after_what_it_plays(kind: str, title: str) -> None:
    assert stimulus(kind, GOOD[kind]).title() == title
    assert stimulus("table", "{file: {path: drive.csv}}").title() == "table drive.csv"


@pytest.mark.parametrize("kind", sorted(GOOD))
def test_every_stimulus_refuses_an_unknown_key(kind: str) -> None:
    assert f"p.yaml:7: steps[0].{kind}.levle: unknown key 'levle'" in refused(kind, GOOD[kind][:-1] + ", levle: 1 V}")


@pytest.mark.parametrize("kind", sorted(GOOD))
def test_every_stimulus_refuses_numbers_without_their_units(kind: str) -> None:
    bare = re.sub(r"(?<=\d) (V/s|V|Hz|ms|mV|s|deg)\b", "", GOOD[kind])
    assert "a number without a unit" in refused(kind, bare)


@pytest.mark.parametrize(("kind", "text", "message"), [
    ("staircase", "{levels: [], dwell: 1 s}", "steps[0].staircase.levels: List should have at least 1 item"),
    ("staircase", "{levels: [{from: 0 V, to: 1 V, step: 300 mV}], dwell: 1 s}",
     "steps[0].staircase.levels[0]: the range is no whole number of steps: 0.3 V; allowed: a step that divides 1 V"),
    ("staircase", "{levels: [{from: 0 V, to: 1 V, step: 0 V}], dwell: 1 s}",
     "steps[0].staircase.levels[0].step: must be greater than 0"),
    ("staircase", "{levels: [1 V], dwell: 0 s}", "steps[0].staircase.dwell: must be greater than 0"),
    ("staircase", "{levels: [1 V], dwell: {settle: 60 %}}", "steps[0].staircase.dwell.settle: must be less than 0.5"),
    ("staircase", "{levels: [1 V], dwell: {hold: 1 s}}", "steps[0].staircase.dwell: the key 'settle' is missing"),
    ("multisine", "{frequencies: [1 Hz], time: 1 s}", "a multisine has one size; allowed: amplitude"),
    ("multisine", "{frequencies: [1 Hz], time: 1 s, peak: 1 V, amplitude: 1 V}", "a multisine has one size"),
    ("multisine", "{frequencies: [1 Hz], peak: 1 V}", "a multisine has one length; allowed: time, or periods"),
    ("multisine", "{frequencies: [1 Hz], peak: 1 V, time: 1 s, phases: random}", "must be 'zero' or 'schroeder'"),
    ("table", "{times: [0 s, 1 s]}", "a table has one source; allowed: times and levels, or file"),
    ("table", "{times: [0 s, 1 s], levels: [1 V, 1 V], file: {path: a.csv}}", "a table has one source"),
])
def test_what_contradicts_itself_is_refused(kind: str, text: str, message: str) -> None:
    assert message in refused(kind, text)
