"""Does `rig batch` go from files to answers and a table over processes, and do the answers come out again?"""

import csv
import json
import math
import signal
import time
from pathlib import Path

import pytest

from rig.cli import run_line
from rig.provenance import program
from rig.question import Question
from rig.reanalysis import work
from rig.work import Order
from tests.benchmarks.batch import recordings
from tests.flow.console import LIMIT_S, Ended, refused, rig, start

COUNT = 16


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with small recordings, one of them damaged."""
    folder = tmp_path_factory.mktemp("batch")
    recordings(folder / "runs", COUNT - 1)
    damaged = bytearray((folder / "runs" / "r00000.h5").read_bytes())
    damaged[len(damaged) // 2] ^= 1
    (folder / "runs" / "bad.h5").write_bytes(damaged)
    return folder


def answers(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.glob("*.json")}


def test_a_batch_is_killed_goes_on_and_ends_with_a_table(runs: Path) -> None:
    line = ("batch", "runs/*.h5", "--job", "identify", "--out", "out", "--workers")
    killed = start(*line, "2", cwd=runs)
    until = time.monotonic() + LIMIT_S
    while len(answers(runs / "out")) < 3 and time.monotonic() < until:
        time.sleep(0.005)
    killed.send_signal(signal.SIGKILL)
    killed.communicate()
    before = answers(runs / "out")
    stamps = {name: (runs / "out" / name).stat().st_mtime_ns for name in before}
    assert 3 <= len(before) < COUNT
    assert all(json.loads(text) for text in before.values())

    ended = rig(*line, "1", cwd=runs)
    assert ended.code == 1
    failed_before = "bad.identify.json" in before
    assert f"{COUNT} recordings: {COUNT - len(before) - (not failed_before)} answered now, " in ended.out
    assert "bad.h5: damaged or truncated recording" in ended.out
    *progress, said = ended.err.splitlines()
    assert all(line.startswith("identify: ") for line in progress), "a host that is slow is told how far it is"
    assert said.startswith(f"rig: not every recording has an answer: 1 of {COUNT}")
    after = answers(runs / "out")
    assert len(after) == COUNT
    assert {name: (runs / "out" / name).stat().st_mtime_ns for name in before} == stamps
    with (runs / "out" / "batch.identify.csv").open(newline="") as file:
        rows = {Path(row["recording"]).name: row for row in csv.DictReader(file)}
    assert rows.pop("bad.h5")["status"] == "failed"
    assert {row["status"] for row in rows.values()} == {"answered"}
    ends = [(float(row["S_L_low95"]), float(row["S_L"]), float(row["S_L_high95"])) for row in rows.values()]
    assert all(1.8 < low <= value <= high < 2.2 for low, value, high in ends)


def test_a_recording_that_takes_too_long_is_listed_and_tried_again(
    runs: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(runs)
    line = ["batch", "runs/r00001.h5", "--job", "identify", "--out", "limited", "--workers", "1", "--time-limit"]
    assert run_line([*line, "1 us"]) == 1
    assert "r00001.h5: not answered within --time-limit, 1e-06 s; give it more" in capsys.readouterr().out
    assert not list((runs / "limited").glob("*.json"))
    assert run_line([*line, "2 min"]) == 0
    assert "1 answered now" in capsys.readouterr().out
    assert run_line([*line, "0 s"]) == 2
    assert "--time-limit: not above 0" in capsys.readouterr().err


def test_work_that_cannot_be_ended_from_outside_looks_at_the_clock_itself(runs: Path) -> None:
    path = runs / "runs" / "r00002.h5"
    ended = work(Order(path, Question("identify"), program(), limit_s=1e-6))
    assert (ended.kind, ended.text) == ("failed", "")
    assert "not answered within --time-limit" in ended.message


def test_an_answer_is_made_again_to_the_last_bit_and_a_changed_one_is_found(
    runs: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(runs)
    assert run_line(["identify", "runs/r00001.h5", "--json", "mine.json"]) == 0
    mine = json.loads((runs / "mine.json").read_text())
    assert mine == json.loads((runs / "out" / "r00001.identify.json").read_text())
    capsys.readouterr()
    assert run_line(["verify", "mine.json", "--recordings", "runs", "--json", "-"]) == 0
    told = json.loads(capsys.readouterr().out)["files"][0]
    assert (told["verdict"], told["different"], told["program"]) == ("reproduced", 0, {})
    assert told["compared"] > 100

    mine["model"]["G1"]["den"][0] = math.nextafter(mine["model"]["G1"]["den"][0], math.inf)
    (runs / "mine.json").write_text(json.dumps(mine))
    code = run_line(["verify", "mine.json", "--recordings", "runs"])
    ended = capsys.readouterr()
    assert code == 1
    assert "COMES OUT OTHERWISE" in ended.out
    assert "mine.json: the answer comes out otherwise: model.G1.den[0]: " in ended.err


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (("none/*.h5", "--job", "identify"), ("none/*.h5: no recording is found",)),
        (("runs/*.h5", "--job", "identify", "--table", "t.xls"), ("allowed: .csv, .parquet",)),
        (("runs/*.h5", "--job", "identify", "--out", "runs/bad.h5"), ("the folder cannot be made",)),
        (("runs/*.h5", "--job", "identify", "--scheduler", "tcp://127.0.0.1:1"), ("no Dask scheduler answers",)),
        (("runs/*.h5", "--job", "identify", "--scheduler", "x", "--workers", "1"), ("--workers is of this machine",)),
        (("runs/*.h5", "--job", "identify", "--rig", "no.yaml"), ("no.yaml: no such file",)),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_message(
    runs: Path, line: tuple[str, ...], words: tuple[str, ...], monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(runs)
    monkeypatch.setattr("rig.cluster.CONNECT_S", 0.2)
    code = run_line(["batch", *line])
    refused(Ended(code, *capsys.readouterr()), 2, *words)
