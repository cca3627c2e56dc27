"""Does a protocol that was written read back as the samples that were meant?"""

from pathlib import Path

import numpy as np
import pytest

import protocols
from identify.planning.candidates import Candidate, Chord, Stairs, Tone
from rig.plan import plan
from rig.protocol import parse_protocol
from rig.protocolfile import Heading, exact, label, quoted, written
from rig.yamlfile import parse_yaml

HEADING = Heading('a "title": odd \\ #', "How sure?", "rigs/opamp_backlash.yaml", {"level": "10 V"}, "10000 Hz")
STEPS: list[Candidate] = [
    Stairs((-3.63, 0.0, 3.63, 0.0), 0.286, True),
    Stairs(tuple(float(v) for v in np.round(np.linspace(-1.0, 1.0, 40), 6)), 0.0123, False),
    Tone(32.0, 8.41, 0.0, 16),
    Tone(0.5, 3.0, -0.71, 1),
    Tone(2.0, 3.75, 0.25, 1, triangle=True),
    Chord((4.0, 18.0, 34.0), 7.0, 0.5),
]


@pytest.mark.parametrize("candidate", STEPS, ids=label)
def test_it_reads_back_as_the_same_samples(candidate: Candidate) -> None:
    text = written(HEADING, [(candidate, 3)], ["a remark " * 40], {label(candidate): "because " * 40})
    assert max(map(len, text.splitlines())) <= 120
    where = str(Path(protocols.__path__[0]) / "mine.yaml")
    made = plan(parse_protocol(text, where))
    np.testing.assert_allclose(made.u, np.tile(candidate.drawn(10_000.0), 3), atol=1e-9)
    assert made.title == HEADING.title
    assert [step.repeat for step in made.steps] == [0, 1, 2]
    assert not made.notes


def test_the_top_of_the_file_opens_with_its_question() -> None:
    limits = {"low": "-1 V", "high": "2 V", "slew": "5 V/s"}
    heading = Heading("t", "How?", "r.yaml", limits, "1 Hz", "serial:x", "0.4 s")
    text = written(heading, [(STEPS[2], 1)])
    assert text.startswith("# Question: How?\n")
    assert "device: \"serial:x\"\n" in text
    assert "limits: {low: -1 V, high: 2 V, slew: 5 V/s}\n" in text
    assert "ramp: 0.4 s\n" in text


def test_labels_tell_the_steps_apart_and_are_short() -> None:
    names = [label(c) for c in STEPS]
    assert len(set(names)) == len(names)
    assert max(map(len, names)) <= 80


@pytest.mark.parametrize("text", ['say "so"', "a: b # c", "back\\slash", "µ %"])
def test_any_text_may_be_a_title(text: str) -> None:
    assert parse_yaml(f"t: {quoted(text)}", "f").data == {"t": text}


def test_whole_numbers_have_no_point() -> None:
    assert (exact(10.0, "V"), exact(0.1, "s"), exact(1e-05, "V")) == ("10 V", "0.1 s", "1e-05 V")
