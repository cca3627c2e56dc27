"""Is HDF5 that nobody vouches for read elsewhere first, and is what it does not hold never shown?"""

import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from rig import unvouched
from rig.contained import ElsewhereError, check_contained
from rig.errors import FileError
from rig.recording import read, write
from rig.unvouched import check_readable
from rig.verifying import verify
from tests.mutations.recordings import LINKS, SIZES, changed, without_seal
from tests.unit.rig.test_recording import a_recording, same

HELD = {"y a group", "a reference for y"}
"""Wrong, but in the file."""
LIMITED = """\
from resource import *
setrlimit(RLIMIT_CPU, (1, 2))
setrlimit(RLIMIT_CORE, (0, 0))
"""


@pytest.fixture
def held(tmp_path: Path) -> bytes:
    write(tmp_path / "r.h5", a_recording())
    write(tmp_path / "other.h5", a_recording())
    return (tmp_path / "r.h5").read_bytes()


def test_a_recording_that_a_tool_rewrote_is_read(tmp_path: Path, held: bytes) -> None:
    (tmp_path / "r.h5").write_bytes(without_seal(held))
    check_readable(tmp_path / "r.h5")
    assert same(read(tmp_path / "r.h5"), a_recording())


@pytest.mark.parametrize("name", [*(name for name in LINKS if name not in HELD), "y of 8 TB", "y of 8 TB in one piece",
                                  "y of 1.6 GB in 2 MB", "u of 8 EB", "twenty thousand groups", "groups in groups"])
def test_what_is_not_in_the_file_is_not_followed(tmp_path: Path, held: bytes, name: str) -> None:
    (tmp_path / "run.h5").write_bytes(changed(held, (LINKS | SIZES)[name]))
    with h5py.File(tmp_path / "run.h5") as file, pytest.raises(ElsewhereError):
        check_contained(file)


def test_what_is_not_in_the_file_is_damage(tmp_path: Path, held: bytes) -> None:
    (tmp_path / "run.h5").write_bytes(changed(held, LINKS["y virtual, of itself"]))
    with pytest.raises(FileError, match="stand in another file"):
        read(tmp_path / "run.h5")
    assert verify(tmp_path / "run.h5", locate=False).findings == ("the values of /y stand in another file",)


def test_hard_links_in_a_circle_are_gone_through_once(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "c.h5", "w") as file:
        inside = file.create_group("a/b")
        inside["round"] = file["a"]
        check_contained(file)


@pytest.mark.parametrize(("program", "word"), [
    ("import os; os.kill(os.getpid(), 11)", "dies of it"), ("while True: pass", "does not come to an end"),
    ("import sys; sys.stdout.write('no room'); sys.exit(1)", "no room"),
])
def test_what_becomes_of_the_reader_is_told(
    tmp_path: Path, held: bytes, monkeypatch: pytest.MonkeyPatch, program: str, word: str
) -> None:
    (tmp_path / "stub").mkdir()
    (tmp_path / "stub" / "reader.py").write_text(f"{LIMITED}{program}\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "stub"))
    monkeypatch.setattr(unvouched, "__name__", "reader")
    with pytest.raises(ValueError, match=word):
        check_readable(tmp_path / "r.h5")


def test_nothing_in_the_folder_of_a_file_is_run(tmp_path: Path, held: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "h5py.py").write_text("raise SystemExit(1)")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    check_readable(tmp_path / "r.h5")


def test_a_signal_that_is_packed_and_huge_is_refused(tmp_path: Path, held: bytes) -> None:
    def packed(file: h5py.File) -> None:
        del file["y"]
        rng = np.random.default_rng(0)
        file.create_dataset("y", (1 << 25,), chunks=(1 << 22,), dtype="f8")[: 1 << 22] = rng.standard_normal(1 << 22)

    (tmp_path / "run.h5").write_bytes(changed(held, packed))
    with pytest.raises(FileError, match="h5repack -l CONTI"):
        read(tmp_path / "run.h5")
