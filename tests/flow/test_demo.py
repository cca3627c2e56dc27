"""Does the first command of the README end in a report that finds what the demo rig conceals?"""

import json
from pathlib import Path

import pytest

from rig.recording import read
from rig.reproduced import reproduced
from tests.flow.console import rig
from tests.flow.printed import check_printed
from tests.pages import examples

FILES = {"demo.h5", "demo_hold_out.h5", "explain.json", "identify.json", "identify.html", "report.html"}


def test_the_demo_finds_the_concealed_rails_and_writes_everything(tmp_path: Path) -> None:
    ended = rig("demo", cwd=tmp_path, limit_s=400.0)
    assert ended.code == 0, ended
    folder = tmp_path / "rig-demo"
    assert {path.name for path in folder.iterdir()} == FILES
    assert "Open rig-demo/report.html in a browser." in ended.out
    (shown,) = [e.text for e in examples("", page="README.md") if e.text.startswith("EXPLAINED")]
    check_printed(ended, shown.splitlines(), "rig demo")
    told = json.loads((folder / "explain.json").read_text(encoding="utf-8"))
    assert told["verdict"] == "explained"
    assert told["location"]["stage"] == "F"
    assert told["effects"][0]["id"] == "saturation"
    for name, level in (("upper", 10.0), ("lower", -10.0)):
        assert told["effects"][0]["parameters"][name]["value"] == pytest.approx(level, rel=5e-3)
    held = told["fit"]["held_out"]
    assert held["runs"] == ["demo_hold_out"]
    assert held["after"] <= 1.1 * held["noise"]
    assert read(folder / "demo.h5").complete
    for name, job in (("explain.json", "explain"), ("identify.json", "identify")):
        made_from = json.loads((folder / name).read_text(encoding="utf-8"))["made_from"]
        assert made_from["job"] == job
        assert [Path(source["path"]).name for source in made_from["held_out"]] == ["demo_hold_out.h5"]
    again = reproduced(folder / "identify.json")  # the explanation too, which takes as long as the demo
    assert again.intact
    assert again.numbers > 100
    assert not again.differences
