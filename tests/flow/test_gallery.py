"""Are the protocols that come with the program found, copied and played, each from its question to a recording?"""

import json
from pathlib import Path

import pytest

from rig.cli import run_line
from rig.recording import read
from rig.references import packaged
from rig.schemas import MODELINE
from rig.verifying import verify
from tests.flow.console import Ended, refused

NAMES = sorted(path.stem for path in packaged().glob("*.yaml"))
ASKED_FOR = {
    "quick_check", "fig13_staircase", "sine_ladder", "loopback_cable", "stuck_state_sine", "minor_loops", "hold_ladder",
    "rate_ladder", "idle_noise", "multisine", "repeat_later",
}  # fmt: skip


@pytest.fixture(autouse=True)
def _there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_the_gallery_is_listed_with_its_questions(capsys: pytest.CaptureFixture[str]) -> None:
    assert run_line(["protocols", "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["schema"] == "rig.protocols/1"
    assert {piece["protocol"] for piece in told["protocols"]} == {f"protocols/{name}.yaml" for name in NAMES}
    assert set(NAMES) >= ASKED_FOR
    assert run_line(["protocols"]) == 0
    lines = capsys.readouterr().out.splitlines()
    for piece in told["protocols"]:
        (line,) = [line for line in lines if line.startswith(f"{Path(piece['protocol']).stem} ")]
        assert piece["question"] in line


def test_one_is_shown_and_copied_for_a_change(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run_line(["protocols", "protocols/quick_check.yaml"]) == 0
    assert capsys.readouterr().out == (packaged() / "quick_check.yaml").read_text(encoding="utf-8")
    assert run_line(["protocols", "quick_check", "--out", "mine.yaml"]) == 0
    text = Path("mine.yaml").read_text(encoding="utf-8")
    (line,) = [line for line in text.splitlines() if line.startswith(MODELINE)]
    assert Path(line.removeprefix(MODELINE)).is_file()
    Path("mine.yaml").write_text(text.replace("amplitude: 3 V", "amplitude: 2.5 V"))
    capsys.readouterr()
    assert run_line(["check", "mine.yaml"]) == 0
    assert "sine 8 Hz 2.5 V" in capsys.readouterr().out
    code = run_line(["protocols", "quick_check", "--out", "mine.yaml"])
    refused(Ended(code, *capsys.readouterr()), 2, "mine.yaml: there is a file of this name already", "--overwrite")
    code = run_line(["protocols", "quik_check"])
    refused(Ended(code, *capsys.readouterr()), 2, "unknown protocol", "did you mean 'quick_check'?")
    code = run_line(["protocols", "--out", "x.yaml"])
    refused(Ended(code, *capsys.readouterr()), 2, "--out is of one protocol")


@pytest.mark.parametrize("name", NAMES)
def test_each_is_checked_and_played_on_the_loopback_and_every_sample_kept(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run_line(["run", f"protocols/{name}.yaml"]) == 0
    assert f"{name}.h5: all " in capsys.readouterr().out
    kept = read(f"{name}.h5")
    assert kept.complete
    assert not [event for event in kept.events if event.kind in ("lost", "clipped")]
    assert verify(f"{name}.h5").intact
