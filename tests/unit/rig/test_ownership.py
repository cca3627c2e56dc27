"""Has a port one owner at a time, whoever opens it and however its owner ends?"""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from rig import ownership
from rig.errors import DeviceError
from rig.ownership import FOLDER_VARIABLE, claim

OWNER = "import sys, time; from rig.ownership import claim; _ = claim(sys.argv[1]); print(flush=True); time.sleep(60)"


@pytest.fixture(autouse=True)
def folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "ports"))
    monkeypatch.setattr(ownership, "PATIENCE_S", 0.05)
    return tmp_path / "ports"


def test_a_second_owner_is_refused_and_told_who_the_first_is() -> None:
    first = claim("/dev/ttyX")
    with pytest.raises(DeviceError, match=rf"/dev/ttyX: the device is in use: by process {os.getpid()} .*one program"):
        claim("/dev/ttyX")
    first.release()
    claim("/dev/ttyX").release()


def test_other_ports_are_free_however_alike_their_names() -> None:
    one, two = claim("TCPIP::a-b::INSTR"), claim("TCPIP::a/b::INSTR")
    one.release()
    two.release()


def test_a_port_is_free_when_its_owner_was_killed() -> None:
    with subprocess.Popen([sys.executable, "-c", OWNER, "port"], stdout=subprocess.PIPE, cwd=Path(__file__).parents[3],
                          ) as owner:  # fmt: skip
        assert owner.stdout is not None
        owner.stdout.readline()
        with pytest.raises(DeviceError, match=f"by process {owner.pid}"):
            claim("port")
        os.kill(owner.pid, signal.SIGKILL)
    claim("port").release()


def test_a_port_handed_on_stays_claimed_until_all_have_let_go() -> None:
    first = claim("port")
    with subprocess.Popen(["cat"], stdin=subprocess.PIPE, pass_fds=[first.fileno()]) as heir:
        first.sign("its heir, with a shorter name")
        first.release()
        with pytest.raises(DeviceError, match="by its heir, with a shorter name; allowed"):
            claim("port")
        assert heir.stdin is not None
        heir.stdin.close()
        heir.wait(5)
    claim("port").release()


def test_letting_go_twice_is_harmless_and_of_no_use() -> None:
    held = claim("port")
    held.release()
    held.release()
    with pytest.raises(ValueError, match="let go of"):
        held.fileno()


def test_locks_are_for_all_users(folder: Path) -> None:
    before = os.umask(0o077)
    try:
        claim("port").release()
    finally:
        os.umask(before)
    assert folder.stat().st_mode & 0o7777 == 0o1777
    assert [path.stat().st_mode & 0o777 for path in folder.iterdir()] == [0o666]


def test_a_folder_that_cannot_be_used_is_told(folder: Path) -> None:
    folder.write_text("not a folder")
    with pytest.raises(DeviceError, match=rf"port: the port cannot be locked: .*{FOLDER_VARIABLE}"):
        claim("port")


def test_a_link_in_place_of_the_lock_is_not_followed(folder: Path, tmp_path: Path) -> None:
    claim("port").release()
    (lock,) = folder.iterdir()
    lock.unlink()
    lock.symlink_to(tmp_path / "victim")
    with pytest.raises(DeviceError, match="cannot be locked"):
        claim("port")
    assert not (tmp_path / "victim").exists()
