"""Does a recording keep every sample and every word, survive a killed process, and show any damage?"""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from identify.trace import Step
from rig.errors import FileError
from rig.plan import Plan
from rig.protocol import Limits
from rig.recording import Entry, Equipment, Event, Origin, Recording, Writer, read, write

EQUIPMENT = Equipment("loopback:", "loopback", "op-amp", "1", {"rate": "1000 Hz", "range": "±10 V"})


def a_plan(size: int = 40) -> Plan:
    half = size // 2
    steps = (Step("Größe", "hold", 0, half), Step("sine", "sine", half, size, 1))
    return Plan("a run", np.linspace(-1.0, 1.0, size), 1000.0, steps, Limits(-1.0, 1.0), protocol_text="spec: 1\n# µ\n",
                question="why?", rig_text="spec: 1\nrig: x\n")


def a_recording(size: int = 40) -> Recording:
    ledger = np.full(size, Entry.RECORDED, dtype=np.uint8)
    origin = Origin(EQUIPMENT, {"python": "3.11"}, "abc", "2026-11-21T00:00:00+00:00", "2026-11-21T00:00:01+00:00")
    return Recording("r", 1000.0, np.arange(float(size)), np.sin(np.arange(size)), ledger, origin,
                     u_measured=np.arange(float(size)) + 0.5, title="t", question="q", start_s=2.5, initial="in_motion",
                     intersample="linear", protocol_text="p", rig_text="r", reason="all there",
                     steps=(Step("a", "hold", 0, 10), Step("a", "hold", 10, size, 1)),
                     events=(Event("safe", "0 V", 3, 3),))


def same(one: Recording, other: Recording) -> bool:
    signals, others = one.inputs(), other.inputs()
    return (np.array_equal(one.u, other.u) and np.array_equal(one.ledger, other.ledger)
            and list(signals) == list(others)
            and all(np.array_equal(signals[name], others[name], equal_nan=True) for name in signals)
            and all(getattr(one, name) == getattr(other, name) for name in Recording.__dataclass_fields__
                    if name not in ("u", "y", "u_measured", "further", "ledger")))


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    write(path, a_recording())
    assert same(read(path), a_recording())
    assert os.listdir(tmp_path) == ["r.h5"]


def test_plain_h5py_reads_values_units_and_tables(tmp_path: Path) -> None:
    write(tmp_path / "r.h5", a_recording())
    with h5py.File(tmp_path / "r.h5") as file:
        assert file["u"][3] == 3.0
        assert file["y"].attrs["unit"] == "V"
        assert file.attrs["rate_hz"] == 1000.0
        assert file["protocol"].asstr()[()] == "p"
        assert file["device"].attrs["model"] == "loopback"
        assert file["device/settings"].attrs["range"] == "±10 V"
        assert file["steps"]["label"][1] == b"a"
        assert file["steps"]["stop"].tolist() == [10, 40]
        assert "1 recorded" in file["ledger"].attrs["description"]
        assert all("sha256" in file[name].attrs for name in ("u", "u_measured", "y", "ledger", "steps", "protocol"))


def test_a_run_is_recorded_block_by_block(tmp_path: Path) -> None:
    plan = a_plan()
    with Writer(tmp_path / "r.h5", plan, EQUIPMENT) as writer:
        for start in range(0, 40, 8):
            writer.append(start, plan.u[start:start + 8] * 2)
        made = writer.finish(True, "all 40 samples recorded", [Event("safe", "output at 0 V", 40, 40)])
    found = read(tmp_path / "r.h5")
    assert same(found, made)
    assert found.complete
    assert found.y.tolist() == (plan.u * 2).tolist()
    assert [found.count(entry) for entry in Entry] == [0, 40, 0]
    assert (found.protocol_text, found.rig_text, found.question) == (plan.protocol_text, plan.rig_text, "why?")
    assert found.steps[0].label == "Größe"
    assert found.origin.equipment == EQUIPMENT
    assert found.origin.started < found.origin.finished
    assert found.origin.software["numpy"] == np.__version__
    assert found.trace().valid is None


def test_all_inputs_of_a_run_are_kept_by_name(tmp_path: Path) -> None:
    plan = replace(a_plan(), inputs=("y", "v", "u_measured"))
    read_back = np.stack([plan.u * 3, plan.u + 0.5])
    with Writer(tmp_path / "r.h5", plan, EQUIPMENT) as writer:
        writer.append(0, plan.u[:10], read_back[:, :10])
        with pytest.raises(ValueError, match="1 inputs where 3 are recorded"):
            writer.append(10, plan.u[10:20])
        assert read_unfinished(tmp_path / "r.h5", "inputs/v")[:10].tolist() == read_back[0, :10].tolist()
        writer.append(20, plan.u[20:], read_back[:, 20:])
        made = writer.finish(False, "10 lost", [Event("lost", "10 samples", 10, 20)])
    found = read(tmp_path / "r.h5")
    assert same(found, made)
    assert list(found.inputs()) == ["y", "u_measured", "v"]
    assert found.u_measured is not None
    for kept, true in ((found.further["v"], read_back[0]), (found.u_measured, read_back[1])):
        assert np.array_equal(np.isnan(kept[:]), found.ledger != Entry.RECORDED)
        assert np.array_equal(kept[20:], true[20:])
    with h5py.File(tmp_path / "r.h5") as file:
        assert file["inputs/v"].attrs["unit"] == "V"
        assert "sha256" in file["inputs/v"].attrs


def test_damage_to_a_further_input_is_found(tmp_path: Path) -> None:
    path = tmp_path / "r.h5"
    write(path, replace(a_recording(), further={"w": np.arange(40.0)}))
    copied = tmp_path / "copied.h5"
    with h5py.File(path) as whole, h5py.File(copied, "w") as copy:
        copy.attrs.update(whole.attrs)
        for name in whole:
            whole.copy(name, copy)
    assert read(copied).further["w"][3] == 3.0
    with h5py.File(copied, "r+") as file:
        file["inputs/w"][3] = 3.5
    with pytest.raises(FileError, match="the dataset 'inputs/w' does not match its checksum"):
        read(copied)


def read_unfinished(path: Path, name: str) -> np.ndarray:
    """Return what another process finds of a dataset in a file that is being written."""
    program = "import sys, h5py; print(*h5py.File(sys.argv[1], locking=False)[sys.argv[2]][:])"
    told = subprocess.run([sys.executable, "-c", program, str(path), name], capture_output=True, text=True, check=True)
    return np.array(told.stdout.split(), dtype=np.float64)


def test_every_sample_of_an_incomplete_run_is_accounted_for(tmp_path: Path) -> None:
    with Writer(tmp_path / "r.h5", a_plan(), EQUIPMENT) as writer:
        writer.append(0, np.ones(10))
        writer.append(14, np.full(6, 5.0))
        lost = [Event("lost", "4 samples", 10, 14), Event("lost", "the tail", 20, 22)]
        writer.finish(False, "stopped by SIGINT", lost)
    found = read(tmp_path / "r.h5")
    assert not found.complete
    assert [found.count(entry) for entry in Entry] == [18, 16, 6]
    assert found.ledger[20:23].tolist() == [Entry.LOST, Entry.LOST, Entry.NOT_RECEIVED]
    assert np.isnan(found.y[found.ledger != Entry.RECORDED]).all()


def test_the_trace_ends_with_the_last_sample_and_bridges_the_lost(tmp_path: Path) -> None:
    with Writer(tmp_path / "r.h5", a_plan(), EQUIPMENT) as writer:
        writer.append(0, np.ones(10))
        writer.append(14, np.full(8, 6.0))
        trace = writer.finish(False, "stopped").trace()
    assert trace.size == 22
    assert trace.valid is not None
    assert np.flatnonzero(~trace.valid).tolist() == [10, 11, 12, 13]
    assert trace.y[9:15] == pytest.approx([1, 2, 3, 4, 5, 6])
    assert [(step.label, step.start, step.stop, step.repeat) for step in trace.steps] == [
        ("Größe", 0, 20, 0), ("sine", 20, 22, 1)]


def test_the_trace_knows_how_the_input_runs_and_whether_it_began_at_rest() -> None:
    trace = a_recording().trace()
    assert (trace.intersample, trace.start_s, trace.from_rest, trace.name) == ("linear", 2.5, False, "r")
    assert replace(a_recording(), initial="rest").trace().from_rest


def test_a_recording_without_samples_has_no_trace(tmp_path: Path) -> None:
    with Writer(tmp_path / "r.h5", a_plan(), EQUIPMENT) as writer:
        empty = writer.finish(False, "the device fell silent")
    with pytest.raises(FileError, match="r: no sample was recorded: the device fell silent"):
        empty.trace()


def test_samples_that_do_not_follow_are_refused(tmp_path: Path) -> None:
    with Writer(tmp_path / "r.h5", a_plan(), EQUIPMENT) as writer:
        writer.append(0, np.ones(10))
        for start, size in ((5, 2), (39, 2)):
            with pytest.raises(ValueError, match="do not follow"):
                writer.append(start, np.ones(size))


def test_a_recording_is_never_overwritten_unasked(tmp_path: Path) -> None:
    write(tmp_path / "r.h5", a_recording())
    with pytest.raises(FileError, match="there is a file of this name already; choose another name"):
        Writer(tmp_path / "r.h5", a_plan(), EQUIPMENT)
    with pytest.raises(FileError, match="already"):
        write(tmp_path / "r.h5", a_recording())
    write(tmp_path / "r.h5", replace(a_recording(), title="newer"), overwrite=True)
    assert read(tmp_path / "r.h5").title == "newer"


def test_a_place_that_cannot_be_written_is_named_before_anything_is_played(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="cannot be written: No such file or directory"):
        Writer(tmp_path / "none" / "r.h5", a_plan(), EQUIPMENT)
    with pytest.raises(FileError, match="cannot be written"):
        write(tmp_path / "none" / "r.h5", a_recording())


FULL = """
import resource, sys, numpy as np
from rig.errors import FileError
from rig.plan import Limits, Plan
from rig.recording import Equipment, Writer
writer = None
def fill():
    resource.setrlimit(resource.RLIMIT_FSIZE, (500_000, 500_000))
if sys.argv[2] == "start":
    fill()
try:
    plan = Plan("full", np.zeros(200_000), 1e4, (), Limits(-1, 1))
    writer = Writer(sys.argv[1], plan, Equipment("loopback:"), overwrite=True)
    writer.append(0, np.ones(1000))
    fill()
    print(writer.finish(True, "all").reason)
except FileError as error:
    print(error)
"""


@pytest.mark.parametrize(("when", "title", "recorded", "words"), [
    ("start", "t", 40, "{path}: cannot be written: File too large"),
    ("finish", "full", 1000, "all; the recording could not be finished: File too large"),
])
def test_a_full_disk_costs_neither_the_recording_before_nor_what_was_recorded(
    tmp_path: Path, when: str, title: str, recorded: int, words: str,
) -> None:
    path = tmp_path / "r.h5"
    write(path, a_recording())
    told = subprocess.run([sys.executable, "-c", FULL, str(path), when], capture_output=True, text=True, check=True)
    assert told.stdout.splitlines() == [words.format(path=path)]
    assert os.listdir(tmp_path) == ["r.h5"]
    assert (read(path).title, read(path).count(Entry.RECORDED)) == (title, recorded)


KILLED = """
import sys, numpy as np
from rig.plan import Limits, Plan
from rig.recording import Equipment, Writer
size = 200_000
plan = Plan("killed", np.zeros(size), 1e4, (), Limits(-1, 1), protocol_text="text")
writer = Writer(sys.argv[1], plan, Equipment("loopback:"))
for start in range(0, size, 50):
    writer.append(start, np.arange(start, start + 50, dtype=float))
    print(start + 50, flush=True)
"""


@pytest.mark.parametrize("after", [1, 37, 400])
def test_a_killed_process_leaves_all_it_reported_and_a_file_that_opens(tmp_path: Path, after: int) -> None:
    path = tmp_path / "r.h5"
    with subprocess.Popen([sys.executable, "-c", KILLED, str(path)], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        for _ in range(after):
            process.stdout.readline()
        os.kill(process.pid, signal.SIGKILL)
        last = int(([str(50 * after), *process.stdout.read().split()])[-1])
    found = read(path)
    recorded = found.count(Entry.RECORDED)
    assert recorded >= last >= 50 * after
    assert found.ledger[:recorded].all()
    assert np.array_equal(found.y[:recorded], np.arange(recorded, dtype=float))
    assert (found.complete, found.origin.finished) == (False, "")
    assert found.trace().size == recorded
    with h5py.File(path) as file:
        assert file["protocol"].asstr()[()] == "text"


def test_a_run_stopped_while_it_is_closed_is_still_readable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(self: Path, target: Path) -> None:
        raise KeyboardInterrupt

    writer = Writer(tmp_path / "r.h5", a_plan(), EQUIPMENT)
    writer.append(0, np.ones(40))
    monkeypatch.setattr(Path, "replace", stop)
    with pytest.raises(KeyboardInterrupt):
        writer.finish(True, "all")
    assert read(tmp_path / "r.h5").count(Entry.RECORDED) == 40


def test_a_recording_being_written_is_read_as_far_as_it_is_and_says_so(tmp_path: Path) -> None:
    command = [sys.executable, "-c", KILLED + "\nsys.stdin.read()\n", str(tmp_path / "r.h5")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        process.stdout.readline()
        found = read(tmp_path / "r.h5")
        assert (found.complete, found.reason) == (False, "still being written")
        assert found.count(Entry.RECORDED) >= 50
        with h5py.File(tmp_path / "r.h5") as file:
            assert file["y"][49] == 49.0
        with pytest.raises(BlockingIOError):
            h5py.File(tmp_path / "r.h5", "r+")
        with pytest.raises(FileError, match="another program is recording into this file"):
            write(tmp_path / "r.h5", a_recording(), overwrite=True)
        process.kill()
    assert read(tmp_path / "r.h5").reason == "the program ended before the run did"


@pytest.mark.parametrize(("content", "message"), [
    (b"", "the recording is empty: 0 bytes"),
    (b"time,u,y\n0,1,2\n", "not an HDF5 file; bring tables in with 'rig import'"),
    (b"\x89HDF\r\n\x1a\n", "damaged or truncated recording"),
])
def test_a_file_that_is_no_recording_is_told_apart(tmp_path: Path, content: bytes, message: str) -> None:
    (tmp_path / "r.h5").write_bytes(content)
    with pytest.raises(FileError, match=message):
        read(tmp_path / "r.h5")


def test_a_missing_recording_and_a_folder(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no such recording"):
        read(tmp_path / "r.h5")
    with pytest.raises(FileError, match="not a file"):
        read(tmp_path)


@pytest.mark.parametrize(("schema", "message"), [(None, "no schema"), ("rig.recording/x", "rig.recording/x; allowed")])
def test_foreign_hdf5_is_refused(tmp_path: Path, schema: str | None, message: str) -> None:
    with h5py.File(tmp_path / "r.h5", "w") as file:
        file["data"] = [1, 2, 3]
        if schema:
            file.attrs["schema"] = schema
    with pytest.raises(FileError, match=f"not a recording of this program: {message}"):
        read(tmp_path / "r.h5")


def test_a_change_of_any_byte_is_found_before_the_file_is_opened(tmp_path: Path) -> None:
    write(tmp_path / "r.h5", a_recording())
    with h5py.File(tmp_path / "r.h5", "r+") as file:
        file["y"][7] = 9
    with pytest.raises(FileError, match="damaged or truncated recording: the bytes do not match their checksum"):
        read(tmp_path / "r.h5")


def unsealed(path: Path) -> Path:
    """Write a recording as a tool leaves it that copied the HDF5 part alone."""
    write(path, a_recording(), overwrite=True)
    path.write_bytes(path.read_bytes()[512:])
    return path


def test_a_copy_without_its_user_block_is_read(tmp_path: Path) -> None:
    assert same(read(unsealed(tmp_path / "r.h5")), a_recording())


@pytest.mark.parametrize("name", ["u", "y", "ledger", "u_measured"])
def test_a_changed_value_is_found(tmp_path: Path, name: str) -> None:
    unsealed(tmp_path / "r.h5")
    with h5py.File(tmp_path / "r.h5", "r+") as file:
        file[name][7] = 9
    with pytest.raises(FileError, match=f"damaged.*the dataset '{name}' does not match its checksum"):
        read(tmp_path / "r.h5")


@pytest.mark.parametrize(("group", "name", "value"), [
    ("/", "rate_hz", 999.0), ("/", "initial", "rest"), ("device", "serial", "2"), ("software", "python", "2.7"),
])
def test_a_changed_attribute_is_found(tmp_path: Path, group: str, name: str, value: object) -> None:
    unsealed(tmp_path / "r.h5")
    with h5py.File(tmp_path / "r.h5", "r+") as file:
        file[group].attrs[name] = value
    with pytest.raises(FileError, match="the attributes do not match their checksum"):
        read(tmp_path / "r.h5")


def test_a_changed_text_and_a_missing_part_are_found(tmp_path: Path) -> None:
    unsealed(tmp_path / "r.h5")
    with h5py.File(tmp_path / "r.h5", "r+") as file:
        file["protocol"][()] = "other"
    with pytest.raises(FileError, match="the dataset 'protocol' does not match"):
        read(tmp_path / "r.h5")
    unsealed(tmp_path / "r.h5")
    with h5py.File(tmp_path / "r.h5", "r+") as file:
        del file["ledger"]
    with pytest.raises(FileError, match="damaged or truncated recording"):
        read(tmp_path / "r.h5")


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.data())
def test_no_damage_to_bytes_escapes_as_anything_but_a_file_error(tmp_path: Path, data: st.DataObject) -> None:
    """Whatever bytes are changed: the file is refused, and the library that could crash on it never sees it."""
    good, bad = tmp_path / "good.h5", tmp_path / "r.h5"
    if not good.exists():
        write(good, a_recording())
    content = bytearray(good.read_bytes())
    if data.draw(st.booleans()):
        content = content[:data.draw(st.integers(1, len(content) - 1))]
    else:
        for _ in range(data.draw(st.integers(1, 3))):
            content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    bad.write_bytes(content)
    if bytes(content) == good.read_bytes():  # two flips of one byte may undo each other
        return
    with pytest.raises(FileError):
        read(bad)


@pytest.mark.parametrize("change", [
    {"y": np.zeros(39)}, {"rate_hz": 0.0}, {"rate_hz": float("nan")}, {"y": np.full(40, np.nan)},
    {"u": np.full(40, np.inf)}, {"ledger": np.ones(41, dtype=np.uint8)}, {"u_measured": np.zeros(3)},
])
def test_what_cannot_be_a_recording_is_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"samples|rate|finite"):
        replace(a_recording(), **change)  # type: ignore[arg-type]


def test_samples_cannot_be_changed_after_reading() -> None:
    with pytest.raises(ValueError, match="read-only"):
        a_recording().y[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        a_recording().ledger[0] = 1
