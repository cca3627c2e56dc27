"""Does a recording made on the loopback end in the answer: the rails found, proven, told, and usable as a model?

The rig the loopback plays conceals rails of 10 V; no command below is told of them.
"""

import json
import signal
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from rig.recording import read
from tests.flow.console import Ended, here, protocol, refused, rig, start

PICTURES = (
    "At a glance: recording, plain model, improved model", "Which stage could explain it", "Where the mismatch sits",
    "On data kept back", "On the data fitted", "Staircase and borders", "Backlash loop", "Spectrum of the residual",
    "Frequency response of G1 and G2",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("answers")


@pytest.fixture(scope="module")
def explained(folder: Path, recording: Path, held_out: Path) -> Ended:
    return rig(
        "explain", recording, "--hold-out", held_out, "--json", "answer.json", "--report", "page.html", cwd=folder
    )


@pytest.fixture(scope="module")
def answer(folder: Path, explained: Ended) -> dict[str, Any]:
    assert explained.code == 0, explained
    return dict(json.loads((folder / "answer.json").read_text(encoding="utf-8")))


def test_the_concealed_rails_are_named_and_proven_on_the_run_held_out(answer: dict[str, Any]) -> None:
    assert answer["schema"] == "rig.explain/1"
    assert answer["verdict"] == "explained"
    assert answer["location"]["stage"] == "F"
    assert [effect["id"] for effect in answer["effects"]] == ["saturation"]
    limits = answer["effects"][0]["parameters"]
    assert limits["upper"]["value"] == pytest.approx(10.0, rel=5e-3)
    assert limits["lower"]["value"] == pytest.approx(-10.0, rel=5e-3)
    proof = answer["fit"]["held_out"]
    assert proof["runs"] == ["other"]
    assert proof["after"] <= 1.1 * proof["noise"] < proof["before"]


def test_the_verdict_comes_first_in_words_and_on_the_page(
    folder: Path, explained: Ended, answer: dict[str, Any]
) -> None:
    assert explained.out.startswith(f"EXPLAINED. {answer['sentence']}")
    page = (folder / "page.html").read_text(encoding="utf-8")
    for title in PICTURES:
        assert f">{title}</h" in page
    assert "What was left out: saturation" in page
    assert len(page) < 3_000_000


def test_the_improved_model_is_readable_and_answers_like_the_rig(
    folder: Path, held_out: Path, answer: dict[str, Any]
) -> None:
    played = here("simulate", held_out, "--rig", "answer.json", "--out", "played.csv", cwd=folder)
    assert played.code == 0, played
    rows = (folder / "played.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0] == "time_s,u_V,y_V,simulated_V"
    off = [float(row.split(",")[2]) - float(row.split(",")[3]) for row in rows[1:]]
    rms = (sum(e * e for e in off) / len(off)) ** 0.5
    assert rms <= 1.1 * answer["noise"]["rms"]


@pytest.fixture(scope="module")
def identified(folder: Path, recording: Path, answer: dict[str, Any]) -> dict[str, Any]:
    ended = rig("identify", recording, "--rig", "answer.json", "--json", "-", "--pdf", "rig.pdf", cwd=folder)
    assert ended.code == 0, ended
    assert (folder / "rig.pdf").read_bytes().startswith(b"%PDF")
    return dict(json.loads(ended.out))


def test_an_identified_model_answers_with_a_band(folder: Path, held_out: Path, identified: dict[str, Any]) -> None:
    (folder / "identified.json").write_text(json.dumps(identified), encoding="utf-8")
    played = here("simulate", held_out, "--rig", "identified.json", "--out", "band.csv", cwd=folder)
    assert played.code == 0, played
    assert "95 % band of the model" in played.out
    rows = [row.split(",") for row in (folder / "band.csv").read_text(encoding="utf-8").splitlines()]
    assert rows[0] == ["time_s", "u_V", "y_V", "simulated_V", "low95_V", "high95_V"]
    assert all(float(low) <= float(answer) <= float(high) for _, _, _, answer, low, high in rows[1:])


def test_identify_gives_json_alone_on_stdout(folder: Path, identified: dict[str, Any]) -> None:
    assert identified["schema"] == "rig.identify/1"
    assert identified["backlash"]["S_L"]["value"] == pytest.approx(8.0, rel=0.01)
    assert identified["backlash"]["D_U"]["value"] == pytest.approx(-1.25, rel=0.01)
    assert identified["fit"]["rms_V"] <= 1.1 * identified["fit"]["noise_rms_V"]
    assert {point["branch"] for point in identified["staircase"]} >= {"loading", "unloading", "plateau"}


def test_a_run_over_a_real_port_is_identified_as_on_the_loopback(folder: Path, identified: dict[str, Any]) -> None:
    protocol(folder)
    with start("emulate", "serial", "--speed", "10", cwd=folder) as board:
        assert board.stdout is not None
        address = board.stdout.readline().strip()
        played = rig("run", "short.yaml", "--device", address, "--out", "wire.h5", cwd=folder)
        board.send_signal(signal.SIGINT)
        board.communicate(timeout=10)
    assert played.code == 0, played
    kept = read(folder / "wire.h5")
    assert kept.complete
    assert kept.trace().valid is None
    again = here("identify", "wire.h5", "--rig", "answer.json", "--json", "-", cwd=folder)
    assert again.code == 0, again
    for name in ("S_L", "D_L", "S_U", "D_U"):
        one, two = identified["backlash"][name]["ci95"], json.loads(again.out)["backlash"][name]["ci95"]
        assert one[0] <= two[1]
        assert two[0] <= one[1]


@pytest.mark.parametrize("after_s", [1.0, 2.0])
def test_an_explanation_can_be_stopped(folder: Path, recording: Path, after_s: float) -> None:
    with start("explain", recording, cwd=folder) as working:
        time.sleep(after_s)
        out, err = _pressed_until_it_ends(working)
    assert working.returncode == 130
    assert err.splitlines()[-1] == "rig: stopped"
    assert not out


def _pressed_until_it_ends(working: subprocess.Popen[str]) -> tuple[str, str]:
    """Press Ctrl-C once, and again where a compiled library swallowed it, as an operator would."""
    for _ in range(3):
        working.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            return working.communicate(timeout=1.0)
    return working.communicate(timeout=10.0)


def test_borders_are_bent_on_request(folder: Path, recording: Path) -> None:
    """The rails the model does not know are a bend of both borders too."""
    ended = rig("identify", recording, "--borders", "curved", "--knots", "4", "--json", "bent.json", cwd=folder)
    assert ended.code == 0, ended
    assert "The borders are bent: 4 knots to a border" in ended.out
    told = json.loads((folder / "bent.json").read_text(encoding="utf-8"))
    assert [len(told["backlash"]["curves"][side]) for side in "LU"] == [4, 4]
    assert len(told["model"]["F"]["curved_backlash"]["L"]) == 4
    assert here("simulate", recording, "--rig", "bent.json", cwd=folder).code == 0
    refused(here("identify", recording, "--knots", "4", cwd=folder), 2, "--knots", "add --borders curved")
