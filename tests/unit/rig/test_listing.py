"""Is a folder listed as it is: whole recordings, incomplete and damaged ones, and the answers that lie beside them?"""

import hashlib
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.errors import FileError
from rig.listing import Facts, listed
from rig.listing_words import words
from rig.recorded import Entry, Equipment, Origin, Recording, complete_ledger
from rig.recording import write


def recording(started: str, **other: object) -> Recording:
    """Return a finished recording of 8 samples."""
    plain = Recording(
        name="run", rate_hz=1000.0, u=np.arange(8.0), y=np.arange(8.0), ledger=complete_ledger(8),
        origin=Origin(Equipment("serial:/dev/a", "DAQ", "7"), started=started, finished=started), title="stairs",
    )  # fmt: skip
    return replace(plain, **other)  # type: ignore[arg-type]


def answer(path: Path, of: Path, said: dict[str, object], sha256: str = "") -> None:
    """Write an answer about a recording."""
    source = {"path": str(of.resolve()), "sha256": sha256 or hashlib.sha256(of.read_bytes()).hexdigest()}
    path.write_text(json.dumps({**said, "made_from": {"recordings": [source], "held_out": []}}))


EXPLAINED = {"schema": "rig.explain/1", "verdict": "explained", "effects": [{"id": "saturation"}]}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a later and an earlier recording, the earlier one a folder further down."""
    (tmp_path / "deep").mkdir()
    write(tmp_path / "late.h5", recording("2026-02-02T10:00:00+00:00"))
    write(tmp_path / "deep" / "early.h5", recording("2026-01-01T10:00:00+00:00"))
    return tmp_path


def test_the_earliest_comes_first_with_what_when_device_rate_and_length(folder: Path) -> None:
    first, second = listed(folder).rows
    assert [first.path.name, second.path.name] == ["early.h5", "late.h5"]
    assert first.facts == Facts("stairs", "2026-01-01T10:00:00+00:00", "DAQ 7", 1000.0, 8, 0, True, "")
    assert first.facts.length_s == 0.008


def test_what_is_missing_of_an_incomplete_run_is_told(folder: Path) -> None:
    ledger = complete_ledger(8)
    ledger[6:] = Entry.NOT_RECEIVED
    write(folder / "torn.h5", recording("2026-03-03", ledger=ledger, complete=False, reason="cable"))
    facts = listed(folder).rows[-1].facts
    assert facts is not None
    assert (facts.lost, facts.complete, facts.reason) == (2, False, "cable")
    assert "no, 2 samples not recorded" in "\n".join(map(str, words(listed(folder))))


def test_one_flipped_byte_takes_a_recording_from_the_list_and_says_so(folder: Path) -> None:
    data = bytearray((folder / "late.h5").read_bytes())
    data[-9] ^= 1
    (folder / "late.h5").write_bytes(data)
    last = listed(folder).rows[-1]
    assert last.facts is None
    assert "damaged" in last.problem
    assert "late.h5" in list(words(listed(folder)))[-1]


def test_a_verdict_is_that_of_the_very_bytes(folder: Path) -> None:
    answer(folder / "answer.json", folder / "late.h5", EXPLAINED)
    early, late = listed(folder).rows
    assert (early.answers, [a.verdict for a in late.answers]) == ((), ["explained (saturation)"])
    write(folder / "late.h5", recording("2026-02-02T10:00:01+00:00"), overwrite=True)
    late = listed(folder).rows[1]
    assert late.answers == ()
    assert [a.path.name for a in late.outdated] == ["answer.json"]
    assert "held before" in "\n".join(map(str, words(listed(folder))))


def test_a_recording_that_was_moved_keeps_its_verdict(folder: Path) -> None:
    answer(folder / "answer.json", folder / "late.h5", EXPLAINED)
    (folder / "late.h5").rename(folder / "renamed.h5")
    assert [a.verdict for a in listed(folder).rows[1].answers] == ["explained (saturation)"]


SAID = [
    ({"schema": "rig.identify/1", "fit": {"rms_V": 0.0101, "noise_rms_V": 0.01}}, "identified"),
    ({"schema": "rig.identify/1", "fit": {"rms_V": 0.21, "noise_rms_V": 0.01}}, "identified, leaves 21 x noise"),
    ({"schema": "rig.identify/1", "fit": None}, "identified"),
    ({"schema": "rig.failure/1", "message": "too short"}, "failed: too short"),
    ({"schema": "rig.explain/1", "verdict": "consistent", "effects": []}, "consistent"),
]


@pytest.mark.parametrize(("said", "verdict"), SAID, ids=[row[1] for row in SAID])
def test_every_kind_of_answer_is_told_in_a_few_words(folder: Path, said: dict[str, object], verdict: str) -> None:
    answer(folder / "answer.json", folder / "late.h5", said)
    assert [a.verdict for a in listed(folder).rows[1].answers] == [verdict]


NO_ANSWERS = [
    "", "[]", "{", '{"made_from": 3}',
    '{"schema": "rig.explain/1", "made_from": {"recordings": [{"path": 1}]}}',
    '{"schema": "of another program", "made_from": {"recordings": [{"path": "a", "sha256": "b"}]}}',
]  # fmt: skip


@pytest.mark.parametrize("text", NO_ANSWERS)
def test_other_files_beside_them_are_passed_over(folder: Path, text: str) -> None:
    (folder / "other.json").write_text(text)
    assert [row.answers for row in listed(folder).rows] == [(), ()]


def test_a_folder_without_recordings_is_an_empty_list(tmp_path: Path) -> None:
    assert listed(tmp_path).to_dict() == {"schema": "rig.list/1", "folder": str(tmp_path), "recordings": []}
    assert list(words(listed(tmp_path))) == [f"{tmp_path}: no recordings (*.h5)"]


def test_what_is_no_folder_is_refused(folder: Path) -> None:
    for path, why in ((folder / "nowhere", "no such folder"), (folder / "late.h5", "not a folder")):
        with pytest.raises(FileError, match=why):
            listed(path)
