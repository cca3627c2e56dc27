"""Which files, as good as they are written, are there to be damaged? Small ones, made by the program itself."""

import io
import tempfile
from contextlib import redirect_stdout
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from rig.cli import run_line
from tests.rigs import CABLE

RIG = """\
spec: 1
rig: a lag
G1: {num: [1], den: [0.01, 1]}
F: {linear: {gain: 2, offset: 0 V}}
G2: {num: [1], den: [1]}
noise: 10 mV
"""
PROTOCOL = """\
spec: 1
title: short
question: Is it read?
rig: rig.yaml
limits: {level: 9 V}
acquisition: {rate: 4 kHz}
steps:
  - hold: {level: 0 V, time: 10 ms}
  - {repeats: 2, sine: {frequency: 20 Hz, amplitude: 2 V, periods: 3}}
  - staircase: {levels: [1 V, {from: 0 V, to: 2 V, step: 0.5 V}], dwell: 10 ms}
  - triangle: {frequency: 10 Hz, amplitude: 1 V, periods: 1}
  - multisine: {frequencies: [10 Hz, 30 Hz], periods: 1, peak: 1 V}
  - table: {file: {path: t.csv}, between: linear}
"""
TABLE = "time,level\n0,0\n0.05,1\n0.1,0\n"
CHECK = ("check", "p.yaml")


@dataclass(frozen=True)
class Originals:
    """A recording, an answer of ``rig identify`` to it, a calibration, and tables of its u and y in other forms."""

    run: bytes
    answer: bytes
    calibration: bytes


@cache
def originals() -> Originals:
    """Return the files, made once; raise AssertionError where a command fails."""
    with tempfile.TemporaryDirectory() as name, redirect_stdout(io.StringIO()):
        folder = Path(name)
        for file, text in (("p.yaml", PROTOCOL), ("rig.yaml", RIG), ("t.csv", TABLE), ("cable.yaml", CABLE)):
            (folder / file).write_text(text)
        run, answer, known = folder / "run.h5", folder / "answer.json", folder / "c.json"
        _typed("run", folder / "p.yaml", "--out", run, "--quiet")
        _typed("identify", run, "--json", answer, "--quiet")
        _typed("calibrate", f"loopback:{folder / 'cable.yaml'}", "--out", known, "--quiet")
        return Originals(run.read_bytes(), answer.read_bytes(), known.read_bytes())


def _typed(*line: str | Path) -> None:
    assert run_line([str(word) for word in line]) == 0
