"""Is a recording followed to its last sample while it grows, is finished and replaced, or left by a killed program?"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from rig.errors import FileError
from rig.journal import STRETCH
from rig.live.following import Following, Stretch, follow
from rig.recorded import Entry, Event
from rig.recording import Writer, read
from tests.unit.rig.test_recording import EQUIPMENT, a_plan


def taken(following: Following) -> list[Stretch]:
    """Return all that is new."""
    return list(following.news(following.standing()))


def joined(stretches: list[Stretch], name: str) -> np.ndarray:
    """Return one input of all stretches, each of which must follow the one before."""
    position = stretches[0].first
    for each in stretches:
        assert each.first == position
        position += each.u.size
    return np.concatenate([each.inputs[name] for each in stretches])


def test_samples_come_as_they_are_acknowledged_and_gaps_stay_gaps(tmp_path: Path) -> None:
    size = 2 * STRETCH + 1000
    plan, y = a_plan(size), np.sin(np.arange(size))
    path, got = tmp_path / "run.h5", []
    with Writer(path, plan, EQUIPMENT) as writer:
        following = follow(path)
        assert following.about.title == plan.title
        assert following.standing().going_on
        assert taken(following) == []
        for start, stop in ((0, 7), (7, STRETCH), (STRETCH + 100, STRETCH + 300), (STRETCH + 300, size - 5)):
            writer.append(start, y[start:stop])
            assert following.standing().acknowledged == stop
            got += taken(following)
        writer.append(size - 5, y[size - 5 :])
        recording = writer.finish(True, "all there", (Event("safe", "0 V", size, size),))
        standing = following.standing()
        got += taken(following)
    assert standing.complete
    assert (standing.reason, standing.going_on) == ("all there", False)
    assert [event.kind for event in standing.events] == ["safe"]
    assert np.array_equal(np.concatenate([each.u for each in got]), recording.u[:])
    assert np.array_equal(np.concatenate([each.entries for each in got]), recording.ledger)
    assert np.array_equal(joined(got, "y"), recording.y[:], equal_nan=True)
    assert np.count_nonzero(recording.ledger == Entry.LOST) == 100


def test_a_long_run_is_opened_without_a_look_at_its_samples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, read_at = tmp_path / "run.h5", []
    with Writer(path, a_plan(3 * STRETCH), EQUIPMENT) as writer:
        writer.append(0, np.zeros(2 * STRETCH))
        monkeypatch.setattr(h5py.Dataset, "__getitem__", _noted(read_at, h5py.Dataset.__getitem__))
        assert follow(path).standing().acknowledged == 2 * STRETCH
        monkeypatch.undo()
    assert not {"/y", "/ledger", "/journal"} & set(read_at)


def _noted(names: list[str], get: Callable[..., object]) -> Callable[..., object]:
    """Return a way to read a dataset that notes its name."""

    def noted(dataset: h5py.Dataset, *arguments: object) -> object:
        names.append(dataset.name)
        return get(dataset, *arguments)

    return noted


def test_a_run_that_was_left_is_told_from_one_that_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with Writer(path, a_plan(), EQUIPMENT) as writer:
        following = follow(path)
        writer.append(0, np.ones(10))
        assert following.standing().going_on
    standing = following.standing()  # the file was closed without a word, as by a killed program
    assert not standing.going_on
    assert not standing.complete
    assert standing.reason == "the program ended before the run did"
    assert sum(each.u.size for each in taken(following)) == 10
    again = follow(path)
    assert again.standing() == standing


def test_a_finished_recording_is_followed_from_its_first_sample(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with Writer(path, a_plan(), EQUIPMENT) as writer:
        writer.append(0, np.arange(40.0))
        writer.finish(True, "all there")
    following = follow(path)
    assert following.standing().complete
    assert np.array_equal(joined(taken(following), "y"), np.arange(40.0))
    assert taken(following) == []


def test_further_inputs_come_with_y(tmp_path: Path) -> None:
    plan = replace(a_plan(), inputs=("y", "u_measured", "v"))
    path = tmp_path / "run.h5"
    with Writer(path, plan, EQUIPMENT) as writer:
        following = follow(path)
        writer.append(0, np.zeros(5), np.array([np.ones(5), 2.0 * np.ones(5)]))
        stretch = taken(following)[0]
    assert following.further == ("u_measured", "v")
    assert stretch.inputs["u_measured"].tolist() == [1.0] * 5
    assert stretch.inputs["v"].tolist() == [2.0] * 5


def test_whoever_follows_keeps_no_writer_out_and_holds_no_lock(tmp_path: Path) -> None:
    path = tmp_path / "run.h5"
    with Writer(path, a_plan(), EQUIPMENT) as writer:
        follow(path)
        writer.append(0, np.zeros(40))
        writer.finish(True, "all there")
    following = follow(path)
    with h5py.File(path, "r+"):  # HDF5's own lock, exclusive
        assert following.standing().complete


@pytest.mark.parametrize("held", [b"", b"no recording at all", b"rig.recording/1 growing 00\n"])
def test_what_is_no_recording_is_refused_in_one_message(tmp_path: Path, held: bytes) -> None:
    path = tmp_path / "run.h5"
    path.write_bytes(held)
    with pytest.raises(FileError, match=r"run\.h5"):
        follow(path)
    with pytest.raises(FileError, match="no such recording"):
        follow(tmp_path / "none.h5")


def test_following_disturbs_no_byte_of_the_recording(tmp_path: Path) -> None:
    paths = tmp_path / "watched.h5", tmp_path / "alone.h5"
    found = []
    for path in paths:
        with Writer(path, a_plan(), EQUIPMENT) as writer:
            following = follow(path) if path is paths[0] else None
            for start in range(0, 40, 8):
                writer.append(start, np.arange(start, start + 8.0))
                if following:
                    taken(following)
            writer.finish(True, "all there")
        found.append(read(path))
    assert np.array_equal(found[0].y[:], found[1].y[:])
    assert np.array_equal(found[0].ledger, found[1].ledger)
