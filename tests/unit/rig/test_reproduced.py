"""Does a stored answer that came out otherwise show, and does rounding that tips a digit on another machine not?"""

import json
from pathlib import Path

import pytest

from rig import provenance, reproduced
from rig.errors import FileError
from rig.outputs import json_text
from rig.question import Question
from rig.reproduced import Reproduced

STORED = {
    "schema": "rig.identify/1", "rms_V": 0.123457, "model": {"G1": [0.12345678901234567, 2]}, "converged": True,
    "delay": None, "sentence": "the gap is 1.25 V wide", "separation": ["of the day"],
}  # fmt: skip


@pytest.fixture
def answer(tmp_path: Path) -> Path:
    (tmp_path / "run.h5").write_text("a recording")
    path = tmp_path / "answer.json"
    path.write_text(json_text({**STORED, **Question("identify").of([tmp_path / "run.h5"]).told()}))
    return path


def again(monkeypatch: pytest.MonkeyPatch, answer: Path, now: dict, **program: str) -> Reproduced:
    """Return the answer made again, which now comes out as ``now`` and of a program that differs as said."""
    monkeypatch.setattr(reproduced, "answered", lambda question, progress: json.dumps(now))
    monkeypatch.setattr(reproduced, "program", lambda: {**provenance.program(), **program})
    return reproduced.reproduced(answer)


def test_the_same_answer_is_reproduced(monkeypatch: pytest.MonkeyPatch, answer: Path) -> None:
    found = again(monkeypatch, answer, {**STORED, "separation": []})
    assert (found.numbers, found.differences, found.changes) == (7, (), {})


@pytest.mark.parametrize(
    ("now", "where"),
    [
        ({"rms_V": 0.123458}, "rms_V"), ({"model": {"G1": [0.12345678901234568, 2]}}, "model.G1[0]"),
        ({"model": {"G1": [0.12345678901234567, 2.0]}}, "model.G1[1]"),
        ({"model": {"G1": [0.12345678901234567]}}, "model.G1"), ({"converged": 1}, "converged"),
        ({"delay": 0.0}, "delay"),
        ({"sentence": "the gap is 1.26 V wide"}, "sentence"), ({"more": 1.0}, "more"),
    ],
)  # fmt: skip
def test_of_the_same_program_the_last_bit_counts(
    monkeypatch: pytest.MonkeyPatch, answer: Path, now: dict, where: str
) -> None:
    found = again(monkeypatch, answer, {**STORED, **now})
    assert [d.where for d in found.beyond] == [where]
    assert found.allowed == 0.0


@pytest.mark.parametrize(
    ("now", "holds"),
    [
        ({"rms_V": 0.123458}, True), ({"rms_V": 0.123459}, False), ({"rms_V": 0.12346}, False),
        ({"model": {"G1": [0.12345678901234568, 2]}}, True), ({"model": {"G1": [0.12345678913, 2]}}, True),
        ({"model": {"G1": [0.12345678925, 2]}}, False), ({"sentence": "the gap is 1.26 V wide"}, True),
        ({"sentence": "the gap is 1.28 V wide"}, False), ({"sentence": "the gap is 1.25 V high"}, False),
        ({"converged": False}, False), ({"delay": 1e-12}, False), ({"rms_V": -0.123457}, False),
    ],
)  # fmt: skip
def test_of_another_program_a_billionth_or_a_tipped_digit_is_allowed(
    monkeypatch: pytest.MonkeyPatch, answer: Path, now: dict, holds: bool
) -> None:
    found = again(monkeypatch, answer, {**STORED, **now}, numpy="0.1")
    assert list(found.changes) == ["numpy"]
    assert found.differences
    assert (not found.beyond) is holds


def test_another_commit_of_the_same_source_is_the_same_program(monkeypatch: pytest.MonkeyPatch, answer: Path) -> None:
    assert again(monkeypatch, answer, STORED, git_commit="another").allowed == 0.0
    assert again(monkeypatch, answer, STORED, processor="another").allowed == 1e-9


def test_another_recording_of_that_name_is_not_taken(monkeypatch: pytest.MonkeyPatch, answer: Path) -> None:
    (answer.parent / "run.h5").write_text("another recording")
    with pytest.raises(FileError, match="no longer the one the answer was made from"):
        again(monkeypatch, answer, STORED)


def test_the_recording_is_sought_by_name_below_the_folders_given(
    monkeypatch: pytest.MonkeyPatch, answer: Path, tmp_path: Path
) -> None:
    deep = tmp_path / "kept" / "2026"
    deep.mkdir(parents=True)
    (answer.parent / "run.h5").rename(deep / "run.h5")
    with pytest.raises(FileError, match=r"not found: run\.h5; name the folder"):
        again(monkeypatch, answer, STORED)
    monkeypatch.setattr(reproduced, "answered", lambda question, progress: json.dumps(
        {**STORED, "rms_V": question.recordings[0].path == deep / "run.h5"}))  # fmt: skip
    assert reproduced.reproduced(answer, [tmp_path / "kept"]).beyond[0].now is True


def test_what_is_no_answer_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    for text, said in (
        ("[]", "does not say what it was made from"), ('{"made_from": 3}', "a mapping is needed"),
        ('{"made_from": {}}', "is missing"), ("{", "not valid JSON"),
    ):  # fmt: skip
        path.write_text(text)
        with pytest.raises(FileError, match=said):
            reproduced.reproduced(path)


def test_a_failure_is_no_answer(tmp_path: Path) -> None:
    (tmp_path / "run.h5").write_text("a recording")
    failure = {"schema": "rig.failure/1", "message": "damaged", **Question("identify").of([tmp_path / "run.h5"]).told()}
    (tmp_path / "a.json").write_text(json_text(failure))
    with pytest.raises(FileError, match="a failure, and no answer: damaged"):
        reproduced.reproduced(tmp_path / "a.json")
