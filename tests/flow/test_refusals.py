"""Is everything wrong refused before any output or answer, in one message a bench operator can act on?"""

from pathlib import Path

import h5py
import pytest

from tests.flow.console import here, protocol, refused, rig

WRONG = [
    ("unit missing", ("amplitude: 5 V", "amplitude: 5"), 2, ("short.yaml:12: steps[1].sine.amplitude", "'5 V'")),
    (
        "over the limit",
        ("amplitude: 9.5 V", "amplitude: 12 V"),
        1,
        ("short.yaml:13: steps[2].sine", "12 V", "-10 to 10 V"),
    ),
    (
        "rate out of reach",
        ("4 kHz", "10 MHz"),
        1,
        ("short.yaml:6: acquisition.rate", "1e+07 Hz", "1e+06 Hz", "change"),
    ),
    ("unknown key", ("periods: 6", "period: 6"), 2, ("short.yaml:13: steps[2].sine.period", "did you mean 'periods'?")),
    ("beyond the device", ("limits: {level: 10 V}", "limits: {low: -12 V, high: 12 V}"), 1, ("short.yaml:13", "10 V")),
]


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize(("change", "code", "words"), [row[1:] for row in WRONG], ids=[row[0] for row in WRONG])
def test_a_wrong_protocol_is_refused_before_any_output(
    tmp_path: Path, command: str, change: tuple[str, str], code: int, words: tuple[str, ...]
) -> None:
    changes = [change, ("amplitude: 9.5 V", "amplitude: 11 V")] if "low" in change[1] else [change]
    ended = here(command, protocol(tmp_path, *changes).name, cwd=tmp_path)
    refused(ended, code, *words)
    assert [path.name for path in tmp_path.iterdir()] == ["short.yaml"]


def test_a_kind_of_device_that_nothing_emulates_is_refused_with_those_that_can_be(tmp_path: Path) -> None:
    refused(here("emulate", "loopbak", cwd=tmp_path), 2, "nothing emulates", "loopbak", "allowed: ", "serial")


def test_a_missing_protocol_and_an_unknown_device_are_refused(tmp_path: Path) -> None:
    refused(here("check", "nowhere.yaml", cwd=tmp_path), 2, "nowhere.yaml", "no such file")
    protocol(tmp_path)
    refused(here("check", "short.yaml", "--device", "loopbak:", cwd=tmp_path), 2, "did you mean 'loopback'?")


def test_a_device_that_is_not_there_is_a_device_failure(tmp_path: Path) -> None:
    protocol(tmp_path)
    refused(here("run", "short.yaml", "--device", "serial:/dev/not-there", cwd=tmp_path), 3, "/dev/not-there")
    assert [path.name for path in tmp_path.iterdir()] == ["short.yaml"]


def flipped(path: Path, at: int) -> None:
    """Flip one bit of a file."""
    held = bytearray(path.read_bytes())
    held[at] ^= 1
    path.write_bytes(held)


def sample_offset(path: Path) -> int:
    """Return where in a recording the readings begin."""
    with h5py.File(path, "r") as file:
        return int(file["y"].id.get_offset())


def damage(path: Path, kind: str) -> None:
    """Damage a recording."""
    if kind == "empty":
        path.write_bytes(b"")
    elif kind == "cut":
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    elif kind == "no recording":
        path.write_text("time,u,y\n0,1,2\n")
    else:
        flipped(path, sample_offset(path) + 1000)


@pytest.mark.parametrize("kind", ["empty", "cut", "no recording", "one bit"])
def test_a_damaged_recording_is_refused(tmp_path: Path, recording: Path, kind: str) -> None:
    copy = tmp_path / "copy.h5"
    copy.write_bytes(recording.read_bytes())
    damage(copy, kind)
    refused(here("explain", "copy.h5", cwd=tmp_path), 2, "copy.h5")


def test_a_recording_without_rig_asks_for_one(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("u,y\n" + "".join(f"{k % 7},{k % 5}\n" for k in range(400)))
    made = here("import", "t.csv", "--input", "u", "--output", "y", "--rate", "1000", "--out", "t.h5", cwd=tmp_path)
    assert made.code == 0
    refused(here("identify", "t.h5", cwd=tmp_path), 2, "no rig is known", "--rig RIG.yaml")


def test_a_page_that_could_not_be_written_is_refused_at_once(tmp_path: Path, recording: Path) -> None:
    refused(here("explain", recording, "--report", "no/such/folder/r.html", cwd=tmp_path), 2, "no such folder")


def test_nothing_left_to_fit_is_refused(tmp_path: Path, recording: Path) -> None:
    refused(here("explain", recording, "--hold-out", recording, cwd=tmp_path), 2, "no run is left to fit")


TABLES = [
    ("text cell", "t,u,y\n0,1,2\n0.001,abc,3\n0.002,1,3\n", ("t.csv:3", "(u)", "'abc'")),
    ("unequal columns", "t,u,y\n0,1,2\n0.001,1\n", ("t.csv:3", "2 cells")),
    ("time runs back", "t,u,y\n0,1,2\n1,1,2\n2,1,2\n3,1,2\n2.5,1,2\n", ("t.csv:6", "2.5 s after 3 s")),
    ("time jumps", "t,u,y\n0,1,2\n0.001,1,2\n0.002,1,2\n0.012,1,2\n0.013,1,2\n", ("t.csv:5", "time base")),
    ("empty", "", ("t.csv", "empty")),
    ("not a number", "t,u,y\n0,1,2\n0.001,nan,3\n", ("t.csv:3", "nan")),
]


@pytest.mark.parametrize(("text", "words"), [row[1:] for row in TABLES], ids=[row[0] for row in TABLES])
def test_a_table_that_is_amiss_is_refused(tmp_path: Path, text: str, words: tuple[str, ...]) -> None:
    (tmp_path / "t.csv").write_text(text)
    ended = here("import", "t.csv", "--time", "t", "--input", "u", "--output", "y", "--out", "t.h5", cwd=tmp_path)
    refused(ended, 2, *words)
    assert not (tmp_path / "t.h5").exists()


def test_a_column_that_is_not_there_is_refused_with_the_nearest(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text("Time,DAC,ADC\n0,1,2\n0.001,1,2\n")
    columns = ("--time", "time", "--input", "DAC", "--output", "ADC")
    ended = here("import", "t.csv", *columns, "--out", "t.h5", cwd=tmp_path)
    refused(ended, 2, "'time'", "'Time'")


def test_the_traceback_is_shown_on_request_only(tmp_path: Path) -> None:
    ended = rig("check", "nowhere.yaml", "--debug", cwd=tmp_path)
    assert ended.code == 2
    assert "Traceback" in ended.err
    assert ended.err.splitlines()[-1] == "rig: nowhere.yaml: no such file"


@pytest.mark.parametrize("line", [("frobnicate",), ("explain",), ("check", "a.yaml", "--devise", "x")])
def test_bad_usage_ends_with_two(tmp_path: Path, line: tuple[str, ...]) -> None:
    ended = rig(*line, cwd=tmp_path)
    assert ended.code == 2
    assert "Traceback" not in ended.err


def test_a_fault_in_the_program_is_no_answer_and_shows_no_traceback(tmp_path: Path) -> None:
    (tmp_path / "faulty.py").write_text(
        "from rig.device import Device\n"
        "class Daq(Device):\n"
        "    @classmethod\n"
        "    def connect(cls, where):\n"
        "        raise RuntimeError('coil burnt')\n"
    )
    protocol(tmp_path)
    refused(rig("check", "short.yaml", "--device", "faulty:Daq", cwd=tmp_path), 70, "coil burnt", "--debug")
