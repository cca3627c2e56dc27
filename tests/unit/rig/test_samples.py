"""Is a signal that stays in its file the one that was written, and is a lost sample bridged as in memory?"""

import os
import pickle
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.trace import Stored
from rig import recordingfile
from rig.errors import FileError
from rig.recorded import Entry, Recording
from rig.recording import read, write
from rig.samples import Bridged, InFile
from tests.unit.rig.test_recording import a_recording, same


@pytest.fixture
def _long(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a recording of 40 samples count as a long one."""
    monkeypatch.setattr(recordingfile, "AT_ONCE", 10)


def in_file(path: Path, recording: Recording) -> Recording:
    write(path, recording)
    found = read(path)
    assert isinstance(found.y, InFile)
    return found


@pytest.mark.usefixtures("_long")
def test_a_long_recording_stays_in_its_file_and_is_the_same(tmp_path: Path) -> None:
    found = in_file(tmp_path / "r.h5", a_recording())
    in_memory = replace(found, u=found.u[:], y=found.y[:], u_measured=found.u_measured[:])
    assert same(in_memory, a_recording())
    assert np.array_equal(found.y[7:31:3], np.sin(np.arange(40))[7:31:3])
    assert isinstance(found.trace().u, Stored)
    assert np.array_equal(np.asarray(pickle.loads(pickle.dumps(found.u))), found.u[:])


@pytest.mark.usefixtures("_long")
def test_a_long_recording_is_copied_by_stretches(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found = in_file(tmp_path / "r.h5", a_recording())
    monkeypatch.setattr(recordingfile, "blocks", lambda start, stop: zip(
        range(start, stop, 7), [*range(start + 7, stop, 7), stop], strict=True))
    write(tmp_path / "copy.h5", found)
    monkeypatch.undo()
    assert same(read(tmp_path / "copy.h5"), replace(a_recording(), name="copy"))


@pytest.mark.usefixtures("_long")
def test_a_file_that_changes_while_it_is_used_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    found = in_file(path, a_recording())
    os.utime(path, (1.0, 1.0))
    with pytest.raises(FileError, match="changed while it was in use"):
        found.y[:3]
    path.unlink()
    with pytest.raises(FileError, match="cannot be read any more"):
        found.y[:3]


@pytest.mark.usefixtures("_long")
@pytest.mark.parametrize("at", [3, 39])
def test_a_long_recording_with_a_sample_that_is_no_number_is_refused(tmp_path: Path, at: int) -> None:
    found = a_recording()
    y = found.y[:].copy()
    y[at] = np.nan
    lost = found.ledger.copy()
    lost[at] = Entry.LOST
    assert np.isnan(in_file(tmp_path / "a.h5", replace(found, y=y, ledger=lost)).y[at : at + 1]).all()
    with pytest.raises(ValueError, match="not a finite number"):
        replace(found, y=y)


def test_a_signal_in_pieces_or_of_another_kind_is_not_left_in_its_file(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["whole"] = np.arange(30.0)
        file["single"] = np.arange(30, dtype=np.float32)
        file["table"] = np.zeros((15, 2))
        file.create_dataset("packed", data=np.arange(30.0), chunks=(10,), compression="gzip")
        file.create_dataset("unwritten", 30, np.float64)
        kept = {name for name in file if InFile.of(file[name]) is not None}
    assert kept == {"whole"}


@settings(max_examples=200, deadline=None)
@given(st.lists(st.booleans(), max_size=40), st.integers(0, 50), st.integers(0, 50))
def test_lost_samples_are_bridged_by_straight_lines(received: list[bool], start: int, stop: int) -> None:
    valid = np.array([*received, True])
    y = np.where(valid, np.random.default_rng(0).normal(size=valid.size), np.nan)
    bridged = Bridged.over(y, valid)
    there = np.flatnonzero(valid)
    assert np.array_equal(bridged[start:stop], np.interp(np.arange(valid.size), there, y[there])[start:stop])
    assert np.isnan(y).sum() == np.count_nonzero(~valid)


@pytest.mark.usefixtures("_long")
def test_the_trace_of_a_long_recording_is_that_of_a_short_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ledger = a_recording().ledger.copy()
    ledger[[0, 1, 7, 20, 21, 22, 38, 39]] = Entry.LOST
    y = np.where(ledger == Entry.RECORDED, a_recording().y[:], np.nan)
    seen = in_file(tmp_path / "r.h5", replace(a_recording(), y=y, ledger=ledger)).trace()
    monkeypatch.undo()
    whole = read(tmp_path / "r.h5").trace()
    assert isinstance(seen.y, Bridged)
    assert isinstance(whole.y, np.ndarray)
    assert (seen.size, seen.steps, seen.from_rest) == (whole.size, whole.steps, whole.from_rest)
    assert all(np.array_equal(a, b) for a, b in ((seen.u, whole.u), (seen.y, whole.y), (seen.valid, whole.valid)))
