"""Does an explanation that cannot decide write what would, play it, and decide?"""

import json
from pathlib import Path
from typing import Any

import pytest

from rig import followup, session
from rig.rigfile import model_to_yaml
from tests.flow.console import Ended, here, refused, rig
from tests.proof.cases import Concealed
from tests.proof.device import stand
from tests.proof.rigs import RC
from tests.trials import model_of

RIG = """\
spec: 1
rig: an RC backlash
G1: {num: [1], den: [0.02, 1]}
F: {backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1.25 V}}
G2: {num: [1], den: [0.002, 1]}
noise: 10 mV
concealed: {extra_pole: {tau: 0.1 ms, stage: G2}}
"""
SHORT = """\
spec: 1
title: short
question: Is a walk enough?
rig: my_rig.yaml
device: "loopback:my_rig.yaml"
limits: {level: 8 V}
acquisition: {rate: 4 kHz}
steps:
  - label: walk
    repeats: 2
    staircase: {levels: [2 V, 3 V, 1 V, -1 V, -3 V, -2 V, 0.5 V], dwell: 60 ms}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("follow_up")
    (made / "my_rig.yaml").write_text(RIG)
    (made / "short.yaml").write_text(SHORT)
    assert here("run", "short.yaml", cwd=made).code == 0
    return made


@pytest.fixture(scope="module")
def followed(folder: Path) -> Ended:
    ended = rig("explain", "short.h5", "--follow-up", "loopback:my_rig.yaml", "--json", "a.json", cwd=folder)
    assert ended.code == 0, ended
    return ended


@pytest.fixture(scope="module")
def answer(folder: Path, followed: Ended) -> dict[str, Any]:
    return dict(json.loads((folder / "a.json").read_text(encoding="utf-8")))


@pytest.mark.counted
def test_what_a_walk_leaves_open_is_decided_on_the_device(followed: Ended, answer: dict[str, Any]) -> None:
    told = answer["follow_up"]
    (first,) = told["rounds"][0]["sets"]
    assert {"id": "extra_pole", "stage": "G2"} in [{k: m[k] for k in ("id", "stage")} for m in first["set"]]
    assert len(first["set"]) > 1
    assert [s["status"] for s in told["sets"]] == ["decided"]
    assert [(e["id"], e["stage"], e["could_also_be"]) for e in answer["effects"]] == [("extra_pole", "G2", [])]
    assert answer["separation"] == []
    assert "  decided  " in followed.out


def test_what_was_played_is_a_protocol_within_the_limits_and_kept(folder: Path, answer: dict[str, Any]) -> None:
    (first,) = answer["follow_up"]["rounds"][0]["sets"]
    protocol, (recording,) = first["protocol"], answer["follow_up"]["rounds"][0]["recordings"]
    assert Path(recording).stem == Path(protocol).stem
    checked = here("check", protocol, "--json", "-", cwd=folder)
    assert checked.code == 0, checked
    assert json.loads(checked.out)["peak_V"] <= 8.0
    text = (folder / protocol).read_text(encoding="utf-8")
    assert text.startswith("# Question: Is it ")


def test_without_a_device_the_protocol_is_written_and_named(folder: Path) -> None:
    (folder / "kept").mkdir()
    ended = rig("explain", "short.h5", "--separate", "kept", "--json", "-", cwd=folder)
    assert ended.code == 0, ended
    told = json.loads(ended.out)
    (open_set,) = told["separation"]
    assert told["effects"][0]["would_separate"].startswith(f"{open_set['protocol']}: ")
    assert (folder / open_set["protocol"]).is_file()
    assert "follow_up" not in told


def test_a_folder_that_is_not_there_is_refused_at_once(folder: Path) -> None:
    refused(here("explain", "short.h5", "--separate", "nowhere", cwd=folder), 2, "no such folder", "nowhere")


def test_where_physics_of_no_catalogue_enters_is_asked_of_the_device_too(tmp_path: Path) -> None:
    """A gain over the rate may be of w or of the reading, for all that one walk tells; x is read as it is."""
    where = stand(tmp_path / "bench.json", RC, (Concealed("hurried_reading", {"k": 0.02, "top": 600.0}),), 3)
    (tmp_path / "my_rig.yaml").write_text(model_to_yaml(model_of(RC)))
    (tmp_path / "short.yaml").write_text(SHORT)
    recording = tmp_path / "short.h5"
    assert session.record(tmp_path / "short.yaml", where, recording, lambda done, total: None).outcome.failure is None
    asked = followup.Asked((str(recording),), None, (), tmp_path, where)
    followed = followup.explain(asked, lambda sentence, share: None)
    ((played,),) = (each.written for each in followed.rounds)
    assert {name for name, _ in played.members} == {"unnamed"}
    assert {stage for _, stage in played.members} >= {"sense", "F"}
    assert "if one of these were all there is" in played.sentence
    assert any(line.startswith("  inseparable an unnamed law in ") for line in followup.words(followed))
    last = followed.told.location
    assert last is not None
    assert (last.stage, last.alternatives, last.same_data) == ("sense", ("G2",), ("G2",))
    assert [(f.id, f.stage) for f in followed.told.effects] == [("unnamed", "sense")]
    (left,) = followed.open
    assert left.path is None
    assert "feed the DAQ's input from a calibrated source" in left.sentence
    assert played.path is not None
    protocol = played.path.read_text(encoding="utf-8")
    assert all(kind in protocol for kind in ("staircase:", "sine:", "multisine:"))
