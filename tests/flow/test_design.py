"""Does ``rig design`` write a protocol that ``rig check`` accepts, and refuse what it cannot design for?"""

import json
from pathlib import Path

from tests.flow.console import here, refused

RIG = """\
spec: 1
rig: an RC backlash
G1: {num: [1], den: [0.02, 1]}
F: {backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1.25 V}}
G2: {num: [1], den: [0.002, 1]}
noise: 10 mV
physics: {saturation: {upper: 10 V, lower: -9 V}}
concealed: {offset_drift: {rate: 1 V/s}}
"""
OPTIONS = ("--time", "8s", "--limit", "5V", "--rate", "2kHz")


def test_it_is_designed_checked_and_tells_what_was_promised(tmp_path: Path) -> None:
    (tmp_path / "my_rig.yaml").write_text(RIG)
    made = here("design", "my_rig.yaml", "--out", "best.yaml", *OPTIONS, cwd=tmp_path)
    assert made.code == 0, made
    assert "Fig. 13: walk of 26 levels to 3 V" in made.out
    text = (tmp_path / "best.yaml").read_text()
    assert text.startswith("# Question: How sure can G1, F and G2 become in 8 s?\n")
    checked = here("check", "best.yaml", "--json", "-", cwd=tmp_path)
    assert checked.code == 0, checked
    found = json.loads(checked.out)
    assert found["schema"] == "rig.check/1"
    assert found["duration_s"] <= 8.0
    assert found["peak_V"] <= 5.0
    assert not found["notes"]
    assert not [a for a in found["advice"] if not a["remark"]]
    for name in ("F.S_L", "F.D_L", "F.S_U", "F.D_U"):
        assert found["expected"][name]["half_width_95"] > 0.0


def test_check_tells_in_words_what_a_step_brings_and_what_to_change(tmp_path: Path) -> None:
    (tmp_path / "my_rig.yaml").write_text(RIG)
    (tmp_path / "p.yaml").write_text(
        "spec: 1\ntitle: t\nquestion: q?\nrig: my_rig.yaml\nlimits: {level: 10 V}\nacquisition: {rate: 2 kHz}\nsteps:\n"
        "  - {label: mains, sine: {frequency: 50 Hz, amplitude: 3 V, periods: 25}}\n"
        "  - {label: walk, staircase: {levels: [2 V, 1 V, -2 V, -3 V], dwell: 50 ms}}\n"
    )
    ended = here("check", "p.yaml", "--json", "p.json", cwd=tmp_path)
    assert ended.code == 0, ended
    assert "advice    mains: 50 Hz is on a multiple of the 50 Hz mains" in ended.out
    assert "advice    mains: the gap is stuck at U = 3 V, raise it above 7.95 V" in ended.out
    assert "advice    walk: the dwell of 50 ms ends before G1 and G2 settle" in ended.out
    assert "advice    walk: 1 of 4 levels end on the rails (-9 V and 10 V of w)" in ended.out
    assert "100 % walk" in ended.out
    assert json.loads((tmp_path / "p.json").read_text())["steps"][0]["tells_nothing"] is True


def test_what_cannot_be_designed_for_is_refused(tmp_path: Path) -> None:
    (tmp_path / "my_rig.yaml").write_text(RIG)
    typed = ("design", "my_rig.yaml", "--out", "x.yaml", "--time", "5")
    refused(here(*typed, cwd=tmp_path), 2, "--time", "without a unit", "5 s")
    assert not (tmp_path / "x.yaml").exists()
