"""What is told of a protocol before it is played, with and without a rig to foresee?"""

from pathlib import Path

import pytest

from rig import protocol_narration, session
from rig.foresight import foreseen, to_dict
from tests.flow.test_design import RIG

PROTOCOL = """\
spec: 1
title: two steps
question: What is foreseen?
rig: my_rig.yaml
device: "loopback:"
limits: {level: 10 V}
acquisition: {rate: 2 kHz}
steps:
  - {label: walk, staircase: {levels: [2 V, 0.5 V, -2 V, -0.5 V], dwell: 300 ms}}
  - {label: tone, sine: {frequency: 8 Hz, amplitude: 3 V, periods: 8}}
"""


def told(folder: Path, rig: str = RIG, protocol: str = PROTOCOL) -> tuple[list[str], dict[str, object]]:
    """Return what ``rig check`` says of a protocol, in words and as JSON."""
    (folder / "my_rig.yaml").write_text(rig)
    (folder / "p.yaml").write_text(protocol)
    found = session.check(folder / "p.yaml")
    expected = foreseen(found)
    lines = [str(line).splitlines() for line in protocol_narration.foreseen(expected)]
    return [line for each in lines for line in each], to_dict(found, expected)


def test_every_quantity_is_told_with_its_steps(tmp_path: Path) -> None:
    words, answer = told(tmp_path)
    assert "noise 10 mV (the rig file)" in words[0]
    assert words[2].split()[0] == "F.S_L"
    assert "% walk" in words[2]
    steps = answer["steps"]
    assert isinstance(steps, list)
    assert [step["label"] for step in steps] == ["walk", "tone"]
    assert answer["noise_V"] == 0.01


def test_the_least_noise_is_what_the_adc_makes(tmp_path: Path) -> None:
    words, _ = told(tmp_path, RIG.replace("noise: 10 mV\n", ""))
    assert "the steps of the ADC" in words[0]


@pytest.mark.parametrize(("rig", "protocol", "why"), [
    (RIG, PROTOCOL.replace("rig: my_rig.yaml\n", ""), "the protocol names no rig"),
    (RIG.replace("{num: [1], den: [0.02, 1]}", "{order: 1}"),
     PROTOCOL.replace("loopback:", "loopback:rigs/opamp_backlash.yaml"), "orders and no values"),
])  # fmt: skip
def test_where_nothing_can_be_foreseen_it_says_why(tmp_path: Path, rig: str, protocol: str, why: str) -> None:
    words, answer = told(tmp_path, rig, protocol)
    assert words == [f"  expected  cannot be told: {'the rig file gives ' if 'orders' in why else ''}{why}"]
    assert answer["expected"] == {}


def test_an_unstable_start_is_foreseen_with_its_poles_mirrored(tmp_path: Path) -> None:
    words, _ = told(tmp_path, RIG.replace("den: [0.02, 1]", "den: [1e-7, 1e-5, 0.02, 1]"))
    assert words[2].split()[0] == "F.S_L"
