"""Which recordings, rig and names reach identification, and do answers reach the disk whole?"""

import json
import os
import pty
import subprocess
import threading
from pathlib import Path

import numpy as np
import pytest

from rig import workflow
from rig.errors import FileError, UsageError
from rig.outputs import check_destination, json_text, write_text
from rig.recorded import Equipment, Origin, Recording, complete_ledger
from rig.recording import write
from rig.session import shipped
from tests.flow.console import COMMAND, protocol

RIG = """\
spec: 1
rig: plain
G1: {num: [1], den: [1.0e-3, 1]}
F: linear
G2: {num: [1], den: [1]}
noise: 1 mV
"""


def kept(path: Path, rig_text: str = RIG) -> Path:
    """Write a recording of 50 samples."""
    path.parent.mkdir(exist_ok=True)
    u = np.linspace(0.0, 1.0, 50)
    origin = Origin(Equipment("nowhere"), started="2026-01-01", finished="2026-01-01")
    write(path, Recording(path.stem, 1000.0, u, u, complete_ledger(50), origin, rig_text=rig_text))
    return path


def test_the_rig_of_the_recordings_is_used(tmp_path: Path) -> None:
    assert workflow.load([kept(tmp_path / "a.h5")]).model.title == "plain"


def test_a_rig_that_is_named_goes_before_the_recordings_own(tmp_path: Path) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(RIG.replace("plain", "other"))
    assert workflow.load([kept(tmp_path / "a.h5")], other).model.title == "other"


def test_recordings_without_one_rig_are_refused(tmp_path: Path) -> None:
    a, b = kept(tmp_path / "a.h5"), kept(tmp_path / "b.h5", RIG.replace("plain", "other"))
    with pytest.raises(FileError, match="different rigs"):
        workflow.load([a, b])
    with pytest.raises(FileError, match="no rig is known"):
        workflow.load([kept(tmp_path / "c.h5", "")])


def test_a_rig_file_worded_otherwise_or_concealing_something_else_is_the_same_rig(tmp_path: Path) -> None:
    a = kept(tmp_path / "a.h5", f"# as built\n{RIG}")
    b = kept(tmp_path / "b.h5", f"{RIG}concealed: {{gain_drift: {{rate: 0.1 1/s}}}}\n")
    assert len(workflow.load([a, b]).traces) == 2
    with pytest.raises(FileError, match="different rigs"):
        workflow.load([a, kept(tmp_path / "c.h5", f"{RIG}amplifier: {{gain: 10, range: 10 V}}\n")])


def test_a_broken_rig_in_a_recording_is_named_with_its_file(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"a\.h5 \(the rig in it\):1.*unknown key 'spec_'"):
        workflow.load([kept(tmp_path / "a.h5", RIG.replace("spec", "spec_"))])


def test_runs_of_one_name_are_told_apart(tmp_path: Path) -> None:
    paths = [
        kept(tmp_path / folder / f"{name}.h5") for folder, name in (("a", "r"), ("b", "r"), ("a", "r-2"), ("c", "r"))
    ]
    loaded = workflow.load(paths[:3], hold_out=paths[3:])
    names = [trace.name for trace in (*loaded.traces, *loaded.held_out)]
    assert names == ["r", "r-3", "r-2", "r-4"]


def test_a_run_held_out_is_not_fitted_and_a_run_given_twice_counts_once(tmp_path: Path) -> None:
    a, b = kept(tmp_path / "a.h5"), kept(tmp_path / "b.h5")
    loaded = workflow.load([a, b, a, tmp_path / "." / "b.h5"], hold_out=[b])
    assert [trace.name for trace in loaded.traces] == ["a"]
    assert [trace.name for trace in loaded.held_out] == ["b"]
    with pytest.raises(UsageError, match="no run is left"):
        workflow.load([b], hold_out=[b])


def test_a_sentence_of_identification_becomes_an_error_about_the_files(tmp_path: Path) -> None:
    runs = workflow.load([kept(tmp_path / "a.h5", RIG.replace("noise: 1 mV\n", ""))])
    for answer in (workflow.identify_runs, workflow.explain_runs):
        with pytest.raises(FileError, match=r"^a: .*the noise cannot be told"):
            answer(runs)


def test_a_simulation_is_written_beside_the_recording(tmp_path: Path) -> None:
    played = workflow.simulate(kept(tmp_path / "a.h5"))
    table = np.array([line.split(",") for line in played.to_csv().splitlines()[1:]], dtype=float)
    assert table.shape == (50, 4)
    # held: y[k] is read before u[k] acts, so a first-order lag answers the ramp with u[k-1] one time constant late
    decay = np.exp(-1.0)
    expected = np.zeros(50)
    for k in range(1, 50):
        expected[k] = decay * expected[k - 1] + (1.0 - decay) * table[k - 1, 1]
    np.testing.assert_allclose(table[:, 3], expected, atol=1e-9)


def test_protocols_are_found_as_given_before_those_that_come_along(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert shipped("protocols/demo.yaml").is_absolute()
    assert shipped("rigs/opamp_backlash.yaml").is_file()
    (tmp_path / "demo.yaml").write_text("mine")
    assert shipped("demo.yaml") == Path("demo.yaml")


def test_a_file_is_replaced_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "answer.json"
    write_text(path, "old")

    def full(*rest: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "replace", full)
    with pytest.raises(FileError, match="No space left"):
        write_text(path, "new")
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["answer.json"]


def test_a_written_file_may_be_read_by_whom_the_system_says(tmp_path: Path) -> None:
    (tmp_path / "usual").write_text("")
    write_text(tmp_path / "ours", "")
    assert (tmp_path / "ours").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_a_destination_is_refused_before_the_work(tmp_path: Path) -> None:
    check_destination(tmp_path / "new.json")
    for wrong in (tmp_path, tmp_path / "no" / "folder.json"):
        with pytest.raises(UsageError):
            check_destination(wrong)


def test_json_has_no_infinity() -> None:
    assert json.loads(json_text({"µ": 1.5})) == {"µ": 1.5}
    with pytest.raises(ValueError, match="JSON"):
        json_text({"x": float("inf")})


def on_a_terminal(*arguments: str, cwd: Path) -> str:
    """Return what a command writes to stderr when that is a terminal."""
    ours, theirs = pty.openpty()
    held: list[bytes] = []

    def listen() -> None:
        while True:
            try:
                held.append(os.read(ours, 65536))
            except OSError:
                return

    listener = threading.Thread(target=listen)
    listener.start()
    subprocess.run([*COMMAND, *arguments], cwd=cwd, stderr=theirs, stdout=subprocess.DEVNULL, timeout=60, check=True,
                   env={**os.environ, "TERM": "xterm", "COLUMNS": "100"})  # fmt: skip
    os.close(theirs)
    listener.join()
    os.close(ours)
    return b"".join(held).decode()


def test_progress_is_shown_on_a_terminal_unless_quiet(tmp_path: Path) -> None:
    protocol(tmp_path)
    shown = on_a_terminal("run", "short.yaml", cwd=tmp_path)
    assert "recording" in shown
    assert "100%" in shown
    assert "0:00:00" in shown
    assert not on_a_terminal("run", "short.yaml", "--overwrite", "--quiet", cwd=tmp_path)
