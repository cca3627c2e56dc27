"""Is a calibration kept whole, found again, and used only for what it is true of?"""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.interval import Interval
from rig.calibration import Calibration, kept_for, parse_calibration, usual_path
from rig.errors import FileError
from rig.of_device import with_device
from rig.outputs import json_text
from rig.recorded import Equipment, Origin, Recording, complete_ledger
from rig.recording import read, write

RANGES = {"output_low": "-10 V", "output_high": "10 V", "input_low": "-20 V", "input_high": "20 V"}
BOARD = Equipment("serial:/dev/x", "board", "7", "1.2", RANGES)
STARTED = "2026-03-01T10:00:00+00:00"
LATE = Interval(237e-6, 236e-6, 238e-6)
MADE = Calibration(
    model="board", serial="7", firmware="1.2", rate_hz=10_000.0, ranges_v=(-10.0, 10.0, -20.0, 20.0), level_v=1.0,
    made="2026-02-01T10:00:00+00:00", delay=LATE, time_constant=Interval(1e-4, 0.9e-4, 1.1e-4),
    skew=Interval(0.0, -1.0, 1.0), gain=Interval(1.003, 1.002, 1.004), offset=Interval(2e-3, 1e-3, 3e-3),
    noise=Interval(1e-3, 0.9e-3, 1.1e-3), input_step=None, input_skews={"input 2": Interval(5e-5, 4e-5, 6e-5)},
    warnings=("a hum on it?",),
)  # fmt: skip


def recording(equipment: Equipment = BOARD, rate_hz: float = 10_000.0, started: str = STARTED) -> Recording:
    u = np.arange(10.0)
    return Recording("run", rate_hz, u, u, complete_ledger(10), Origin(equipment, started=started, finished=started))


def test_what_is_written_reads_back() -> None:
    assert parse_calibration(json_text(MADE.to_dict()), "cal.json") == MADE
    stepped = replace(MADE, input_step=Interval(1e-6, 0.9e-6, 1.1e-6), input_skews={}, warnings=())
    assert parse_calibration(json_text(stepped.to_dict()), "cal.json") == stepped


@pytest.mark.parametrize(("change", "words"), [
    ({"schema": "rig.explain/1"}, "schema"), ({"made": "yesterday"}, "not a time"), ({"delay": None}, "delay"),
    ({"gian": {}}, "did you mean 'gain'"), ({"valid": {"rate_hz": 0, "ranges_v": [], "level_v": 1}}, "rate_hz"),
])
def test_a_damaged_file_is_refused_with_its_key(change: dict[str, object], words: str) -> None:
    with pytest.raises(FileError, match=words):
        parse_calibration(json.dumps(MADE.to_dict() | change), "cal.json")


@pytest.mark.parametrize(("equipment", "rate_hz", "started", "why"), [
    (replace(BOARD, serial="8"), 10_000.0, STARTED, "it is of board 7 1.2, the run of board 8 1.2"),
    (replace(BOARD, firmware="1.3"), 10_000.0, STARTED, "the run of board 7 1.3"),
    (BOARD, 5_000.0, STARTED, "it is at 10 kHz, the run at 5 kHz"),
    (replace(BOARD, settings=RANGES | {"input_high": "10 V"}), 10_000.0, STARTED, "it is of the ranges"),
    (BOARD, 10_000.0, "2027-02-02T10:00:00+00:00", "more than a year apart"),
])
def test_it_is_not_true_of_another_device_rate_range_or_year(
    equipment: Equipment, rate_hz: float, started: str, why: str
) -> None:
    assert MADE.not_for(BOARD, 10_000.0, STARTED) is None
    assert why in (MADE.not_for(equipment, rate_hz, started) or "")
    with pytest.raises(FileError, match="not true of this recording"):
        with_device(recording(equipment, rate_hz, started), MADE)


def test_it_is_found_for_its_device_and_rate_and_travels_in_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("RIG_CALIBRATIONS", str(tmp_path / "kept"))
    path = usual_path(BOARD, 10_000.0)
    assert path.parent == tmp_path / "kept"
    assert kept_for(BOARD, 10_000.0, STARTED) == ""
    path.parent.mkdir()
    path.write_text(json_text(MADE.to_dict()))
    text = kept_for(BOARD, 10_000.0, STARTED)
    assert parse_calibration(text, "kept") == MADE
    assert kept_for(BOARD, 10_000.0, "2028-01-01T00:00:00+00:00") == ""
    assert kept_for(BOARD, 5_000.0, STARTED) == ""
    write(tmp_path / "run.h5", recording(replace(BOARD, calibration=text)))
    back = read(tmp_path / "run.h5")
    assert back.origin.equipment.calibration == text
    assert with_device(back, None).late_s == pytest.approx(237e-6)


def test_a_delay_told_to_a_part_of_a_sample_is_known_and_any_other_only_told() -> None:
    known = with_device(recording(), MADE)
    assert known.late_s == LATE.value
    assert known.device is not None
    assert known.device.origin == "calibration of board 7 at 10 kHz, 2026-02-01"
    vague = with_device(recording(), replace(MADE, delay=Interval(5e-5, 0.0, 1e-4)))
    assert vague.late_s == 0.0
    assert vague.device is not None
    assert "told only to ± 50 µs" in vague.device.unused
    early = with_device(recording(), replace(MADE, delay=Interval(-1e-5, -1.1e-5, -0.9e-5)))
    assert early.late_s == 0.0
    assert with_device(recording(), None).device is None
