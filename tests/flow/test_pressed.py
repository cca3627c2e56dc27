"""Is Ctrl-C safe in every command: output safe, files whole or absent, an exit code that says so, no traceback?"""

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from rig.commands import commands
from tests.flow.console import rig
from tests.flow.pressed import LINES, Bench, broken, prepare, wrong

ELSEWHERE = {"live"}
"""Stopped where they are tested: tests/flow/test_live.py."""
LONG = {
    "run": 0.3, "design": 0.3, "identify": 0.3, "explain": 0.5, "compare": 0.3, "batch": 1.0, "demo": 0.8,
}  # fmt: skip
"""Commands that are under way for so long at least, s; the others are pressed early, and may have ended."""
EARLY_S = 0.06


@pytest.fixture(scope="module")
def bench(recording: Path, held_out: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    folder = tmp_path_factory.mktemp("pressed")
    prepare(folder)
    shutil.copy(recording, folder / "short.h5")
    shutil.copy(held_out, folder / "other.h5")
    assert rig("export", "short.h5", "--to", "csv", "--out", "table.csv", cwd=folder).code == 0
    made = Bench(folder)
    yield made
    made.close()


def test_every_command_is_stopped_here_or_elsewhere() -> None:
    assert set(commands.commands) == set(LINES) | ELSEWHERE


@pytest.mark.parametrize("command", LINES)
def test_ctrl_c_leaves_nothing_half(bench: Bench, command: str) -> None:
    left = bench.stopped(command, LONG.get(command, EARLY_S), offered=command == "emulate")
    assert not wrong(command, left, bench.folder), left
    if command == "emulate":
        assert (left.code, left.out[:7]) == (0, "serial:"), left
    elif command in LONG:
        assert left.code in (4, 130), left
        assert left.pressed


def test_what_is_half_is_found(bench: Bench, tmp_path: Path, recording: Path) -> None:
    """The judge of the tests above can say no."""
    whole = recording.read_bytes()
    for name, data in ((".a.h5.x", b""), ("a.h5.part", b""), ("a.html", b"<html>"), ("a.csv", b"1,2"), ("a.h5", whole)):
        (tmp_path / name).write_bytes(data)
        assert bool(broken(tmp_path / name)) == (name != "a.h5")
    (tmp_path / "cut.h5").write_bytes(whole[:-100])
    assert broken(tmp_path / "cut.h5")


SWALLOWS = """
import signal, sys, time, weakref
from rig import cli
class Held: pass
def work(words):
    def callback(reference):
        signal.raise_signal(signal.SIGINT)
    held = Held()
    kept = weakref.ref(held, callback)
    del held
    time.sleep(30.0)
    return 0
cli.run_line = work
cli.main()
"""


def test_ctrl_c_that_a_callback_swallows_is_pressed_again(tmp_path: Path) -> None:
    root = str(Path(__file__).parents[2])
    done = subprocess.run([sys.executable, "-c", SWALLOWS], cwd=tmp_path, capture_output=True, text=True, timeout=25.0,
                          check=False, env={**os.environ, "PYTHONPATH": root})  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "rig: stopped\n")


def test_a_second_press_does_not_interrupt_how_the_first_is_told(tmp_path: Path) -> None:
    script = "import sys\nfrom rig import cli\nimport signal\n" \
        "def work(words):\n    signal.raise_signal(signal.SIGINT)\n" \
        "write = sys.stderr.write\n" \
        "def late(text):\n    signal.raise_signal(signal.SIGINT)\n    return write(text)\n" \
        "sys.stderr.write = late\ncli.run_line = work\ncli.main()\n"  # fmt: skip
    root = str(Path(__file__).parents[2])
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True, timeout=25.0,
                          check=False, env={**os.environ, "PYTHONPATH": root})  # fmt: skip
    assert (done.returncode, done.stderr) == (130, "rig: stopped\n")
