"""Can an analyst find her recordings and ask what changed between two of them, by typing it?"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pypdfium2
import pytest

from identify.trace import Step
from rig.recorded import Equipment, Origin, Recording, complete_ledger
from rig.recording import write
from tests.flow.console import Ended, here, refused
from tests.proof.rigs import RC, Rig
from tests.proof.stimuli import FIG13_LEVELS_V, Stimulus, sine, staircase
from tests.trials import recorded

RIG_FILE = """spec: 1
rig: two RC sections
G1: {num: [1000], den: [20, 1000]}
F: {backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1.25 V}}
G2: {num: [1000], den: [2, 1000]}
"""


def played() -> Stimulus:
    """Return a staircase and a sine, twice."""
    parts = (staircase("stairs", FIG13_LEVELS_V, 0.05), sine("sine", 10.0, 3.4, 5, 2))
    offset = parts[0].u.size
    late = (replace(s, start=s.start + offset, stop=s.stop + offset) for s in parts[1].segments)
    return Stimulus("day", np.concatenate([part.u for part in parts]), (*parts[0].segments, *late))


def record(folder: Path, day: int, name: str, bench: Rig) -> None:
    """Write what a rig answers on one day."""
    stimulus, when = played(), f"2026-01-0{day}T10:00:00+00:00"
    trace = recorded(bench, stimulus, noise_v=0.01, seed=day)
    write(folder / f"{name}.h5", Recording(
        name=name, rate_hz=trace.rate_hz, u=trace.u, y=trace.y, ledger=complete_ledger(trace.size), title="two parts",
        origin=Origin(Equipment("bench:", "integrator"), started=when, finished=when), rig_text=RIG_FILE,
        steps=tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in stimulus.segments),
    ))  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with three days: twice the same rig, then one border moved by 20 mV."""
    folder = tmp_path_factory.mktemp("days")
    drifted = replace(RC, d_l_v=RC.d_l_v + 0.02)
    for day, (name, bench) in enumerate((("one", RC), ("two", RC), ("three", drifted)), start=1):
        record(folder, day, name, bench)
    return folder


def words(pdf: Path) -> str:
    """Return what can be read on paper."""
    return " ".join(sheet.get_textpage().get_text_bounded() for sheet in pypdfium2.PdfDocument(pdf))


def compared(folder: Path, before: str, after: str, *options: str) -> Ended:
    return here("compare", before, after, "--values-only", *options, cwd=folder)


def test_one_rig_on_two_days_shows_no_change(folder: Path) -> None:
    ended = compared(folder, "one.h5", "two.h5", "--json", "same.json")
    assert ended.code == 0, ended
    assert ended.out.startswith("NO CHANGE SEEN.")
    answer = json.loads((folder / "same.json").read_text())
    assert answer["schema"] == "rig.compare/1"
    assert answer["p_value"] > 0.01
    assert {p["state"] for p in answer["parameters"]} <= {"no change seen", "not told"}


def test_a_border_that_moved_is_named_with_its_interval_and_its_page(folder: Path) -> None:
    ended = compared(folder, "two.h5", "three.h5", "--json", "moved.json", "--report", "moved.html",
                     "--pdf", "moved.pdf")
    assert ended.code == 0, ended
    answer = json.loads((folder / "moved.json").read_text())
    assert answer["verdict"] == "changed"
    assert answer["account"] == {"names": ["F.D_L"], "all_of_it": True, "left_p": answer["account"]["left_p"],
                                 "instead": []}  # fmt: skip
    moved = {p["name"]: p for p in answer["parameters"]}["F.D_L"]
    assert moved["state"] == "changed"
    assert moved["change"]["ci95"][0] < 0.02 < moved["change"]["ci95"][1]
    assert {c["aspect"]: c["state"] for c in answer["causes"]} == {
        "protocol": "ruled out", "device": "ruled out", "calibration": "ruled out",
    }  # fmt: skip
    page = (folder / "moved.html").read_text()
    assert answer["sentence"] in page
    assert "Was it the rig?" in page
    assert 'src="http' not in page
    assert "Was it the rig?" in words(folder / "moved.pdf")


def test_a_recording_is_not_compared_with_itself(folder: Path) -> None:
    refused(compared(folder, "one.h5", "one.h5"), 2, "one.h5", "the same readings twice")


def test_a_folder_is_listed_in_words_and_as_json(folder: Path) -> None:
    told, as_json = here("list", folder, cwd=folder), here("list", ".", "--json", "-", cwd=folder)
    assert (told.code, as_json.code) == (0, 0)
    assert [line.split()[0] for line in told.out.splitlines()] == ["recording", "one.h5", "two.h5", "three.h5"]
    rows = json.loads(as_json.out)["recordings"]
    assert [row["path"] for row in rows] == ["one.h5", "two.h5", "three.h5"]
    assert all(row["complete"] and row["title"] == "two parts" and row["rate_hz"] == 1e4 for row in rows)


def test_a_folder_that_is_not_there_is_refused(folder: Path) -> None:
    refused(here("list", "nowhere", cwd=folder), 2, "nowhere", "no such folder")
