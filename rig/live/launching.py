"""How does a run get its live page before anything is output, and go on without it?"""

import json
import os
import select
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path

from rig.errors import RefusedError, UsageError

READY_S = 60.0
"""Longest wait for the page: a first start compiles. Nothing is output before it is there."""
IDLE_S, IDLE_VARIABLE = 60.0, "RIG_LIVE_IDLE_S"
"""How long a page stays once the run has ended and nobody looks any more."""


@dataclass(frozen=True)
class Order:
    """Which recording to show: the next file at ``path`` that is not ``before`` (device and inode; None: any)."""

    path: str
    before: tuple[int, int] | None = None
    idle_s: float = IDLE_S


def check_installed() -> None:
    """Raise UsageError where what serves the page is not installed."""
    if find_spec("bokeh") is None:
        raise UsageError("a live page needs Bokeh, which is not installed; nothing was output",
                         do="pip install 'backlash-rig[live]'")


@contextmanager
def beside(recording: Path) -> Iterator[str]:
    """Give the URL of a page that shows what is recorded at a path from now on; it outlives who asked for it.

    Raises UsageError where what serves it is not installed, RefusedError when it does not start.
    """
    check_installed()
    process = _started()
    assert process.stdin is not None
    try:
        process.stdin.write(json.dumps(asdict(_order(recording))).encode() + b"\n")
        process.stdin.flush()
        yield _url(process)
    finally:
        with suppress(OSError):
            process.stdin.close()  # a page of nothing ends with that


def _order(recording: Path) -> Order:
    """Return what the page is to show."""
    idle_s = float(os.environ.get(IDLE_VARIABLE, IDLE_S))
    path = str(recording.absolute())
    if not recording.exists():
        return Order(path, None, idle_s)
    there = recording.stat()
    return Order(path, (there.st_dev, there.st_ino), idle_s)


def _started() -> subprocess.Popen[bytes]:
    """Return the process of a page; its session is its own: what stops the run leaves it alone."""
    home = str(Path(__file__).parents[2])
    path = os.pathsep.join(filter(None, (home, os.environ.get("PYTHONPATH"))))
    return subprocess.Popen(
        [sys.executable, "-P", "-m", "rig.live.process"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": path}, start_new_session=True)


def _url(process: subprocess.Popen[bytes]) -> str:
    """Return what the process says its page is at; raise RefusedError when it says nothing in time."""
    assert process.stdout is not None
    with process.stdout as said:
        ready = select.select([said], [], [], READY_S)[0]
        line = said.readline() if ready else b""
    told = json.loads(line) if line else {}
    if "url" in told:
        return str(told["url"])
    process.kill()
    process.wait()
    raise RefusedError("the live page does not start; nothing was output", value=told.get("error"),
                       do="run without --live, or see what `rig live` says of another recording")
