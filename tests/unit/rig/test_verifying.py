"""Is a changed byte found wherever it is, and is the part named that it hit?"""

from pathlib import Path

import h5py
import numpy as np
import pytest

from rig.errors import FileError
from rig.recorded import Entry
from rig.recording import read
from rig.verifying import verify
from tests.benchmarks.flipped_bytes import flips, make


@pytest.mark.parametrize(("kind", "share"), [("finished", 0.1), ("killed", 0.001), ("last words", 0.005)])
def test_a_changed_byte_is_found_wherever_it_is(tmp_path: Path, kind: str, share: float) -> None:
    path = make(tmp_path / "r.h5", kind)
    size = path.stat().st_size
    places = np.flatnonzero(np.random.default_rng(size).uniform(size=size) < share)
    assert places.size >= 50
    assert [one.at for one in flips(path, map(int, places)) if not one.found] == []


def changed(path: Path, name: str, value: object) -> Path:
    """Change what a dataset holds, in place, past every checksum."""
    with h5py.File(path, "r+") as file:
        file[name][3] = value
    return path


@pytest.mark.parametrize(("name", "value"), [("y", 9.0), ("u", 9.0), ("ledger", 2), ("inputs/v", 9.0)])
def test_the_part_that_was_hit_is_named(tmp_path: Path, name: str, value: float) -> None:
    found = verify(changed(make(tmp_path / "r.h5", "finished"), name, value))
    assert not found.intact
    assert found.recording is None
    assert found.findings == ("the bytes do not match their checksum",
                              f"the dataset '{name}' does not match its checksum")


def test_damage_to_what_was_acknowledged_of_a_killed_run_is_named_with_its_samples(tmp_path: Path) -> None:
    path = make(tmp_path / "r.h5", "killed", 200_000)
    with h5py.File(path, "r") as file:
        at = file["y"].id.get_offset() + 8 * 70_000
    with path.open("r+b") as bare:
        bare.seek(at)
        bare.write(b"\x01")
    assert verify(path).findings == ("the dataset 'y' does not match its checksum in samples 65536 to 100000",)
    with pytest.raises(FileError, match="'y' does not match its checksum in samples 65536 to 100000"):
        read(path)


def test_an_intact_recording_says_what_it_is(tmp_path: Path) -> None:
    told = verify(make(tmp_path / "r.h5", "finished")).to_dict()
    assert (told["verdict"], told["complete"], told["reason"]) == ("intact", False, "2 lost")
    assert told["samples"] == {"not_received": 0, "recorded": 38, "lost": 2}
    assert {"all bytes", "attributes", "y", "inputs/v", "ledger", "protocol", "rig"} <= set(told["checked"])


def test_what_was_being_written_when_the_program_died_is_left_out_and_said(tmp_path: Path) -> None:
    path = make(tmp_path / "r.h5", "killed")
    with h5py.File(path, "r") as file:
        y, ledger = (file[name].id.get_offset() for name in ("y", "ledger"))
    with path.open("r+b") as bare:
        for at, data in ((y + 8 * 20, np.ones(5).tobytes()), (ledger + 20, bytes([Entry.RECORDED] * 5))):
            bare.seek(at)
            bare.write(data)
    found = verify(path)
    assert found.intact
    assert found.remarks == (
        "5 samples behind the last acknowledged one were being written when the program ended: left out",)
    assert found.recording is not None
    assert [found.recording.count(entry) for entry in Entry] == [20, 18, 2]
    assert np.isnan(found.recording.y[20:]).all()


def test_a_tool_that_wrote_the_file_anew_took_the_checksum_of_the_whole_with_it(tmp_path: Path) -> None:
    path = make(tmp_path / "r.h5", "finished")
    path.write_bytes(path.read_bytes()[512:])
    found = verify(path)
    assert found.intact
    assert "another program wrote the file anew" in found.remarks[0]
    assert verify(changed(path, "y", 9.0)).findings == ("the dataset 'y' does not match its checksum",)


def test_a_copy_of_a_killed_run_without_its_user_block_still_has_its_journal(tmp_path: Path) -> None:
    path = make(tmp_path / "r.h5", "killed")
    before = read(path)
    path.write_bytes(path.read_bytes()[1 << 16:])
    assert np.array_equal(read(path).y[:], before.y[:], equal_nan=True)
    assert np.array_equal(read(path).ledger, before.ledger)
    assert verify(changed(path, "y", 9.0)).findings == (
        "the dataset 'y' does not match its checksum in samples 0 to 20",)


@pytest.mark.parametrize(("block", "message"), [
    ("rig.recording/2 xxh3-128 0\nHDF5 from byte 512 on; all is new. Read by backlash-rig 0.9.0 and later.\n",
     "a recording of a newer program: rig.recording/2; allowed: up to rig.recording/1; "
     "read it with backlash-rig 0.9.0 or later"),
    ("rig.recording/2 x\n", "read it with the program that wrote it"),
])
def test_a_file_of_a_newer_schema_is_refused_with_the_program_it_needs(
    tmp_path: Path, block: str, message: str,
) -> None:
    path = make(tmp_path / "r.h5", "finished")
    with path.open("r+b") as file:
        file.write(block.encode().ljust(512))
    for look in (read, verify):
        with pytest.raises(FileError, match=message):
            look(path)


def test_a_newer_schema_is_known_without_a_user_block_too(tmp_path: Path) -> None:
    path = make(tmp_path / "r.h5", "finished")
    path.write_bytes(path.read_bytes()[512:])
    with h5py.File(path, "r+") as file:
        assert file.attrs["needs"] == "backlash-rig 0.1.0"
        file.attrs.update({"schema": "rig.recording/3", "needs": "backlash-rig 1.2.0"})
    for look in (read, verify):
        with pytest.raises(FileError, match=r"newer program: rig.recording/3.*backlash-rig 1.2.0 or later"):
            look(path)
