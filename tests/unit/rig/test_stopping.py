"""Is a run that was rung for stopped as Ctrl-C stops it, and can nobody else ring?"""

import os
import signal
import socket
from pathlib import Path

import numpy as np
import pytest

from identify.trace import Step
from rig import stopping
from rig.plan import Limits, Plan
from rig.runner import run
from rig.stopping import FOLDER_VARIABLE, bell, held_back, ring
from tests.unit.rig.devices import ScriptedDevice

SIZE = 2000


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    path = tmp_path / "run.h5"
    path.write_bytes(b"grows")
    return path


def test_a_bell_is_heard_once_and_says_who_rang(recording: Path) -> None:
    with bell(recording) as asked:
        assert asked() is None
        assert ring(recording.stat(), "the page")
        assert asked() == "the page"
        assert asked() is None


def test_the_bell_belongs_to_the_file_whatever_its_path(recording: Path) -> None:
    other = recording.with_name("other.h5")
    other.write_bytes(b"")
    with bell(recording) as asked:
        assert not ring(other.stat(), "somebody")
        moved = recording.rename(recording.with_name("moved.h5"))
        assert ring(moved.stat(), "the page")
        assert asked() == "the page"


def test_nobody_is_rung_for_once_the_run_is_over_or_was_killed(recording: Path) -> None:
    with bell(recording):
        pass
    assert not ring(recording.stat(), "the page")
    left = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    left.bind(str(stopping._folder() / stopping._name(recording.stat())))
    left.close()  # as a killed run leaves it
    assert not ring(recording.stat(), "the page")
    with bell(recording) as asked:
        assert ring(recording.stat(), "the page")
        assert asked() == "the page"


def test_the_folder_is_the_users_alone(recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / "b"
    monkeypatch.setenv(FOLDER_VARIABLE, str(folder))
    with bell(recording):
        assert folder.stat().st_mode & 0o777 == 0o700
        assert [path.stat().st_mode & 0o777 for path in folder.iterdir()] == [0o600]
    folder.chmod(0o755)
    with bell(recording) as asked:  # a folder that others look into is not used; the run goes on without a bell
        assert not ring(recording.stat(), "somebody")
        assert asked() is None
    assert not os.listdir(folder)


def test_a_run_that_is_rung_for_ramps_down_and_says_who_rang() -> None:
    device, heard = ScriptedDevice(), iter([None, None, "the page"])
    steps = (Step("all", "table", 0, SIZE),)
    plan = Plan("a ramp", np.linspace(0.0, 4.0, SIZE), 1000.0, steps, Limits(-5.0, 5.0), 1.0, 0.2)

    class Nowhere:
        def append(self, start: int, y: np.ndarray, further: np.ndarray) -> None:
            pass

    outcome = run(plan, device, Nowhere(), asked=lambda: next(heard, None))
    assert not outcome.complete
    assert "stopped by the page" in outcome.reason
    assert 0 < outcome.samples < SIZE
    assert device.diary[-2:] == ["halt", "safe 1 V 0.2 s"]
    assert device.level == 1.0


@pytest.mark.usefixtures("interruptible")
def test_a_signal_that_is_held_back_is_done_behind_unless_a_run_was_told_of_it() -> None:
    with pytest.raises(KeyboardInterrupt), held_back() as told:
        signal.raise_signal(signal.SIGINT)
    with held_back() as told:
        assert told() is None
        signal.raise_signal(signal.SIGINT)
        assert told() == "SIGINT"
        assert told() is None
    before = signal.getsignal(signal.SIGINT)
    with held_back():
        pass
    assert signal.getsignal(signal.SIGINT) is before
