"""Does a table from elsewhere become a recording like our own?"""

import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from rig.recording import read
from tests.flow.console import here, refused


@pytest.fixture
def table(tmp_path: Path) -> str:
    rows = "".join(f"{k / 1000:.3f},{np.sin(0.1 * k):.6f},{np.cos(0.1 * k):.6f}\n" for k in range(500))
    (tmp_path / "scope.csv.gz").write_bytes(gzip.compress(f"Time,DAC,ADC\n{rows}".encode()))
    return "scope.csv.gz"


def test_columns_may_be_named(tmp_path: Path, table: str) -> None:
    ended = here("import", table, "--time", "Time", "--input", "DAC", "--output", "ADC", "--out", "a.h5",
                "--rig", "rigs/opamp_backlash.yaml", cwd=tmp_path)  # fmt: skip
    assert ended.code == 0, ended
    assert "500 samples at 1000 Hz" in ended.out
    kept = read(tmp_path / "a.h5")
    assert kept.rate_hz == 1000.0
    assert kept.y[1] == pytest.approx(np.cos(0.1), abs=1e-6)
    assert "op-amp" in kept.rig_text


def test_columns_may_be_numbered_and_rows_chosen(tmp_path: Path, table: str) -> None:
    options = ("--input", "2", "--output", "3", "--rate", "1000", "--intersample", "linear")
    ended = here("import", table, *options, "--rows", "100:300", "--out", "a.h5", cwd=tmp_path)
    assert ended.code == 0, ended
    kept = read(tmp_path / "a.h5")
    assert kept.u.size == 200
    assert kept.u[0] == pytest.approx(np.sin(10.0), abs=1e-6)
    assert kept.intersample == "linear"
    assert kept.initial == "in_motion"


def test_a_wrong_range_of_rows_is_refused(tmp_path: Path, table: str) -> None:
    ended = here("import", table, "--input", "2", "--output", "3", "--rate", "1000", "--rows", "5-9", "--out", "a.h5",
                cwd=tmp_path)  # fmt: skip
    assert ended.code == 2
    assert "FIRST:STOP" in ended.err


def test_an_imported_linear_circuit_is_identified_with_its_rig(tmp_path: Path) -> None:
    u = np.repeat(np.random.default_rng(2).uniform(-1.0, 1.0, 60), 50)
    y = np.zeros(u.size)
    for k in range(1, u.size):
        y[k] = 0.9 * y[k - 1] + 0.1 * 0.93 * u[k - 1]
    noisy = y + 1e-3 * np.random.default_rng(3).standard_normal(u.size)
    rows = "".join(f"{a:.6f},{b:.6f}\n" for a, b in zip(u, noisy, strict=True))
    (tmp_path / "t.csv").write_text(f"u,y\n{rows}")
    (tmp_path / "rig.yaml").write_text(
        "spec: 1\nrig: lag\nG1: {num: [1], den: [0.02, 1]}\nF: linear\nG2: {num: [1], den: [1]}\nnoise: 1 mV\n"
    )
    columns = ("--input", "u", "--output", "y", "--rate", "1000", "--rig", "rig.yaml")
    assert here("import", "t.csv", *columns, "--out", "t.h5", cwd=tmp_path).code == 0
    ended = here("identify", "t.h5", "--json", "t.json", cwd=tmp_path)
    assert ended.code == 0, ended
    assert "F is a straight line: w = 0.9" in ended.out
    found = json.loads((tmp_path / "t.json").read_text(encoding="utf-8"))
    assert found["backlash"] is None
    # a lag whose step response falls by 0.9 a sample of 1 ms
    assert found["G1"]["rational"]["den"][0] == pytest.approx(-1e-3 / np.log(0.9), rel=0.01)
    assert float(found["model"]["F"]["linear"]["gain"]) == pytest.approx(0.93, rel=0.005)


def test_a_recording_goes_out_and_comes_back(tmp_path: Path, recording: Path) -> None:
    out = tmp_path / "out.csv"
    ended = here("export", recording, "--to", "csv", "--out", out, cwd=tmp_path)
    assert ended.code == 0, ended
    assert f"back with `rig import {out} --out RUN.h5`" in ended.out
    assert here("import", out, "--out", "back.h5", cwd=tmp_path).code == 0
    assert (tmp_path / "back.h5").read_bytes() == recording.read_bytes()


def test_what_was_understood_and_what_is_lost_is_said(tmp_path: Path) -> None:
    rows = "".join(f"{k};{k % 5};{1000 * np.sin(k / 9):.3f}\n".replace(".", ",") for k in range(300) if k != 90)
    (tmp_path / "scope.csv").write_text(f"Time (ms);u;y [mV]\n{rows}")
    columns = ("--time", "Time", "--input", "u", "--output", "y", "--out", "a.h5")
    refused(here("import", "scope.csv", *columns, cwd=tmp_path), 2, "scope.csv:92: the time base is broken: 0.091 s",
            "in all 1 x gap", "--gaps lost")  # fmt: skip
    ended = here("import", "scope.csv", *columns, "--gaps", "lost", cwd=tmp_path)
    assert ended.code == 0, ended
    assert "300 samples at 1000 Hz" in ended.out
    assert "understood  decimal commas, first in line 2" in ended.out
    assert "understood  y in mV, of which one is 0.001 V" in ended.out
    assert "lost  the table lacks 1 samples in 1 gaps of the times, where u is taken as held" in ended.out
