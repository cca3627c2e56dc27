"""Is a recording that went out as CSV, MAT or NPZ and came back the same, and is any change on the way found?"""

import json
import tracemalloc
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from scipy.io import loadmat

from identify.trace import Step, Stored
from rig.errors import FileError
from rig.exported import note_of
from rig.exporters import KINDS, as_mat, export
from rig.importers import Asked, read_table
from rig.progress import Show
from rig.recorded import Entry, Equipment, Event, Origin, Recording
from rig.recording import read, write

WORDS = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]), max_size=12)
ANY_BITS = arrays.arrays(np.uint64, 20).map(lambda bits: bits.view(np.float64))
FINITE = arrays.arrays(np.float64, 20, elements=st.floats(allow_nan=False, allow_infinity=False))


@st.composite
def recordings(draw: Callable[[Any], Any]) -> Recording:
    """Return any recording of 20 samples: what was not recorded may be any bits."""
    ledger = draw(arrays.arrays(np.uint8, 20, elements=st.sampled_from([0, 1, 2])))
    inputs = [np.where(ledger == Entry.RECORDED, draw(FINITE), draw(ANY_BITS)) for _ in range(4)]
    equipment = Equipment(*draw(st.tuples(*[WORDS] * 4)), settings={"range": draw(WORDS)}, calibration=draw(WORDS))
    origin = Origin(equipment, {"numpy": draw(WORDS)}, draw(WORDS), draw(WORDS), "2026-11-22T00:00:00+00:00")
    return Recording(
        "run", draw(st.floats(1e-6, 1e9)), draw(FINITE), inputs[0], ledger, origin, u_measured=inputs[1],
        further={"ledger": inputs[2], "v": inputs[3]}, start_s=draw(st.floats(-1e6, 1e6)), title=draw(WORDS),
        question=draw(WORDS), protocol_text=draw(WORDS), rig_text=draw(WORDS), reason=draw(WORDS),
        intersample=draw(st.sampled_from(["held", "linear", "bandlimited"])), complete=draw(st.booleans()),
        initial=draw(st.sampled_from(["rest", "in_motion"])), steps=(Step(draw(WORDS), "hold", 0, 9, 2),),
        events=(Event("lost", draw(WORDS), 3, 4),),
    )


def back(folder: Path, kind: str) -> Path:
    """Export the recording, import what was exported, and return where that is."""
    export(folder / "run.h5", kind, folder / f"run.{kind}", overwrite=True)
    write(folder / "back.h5", read_table(folder / f"run.{kind}", Asked()), overwrite=True)
    return folder / "back.h5"


@pytest.mark.parametrize("kind", KINDS)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=12, deadline=None)
@given(made=recordings())
def test_what_comes_back_is_the_same_file_byte_for_byte(tmp_path: Path, kind: str, made: Recording) -> None:
    write(tmp_path / "run.h5", made, overwrite=True)
    assert back(tmp_path, kind).read_bytes() == (tmp_path / "run.h5").read_bytes()


@pytest.mark.parametrize("kind", KINDS)
def test_a_long_recording_goes_both_ways_by_stretches(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str,
) -> None:
    write(tmp_path / "run.h5", a_recording())
    for place in ("rig.recordingfile.AT_ONCE", "rig.spool.LONG", "rig.exporters.as_mat.LONGEST_5"):
        monkeypatch.setattr(place, 64)
    monkeypatch.setattr("identify.trace.blocks.__defaults__", (50,))
    monkeypatch.setattr("rig.readers.text.AT_ONCE", 999)
    assert isinstance(read(tmp_path / "run.h5").y, Stored)
    assert back(tmp_path, kind).read_bytes() == (tmp_path / "run.h5").read_bytes()


@pytest.mark.parametrize("kind", ["mat", "npz"])
def test_no_array_of_numbers_is_as_long_as_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str,
) -> None:
    size, stretch = 300_000, 1 << 12
    write(tmp_path / "run.h5", a_recording(size))
    for place in ("rig.recordingfile.AT_ONCE", "rig.spool.LONG", "rig.exporters.as_mat.LONGEST_5",
                  "rig.readers.npz.AT_ONCE", "rig.recorded.LOOKED_AT"):
        monkeypatch.setattr(place, stretch)
    monkeypatch.setattr("identify.trace.blocks.__defaults__", (stretch,))
    back(tmp_path, kind)  # what is imported once
    tracemalloc.start()
    try:
        back(tmp_path, kind)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 8 * size  # a signal; the checksum of the whole file is made of pieces of 1 MB


def a_recording(size: int = 333) -> Recording:
    random = np.random.default_rng(0)
    ledger = np.full(size, Entry.RECORDED, dtype=np.uint8)
    ledger[40:44] = Entry.LOST
    y = np.where(ledger == Entry.RECORDED, random.standard_normal(size), np.nan)
    origin = Origin(Equipment("loopback:"), {"numpy": "2"}, "abc", "2026-11-22", "2026-11-22")
    return Recording("run", 12_345.678, random.standard_normal(size), y, ledger, origin, start_s=0.1,
                     further={"v": np.where(ledger == Entry.RECORDED, 0.25, np.nan)})


def test_every_field_of_a_recording_is_in_the_note_or_among_the_signals() -> None:
    told = json.loads(note_of(a_recording()))
    assert {*told["recording"], "u", "y", "u_measured", "further", "ledger"} == {f.name for f in fields(Recording)}
    assert {*told["recording"]["origin"]} == {f.name for f in fields(Origin)}
    assert {*told["recording"]["origin"]["equipment"]} == {f.name for f in fields(Equipment)}


def test_other_programs_read_what_was_exported(tmp_path: Path) -> None:
    made = a_recording()
    write(tmp_path / "run.h5", made)
    for kind in KINDS:
        export(tmp_path / "run.h5", kind, tmp_path / f"run.{kind}")
    with np.load(tmp_path / "run.npz", allow_pickle=False) as held:
        assert np.array_equal(held["y"], made.y, equal_nan=True)
        assert float(held["rate_hz"]) == made.rate_hz
    matlab = loadmat(tmp_path / "run.mat")
    assert matlab["u"].shape == (333, 1)
    assert np.array_equal(matlab["u"][:, 0], made.u)
    assert json.loads(matlab["recording"][0])["recording"]["rate_hz"] == made.rate_hz
    plain = np.genfromtxt(tmp_path / "run.csv", delimiter=",", skip_header=header(tmp_path / "run.csv") + 1)
    assert np.array_equal(plain[:, 1], made.u)
    assert np.array_equal(plain[:, 0], 0.1 + np.arange(333) / made.rate_hz)
    assert np.array_equal(plain[:, 4], made.ledger)


def header(path: Path) -> int:
    return next(at for at, line in enumerate(path.read_text().splitlines()) if not line.startswith("#"))


@pytest.mark.parametrize("at", [0, 1, 2, 3, 4])
def test_a_cell_of_the_csv_that_was_changed_is_found(tmp_path: Path, at: int) -> None:
    write(tmp_path / "run.h5", a_recording())
    path = tmp_path / "run.csv"
    export(tmp_path / "run.h5", "csv", path)
    lines = path.read_text().splitlines()
    row = lines[header(path) + 8].split(",")
    row[at] = "2" if at == 4 else f"{float(row[at]) + 1e-9!r}"
    lines[header(path) + 8] = ",".join(row)
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(FileError, match=r"changed since it was exported: the .*; export it again"):
        read_table(path, Asked())
    assert read_table(path, Asked(input="u", output="y", time="t", gaps_lost=True)).u.size == 333


@pytest.mark.parametrize("kind", KINDS)
def test_any_byte_that_was_changed_is_found_or_is_of_no_account(tmp_path: Path, kind: str) -> None:
    """Comments, and what archives keep of dates and permissions, are of no account: the recording is then the same."""
    write(tmp_path / "run.h5", a_recording(40))
    whole = back(tmp_path, kind).read_bytes()
    path = tmp_path / f"run.{kind}"
    data = path.read_bytes()
    for at in range(0, len(data), 37):
        path.write_bytes(data[:at] + bytes([data[at] ^ (1 << at % 8)]) + data[at + 1 :])
        try:
            found = read_table(path, Asked())
        except FileError as error:
            assert "\n" not in str(error)  # noqa: PT017
            continue
        except Exception as error:
            assert "which columns are u and y" in str(error), (at, error)  # noqa: PT017
            continue
        write(tmp_path / "back.h5", found, overwrite=True)
        assert (tmp_path / "back.h5").read_bytes() == whole, at


def test_an_export_of_a_later_version_is_refused(tmp_path: Path) -> None:
    write(tmp_path / "run.h5", a_recording())
    export(tmp_path / "run.h5", "csv", tmp_path / "run.csv")
    text = (tmp_path / "run.csv").read_text().replace("rig.export/1", "rig.export/2")
    (tmp_path / "run.csv").write_text(text)
    with pytest.raises(FileError, match=r"exported by another version of this program: rig\.export/2; allowed: rig\."):
        read_table(tmp_path / "run.csv", Asked())


def test_an_incomplete_run_stays_one(tmp_path: Path) -> None:
    write(tmp_path / "run.h5", replace(a_recording(), complete=False, reason="stopped"))
    export(tmp_path / "run.h5", "npz", tmp_path / "run.npz")
    found = read_table(tmp_path / "run.npz", Asked())
    assert (found.complete, found.reason) == (False, "stopped")


def test_nothing_is_written_over_and_nothing_half(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write(tmp_path / "run.h5", a_recording())
    for path, overwrite in ((tmp_path / "run.h5", True), (tmp_path / "there.mat", False)):
        path.touch()
        with pytest.raises(FileError, match="there is a file of this name already"):
            export(tmp_path / "run.h5", "mat", path, overwrite)

    def full(path: Path, recording: Recording, show: Show) -> None:
        path.write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setitem(KINDS, "mat", full)
    with pytest.raises(FileError, match=r"there\.mat: cannot be written: No space left on device"):
        export(tmp_path / "run.h5", "mat", tmp_path / "there.mat", overwrite=True)
    assert (tmp_path / "there.mat").read_bytes() == b""
    assert not list(tmp_path.glob("*.part"))


def test_matlab_finds_its_own_marks_in_version_7_3(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(as_mat, "LONGEST_5", 10)
    write(tmp_path / "run.h5", a_recording())
    export(tmp_path / "run.h5", "mat", tmp_path / "run.mat")
    head = (tmp_path / "run.mat").read_bytes()[:128]
    assert head.startswith(b"MATLAB 7.3 MAT-file")
    assert head[124:128] == b"\x00\x02IM"
