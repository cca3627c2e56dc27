"""Is what was acknowledged there, and what is missing said, when a disk is full or may no longer be written to?"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import h5py
import numpy as np
import pytest

from rig.recorded import Entry
from rig.recording import read
from rig.verifying import verify
from tests.benchmarks.killed_writer import kills

MB = 1 << 20
RUN = """
import os, sys, numpy as np
from pathlib import Path
from rig import provenance
from rig.errors import FileError
from rig.plan import Limits, Plan
from rig.recording import Equipment, Writer, read
size, y = 100_000, np.arange(100_000.0)

def run(path, midway=lambda: None, size=size):
    try:
        with Writer(path, Plan("run", np.zeros(size), 1e4, (), Limits(-1, 1)), Equipment("loopback:"),
                    overwrite=True) as writer:
            writer.append(0, y[:30_000])
            midway()
            writer.append(30_000, y[30_000:70_000])
            made = writer.finish(True, "all there")
            print("ended", made.complete, made.reason)
    except FileError as error:
        print("refused", error)
"""
FULL = RUN + """
disk = Path(sys.argv[1])
def fill():
    with (disk / "other").open("wb") as other:
        try:
            while True:
                os.write(other.fileno(), bytes(4096))
        except OSError:
            pass
run(disk / "large.h5", size=1_000_000)
run(disk / "run.h5", fill)
"""
REVOKED = RUN + """
folder = Path(sys.argv[1])
provenance.software(), provenance.git_commit()  # a user who may do little may not even load modules
if os.geteuid() == 0:
    os.setegid(65534)
    os.seteuid(65534)
run(folder / "folder.h5", lambda: folder.chmod(0o555))
folder.chmod(0o755)
run(folder / "file.h5", lambda: [folder.chmod(0o555), (folder / "file.h5").chmod(0)])
run(folder / "new.h5")
"""


def told(script: str, folder: Path) -> list[str]:
    """Return what a process said that recorded into a folder."""
    plain = {key: value for key, value in os.environ.items() if not key.startswith("COV")}  # it writes no coverage
    line = [sys.executable, "-c", script, str(folder)]
    done = subprocess.run(line, capture_output=True, text=True, check=False, env=plain)
    assert not done.stderr, done.stderr
    return done.stdout.splitlines()


def is_there(path: Path, reason: str) -> None:
    """Assert that all that was acknowledged is in a recording, and why there is no more."""
    found = read(path)
    assert [found.count(entry) for entry in Entry] == [30_000, 70_000, 0]
    assert np.array_equal(found.y[:70_000], np.arange(70_000.0))
    assert (found.complete, found.reason) == (False, reason)
    assert verify(path).intact
    with h5py.File(path, "r") as file:
        assert file["y"][69_999] == 69_999.0


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """Give a disk of 4 MB, where this system allows one to be made."""
    mount = ["mount", "-t", "tmpfs", "-o", f"size={4 * MB}", "tmpfs", str(tmp_path)]
    with suppress(OSError):
        if subprocess.run(mount, capture_output=True, check=False).returncode == 0:
            yield tmp_path
            subprocess.run(["umount", str(tmp_path)], check=True)
            return
    pytest.skip("no disk can be mounted here; test_recording limits the size of files instead")


def test_a_full_disk(small_disk: Path) -> None:
    refused, ended = told(FULL, small_disk)
    assert refused == f"refused {small_disk}/large.h5: cannot be written: No space left on device"
    reason = "all there; the recording could not be finished: No space left on device"
    assert ended == f"ended False {reason}"
    assert sorted(path.name for path in small_disk.iterdir()) == ["other", "run.h5"]
    is_there(small_disk / "run.h5", reason)


def test_the_right_to_write_is_taken_away_in_a_run() -> None:
    reason = "all there; the recording could not be finished: Permission denied"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        folder.chmod(0o755)
        if folder.owner() == "root":
            subprocess.run(["chown", "65534", name], check=True)
        ended, unreadable, refused = told(REVOKED, folder)
        assert ended == f"ended False {reason}"
        assert unreadable == f"refused {folder}/file.h5: cannot be read: Permission denied"
        assert refused == f"refused {folder}/new.h5: cannot be written: Permission denied"
        folder.chmod(0o755)
        (folder / "file.h5").chmod(0o644)
        assert sorted(path.name for path in folder.iterdir()) == ["file.h5", "folder.h5"]
        is_there(folder / "folder.h5", reason)
        is_there(folder / "file.h5", "all there; the recording could not be finished: Permission denied")


def test_a_writer_killed_at_any_moment_leaves_a_file_with_all_that_was_acknowledged() -> None:
    found = list(kills(3, seed=1))
    assert [one.wrong for one in found] == [""] * 3
    assert sum(one.there for one in found) > 0
