"""Is every recording of a batch done once, done again when it or the question changed, and nothing else overwritten?"""

import csv
import json
import os
from collections.abc import Generator, Sequence
from pathlib import Path

import pytest

from rig import batch, batch_narration, batchtable, reanalysis
from rig.errors import FileError, UsageError
from rig.outputs import json_text
from rig.question import KEY, Named, Question
from rig.work import Order, Outcome
from rig.workflow import Progress

ANSWER = {
    "schema": "rig.identify/1", "delay_s": {"value": 0.001, "ci95": [0.0, None]}, "warnings": ["w"],
    "backlash": {"S_L": {"value": 8.0, "ci95": [7.5, 8.5]}, "D_L": {"value": 1.25, "ci95": [1.2, 1.3]}},
    "fit": {"rms_V": 0.1, "noise_rms_V": 0.01, "fit_percent": 98.5, "converged": True},
}  # fmt: skip
IDENTIFY = Question("identify")


@pytest.fixture(autouse=True)
def analysed(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Have recordings, here texts, answered at once; return the names of those that were worked on."""
    done: list[str] = []

    def answered(question: Question, progress: Progress) -> str:
        path = question.recordings[0].path
        done.append(path.name)
        if "damaged" in path.read_text():
            raise FileError("damaged", where=str(path))
        if "slow" in path.read_text():
            raise MemoryError
        if "bug" in path.read_text():
            raise ZeroDivisionError("division by zero")
        if "grows" in path.read_text():
            path.write_text("grown")
        return json_text({**ANSWER, "text": path.read_text(), **question.told()})

    monkeypatch.setattr(reanalysis, "answered", answered)
    return done


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    folder = tmp_path / "runs"
    (folder / "deep").mkdir(parents=True)
    for name in ("a", "b", "deep/a"):
        (folder / f"{name}.h5").write_text(f"recording {name}")
    return folder


def here(orders: Sequence[Order]) -> Generator[Outcome]:
    yield from map(reanalysis.work, orders)


def done(runs: Path, question: Question = IDENTIFY, out: Path | None = None) -> tuple[batch.Batch, batch.State]:
    planned = batch.planned([f"{runs}/**/*.h5"], question, out)
    return planned, batch.run(planned, here, lambda state: None)


def held(path: Path) -> dict:
    return dict(json.loads(path.read_text()))


def test_every_recording_has_its_answer_beside_it(runs: Path, analysed: list[str]) -> None:
    _, state = done(runs)
    assert (state.answered, state.unchanged, state.failures) == (3, 0, ())
    assert held(runs / "a.identify.json")["text"] == "recording a"
    assert held(runs / "deep" / "a.identify.json")["text"] == "recording deep/a"
    assert len(analysed) == 3


def test_nothing_is_done_twice(runs: Path, analysed: list[str]) -> None:
    done(runs)
    before = {path: path.stat() for path in runs.rglob("*.json")}
    _, state = done(runs)
    assert (state.answered, state.unchanged, len(analysed)) == (0, 3, 3)
    assert {path: path.stat() for path in runs.rglob("*.json")} == before


def test_a_batch_that_is_stopped_goes_on_where_it_was(runs: Path, analysed: list[str]) -> None:
    planned = batch.planned([f"{runs}/**/*.h5"], IDENTIFY)

    def stopped(orders: Sequence[Order]) -> Generator[Outcome]:
        yield reanalysis.work(orders[0])
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        batch.run(planned, stopped, lambda state: None)
    _, state = done(runs)
    assert (state.answered, state.unchanged) == (2, 1)
    assert sorted(analysed) == ["a.h5", "a.h5", "b.h5"]


def test_a_recording_that_changed_is_done_again_though_its_clock_says_nothing(runs: Path, analysed: list[str]) -> None:
    done(runs)
    old = (runs / "b.h5").stat()
    (runs / "b.h5").write_text("recording B")
    os.utime(runs / "b.h5", ns=(old.st_atime_ns, old.st_mtime_ns))
    _, state = done(runs)
    assert (state.answered, state.unchanged, state.reasons) == (1, 2, {"the recording changed": 1})
    assert held(runs / "b.identify.json")["text"] == "recording B"
    assert analysed[3:] == ["b.h5"]


def test_another_question_or_version_is_answered_again(
    runs: Path, analysed: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    done(runs)
    rig = Question("identify", rig=Named("r.yaml", "spec: 1"))
    _, state = done(runs, rig)
    assert state.reasons == {"asked otherwise before": 3}
    _, state = done(runs, Question("identify", rig=Named("renamed.yaml", "spec: 1")))
    assert state.unchanged == 3
    other = {**reanalysis.program(), "source": "0" * 64}
    for module in (batch, reanalysis):
        monkeypatch.setattr(module, "program", lambda: other)
    monkeypatch.setattr("rig.question.program", lambda: other)
    _, state = done(runs, rig)
    assert state.reasons == {"answered by other versions before": 3}
    moved = {**other, "processor": "another", "git_commit": "x", "system": "y"}
    for name in ("rig.batch.program", "rig.reanalysis.program", "rig.question.program"):
        monkeypatch.setattr(name, lambda: moved)
    _, state = done(runs, rig)
    assert state.unchanged == 3


def test_a_worker_of_another_version_refuses(runs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    planned = batch.planned([f"{runs}/*.h5"], IDENTIFY)
    monkeypatch.setattr(reanalysis, "program", lambda: {"numpy": "0.1"})
    state = batch.run(planned, here, lambda state: None)
    assert len(state.failures) == 2
    assert "the worker runs another program" in state.failures[0][1]
    assert not list(runs.glob("*.json"))


def test_failures_are_listed_and_what_would_fail_again_is_not_tried_again(runs: Path, analysed: list[str]) -> None:
    for name, text in (("a", "damaged"), ("b", "slow"), ("c", "bug")):
        (runs / f"{name}.h5").write_text(text)
    for again in (False, True):
        planned, state = done(runs)
        assert state.answered + state.unchanged == 1
        failures = {path.name: message for path, message in state.failures}
        assert failures["a.h5"] == f"{runs}/a.h5: damaged"
        assert failures["b.h5"] == "not enough memory for this recording"
        assert failures["c.h5"].startswith("a fault in the program itself: ZeroDivisionError: division by zero (")
        assert analysed == (["a.h5", "b.h5", "c.h5", "a.h5"] + ["b.h5"] * again)
    assert held(runs / "a.identify.json")["schema"] == "rig.failure/1"
    lines = list(batch_narration.batched(planned, state, Path("t.csv")))
    assert sum("failed  " in line for line in lines) == 3
    (runs / "a.h5").write_text("mended")
    assert len(done(runs)[1].failures) == 2
    assert held(runs / "a.identify.json")["text"] == "mended"


def test_a_recording_that_changes_meanwhile_is_not_answered(runs: Path) -> None:
    (runs / "a.h5").write_text("it grows")
    _, state = done(runs)
    assert [message for _, message in state.failures if "changed while it was in use" in message]
    assert not (runs / "a.identify.json").exists()


@pytest.mark.parametrize("text", ["my notes", "{}", '{"schema": "rig.identify/1"}'])
def test_a_file_that_is_no_answer_is_not_overwritten(runs: Path, text: str) -> None:
    (runs / "a.identify.json").write_text(text)
    planned, state = done(runs)
    assert "stands where the answer goes" in dict(state.failures)[runs / "a.h5"]
    assert (runs / "a.identify.json").read_text() == text
    row = {r["recording"]: r for r in batchtable.rows(planned, state)}[str(runs / "a.h5")]
    assert (row["status"], row["S_L"]) == ("failed", None)


def test_an_answer_about_several_recordings_is_not_overwritten(runs: Path) -> None:
    both = IDENTIFY.of([runs / "a.h5", runs / "b.h5"])
    (runs / "a.identify.json").write_text(json_text({**ANSWER, **both.told()}))
    assert (runs / "a.h5") in dict(done(runs)[1].failures)


def test_answers_go_below_another_folder_as_the_recordings_lie(runs: Path, tmp_path: Path) -> None:
    done(runs, out=tmp_path / "out")
    answers = sorted(path.relative_to(tmp_path / "out").as_posix() for path in (tmp_path / "out").rglob("*.json"))
    assert answers == ["a.identify.json", "b.identify.json", "deep/a.identify.json"]
    assert not list(runs.rglob("*.json"))
    (runs / "b.h5").unlink()
    (runs / "a.h5").unlink()
    assert done(runs, out=tmp_path / "out")[1].unchanged == 1  # what else is found moves no answer


def test_patterns_and_names_are_each_taken_once(runs: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(runs)
    paths, root = batch.found(["a.h5", "*.h5", f"{runs}/a.h5"])
    assert ([path.name for path in paths], root) == (["a.h5", "b.h5"], runs)
    with pytest.raises(UsageError, match="no recording is found"):
        batch.found(["*.h6"])


def test_what_lies_above_leads_no_answer_out_of_its_folder(
    runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(runs / "deep")
    planned = batch.planned(["../*.h5", "a.h5"], IDENTIFY, tmp_path / "out")
    answers = sorted(piece.result.relative_to(tmp_path / "out").as_posix() for piece in planned.pieces)
    assert answers == ["a.identify.json", "b.identify.json", "deep/a.identify.json"]


def test_two_recordings_of_one_name_are_refused(runs: Path) -> None:
    (runs / "a.hdf5").write_text("another")
    with pytest.raises(UsageError, match=r"a\.h5, .*a\.hdf5: two recordings whose answers have one name"):
        batch.planned([f"{runs}/*"], IDENTIFY)


def test_the_time_left_is_that_of_what_is_new(runs: Path) -> None:
    done(runs)
    (runs / "a.identify.json").unlink()
    (runs / "deep" / "a.identify.json").unlink()
    seen: list[batch.State] = []
    batch.run(batch.planned([f"{runs}/**/*.h5"], IDENTIFY), here, seen.append)
    assert [(s.done, s.new, s.worked) for s in seen] == [(0, 2, 0), (1, 1, 1), (2, 1, 1), (3, 0, 2)]
    assert seen[0].left_s is None
    assert seen[1].left_s == pytest.approx(seen[1].seconds)
    assert seen[3].left_s == 0.0
    assert batch_narration.under_way("identify", seen[1]).startswith("identify: 1 of 3, ")


@pytest.mark.parametrize("name", ["t.csv", "t.parquet"])
def test_the_table_has_a_row_for_each_with_the_numbers_of_its_answer(runs: Path, name: str) -> None:
    (runs / "b.h5").write_text("damaged")
    planned, state = done(runs)
    batchtable.check_table(runs / name)
    batchtable.write(runs / name, planned, state)
    if name.endswith("csv"):
        with (runs / name).open(newline="") as file:
            rows = [{key: value or None for key, value in row.items()} for row in csv.DictReader(file)]
        assert rows[0]["S_L"] == "8.0"
        assert rows[0]["converged"] == "True"
    else:
        from pyarrow import parquet

        rows = parquet.read_table(runs / name).to_pylist()
        assert rows[0]["S_L"] == 8.0
        assert rows[0]["converged"] is True
    by_name = {row["recording"]: row for row in rows}
    assert by_name[str(runs / "b.h5")]["message"] == f"{runs}/b.h5: damaged"
    assert by_name[str(runs / "b.h5")]["S_L"] is None
    assert by_name[str(runs / "a.h5")]["status"] == "answered"
    digest = held(runs / "a.identify.json")[KEY]["recordings"][0]["sha256"]
    assert by_name[str(runs / "a.h5")]["sha256"] == digest
    assert by_name[str(runs / "a.h5")]["delay_s_high95"] is None


def test_a_table_that_cannot_be_written_is_refused_before_the_work(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"allowed: \.csv, \.parquet"):
        batchtable.check_table(tmp_path / "t.xlsx")
    with pytest.raises(UsageError, match="no such folder"):
        batchtable.check_table(tmp_path / "no" / "t.csv")
