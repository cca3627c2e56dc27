"""How does a test type a command and look at what came back?"""

import os
import subprocess
import sys
from contextlib import chdir, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path

from rig.cli import run_line

COMMAND = (sys.executable, "-m", "rig.cli")
LIMIT_S = 120.0


@dataclass(frozen=True)
class Ended:
    """How a command ended: its exit code and what it wrote."""

    code: int
    out: str
    err: str


def rig(*arguments: str | Path, cwd: Path, limit_s: float = LIMIT_S) -> Ended:
    """Return how ``rig ARGUMENTS`` ended, typed in the folder ``cwd``; raise after ``limit_s``."""
    done = subprocess.run(
        [*COMMAND, *map(str, arguments)], cwd=cwd, capture_output=True, text=True, timeout=limit_s, check=False
    )
    return Ended(done.returncode, done.stdout, done.stderr)


def here(*arguments: str | Path, cwd: Path) -> Ended:
    """Return how ``rig ARGUMENTS`` ended, typed in the folder ``cwd``, in this process: ten times as fast."""
    with chdir(cwd), redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        code = run_line([str(a) for a in arguments])
    return Ended(code, out.getvalue(), err.getvalue())


def start(*arguments: str | Path, cwd: Path) -> subprocess.Popen[str]:
    """Return ``rig ARGUMENTS`` while it runs."""
    return subprocess.Popen(
        [*COMMAND, *map(str, arguments)], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip


def refused(ended: Ended, code: int, *words: str) -> None:
    """Assert that a command ended with ``code`` and one message, without traceback, that holds all ``words``."""
    assert ended.code == code, ended
    assert ended.err.startswith("rig: ")
    assert ended.err.count("\n") == 1
    assert "Traceback" not in ended.err
    assert not ended.out
    for word in words:
        assert word in ended.err


PROTOCOL = """\
spec: 1
title: short
question: Does the slice hold from the wire to the answer?
rig: rigs/opamp_backlash.yaml
limits: {level: 10 V}
acquisition: {rate: 4 kHz}
steps:
  - staircase:
      levels: [{from: -3 V, to: 3 V, step: 0.5 V}, {from: 2.5 V, to: -3.5 V, step: 0.5 V}]
      scale: 0.6
      dwell: {settle: 0.1 %, hold: 70 ms}
  - {repeats: 2, sine: {frequency: 10 Hz, amplitude: 5 V, periods: 3}}
  - {repeats: 2, sine: {frequency: 40 Hz, amplitude: 9.5 V, periods: 6}}
"""
"""A short protocol on the op-amp rig; line 9 opens the levels, line 12 is the sine of 10 Hz."""


def protocol(folder: Path, *changes: tuple[str, str], name: str = "short.yaml") -> Path:
    """Return a file with the short protocol, some of its text replaced."""
    text = PROTOCOL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / name
    path.write_text(text)
    return path
