"""Does a table from elsewhere become a recording with the clock, the range and the state it had?"""

import gzip
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from identify.trace import Stored
from rig.errors import FileError, UsageError
from rig.importers import Asked, read_table
from rig.recording import Entry, Recording, read, write

ROWS = "".join(f"{k / 1000:.3f},{k % 7},{np.sin(k / 9):.6f}\n" for k in range(200))
TEXT = "time,u,y\n" + ROWS


def imported(folder: Path, text: str = TEXT, **options: Any) -> Recording:
    (folder / "bench run.csv").write_text(text)
    return read_table(folder / "bench run.csv", Asked(**{"input": "u", "output": "y", "time": "time"} | options))


def test_a_table_becomes_a_recording(tmp_path: Path) -> None:
    made = imported(tmp_path)
    assert (made.name, made.rate_hz, made.start_s, made.intersample) == ("bench run", 1000.0, 0.0, "held")
    assert made.u.tolist() == [k % 7 for k in range(200)]
    assert made.y == pytest.approx([round(np.sin(k / 9), 6) for k in range(200)])
    assert made.count(Entry.RECORDED) == 200
    assert made.complete
    assert made.trace().valid is None


def test_an_imported_recording_is_the_same_file_as_any_other(tmp_path: Path) -> None:
    write(tmp_path / "r.h5", imported(tmp_path, measured_input="u", rig_text="spec: 1\n"))
    found = read(tmp_path / "r.h5")
    assert found.u_measured is not None
    assert (found.rig_text, found.origin.equipment.model) == ("spec: 1\n", "imported")
    assert found.origin.equipment.settings["output"] == "y"
    assert len(found.origin.equipment.settings["source_sha256"]) == 64


def test_the_rate_may_be_given_in_place_of_a_time_column(tmp_path: Path) -> None:
    made = imported(tmp_path, time=None, rate_hz=500.0)
    assert (made.rate_hz, made.start_s) == (500.0, 0.0)
    assert imported(tmp_path, time=None, rate_hz=500.0, first_row=50).start_s == 0.1


def test_a_rate_beside_a_time_column_must_agree_and_then_counts(tmp_path: Path) -> None:
    assert imported(tmp_path, rate_hz=1000.5).rate_hz == 1000.5
    with pytest.raises(FileError, match=r"time column and rate disagree: 1000 Hz in the file; allowed: 500 Hz"):
        imported(tmp_path, rate_hz=500.0)


def test_a_range_of_rows_keeps_its_place_in_time(tmp_path: Path) -> None:
    made = imported(tmp_path, first_row=50, stop_row=150)
    assert (made.u.size, made.u[0], made.start_s) == (100, 50 % 7, 0.05)
    assert made.origin.equipment.settings["rows"] == "50:150"


def test_a_run_cut_out_or_begun_off_zero_is_in_motion(tmp_path: Path) -> None:
    assert imported(tmp_path).initial == "rest"
    assert imported(tmp_path, first_row=1).initial == "in_motion"
    assert imported(tmp_path, TEXT.replace("0.000,0,0.000000", "0.000,0,0.500000")).initial == "in_motion"
    assert imported(tmp_path, first_row=1, initial="rest").trace().from_rest


def test_noise_around_zero_is_rest(tmp_path: Path) -> None:
    noise = np.random.default_rng(0).standard_normal(500)
    text = "u,y\n" + "".join(f"0,{value:.5f}\n" for value in noise)
    assert imported(tmp_path, text, time=None, rate_hz=1.0).initial == "rest"


def test_gzipped_tables_lose_both_suffixes(tmp_path: Path) -> None:
    (tmp_path / "sine.csv.gz").write_bytes(gzip.compress(TEXT.encode()))
    assert read_table(tmp_path / "sine.csv.gz", Asked(input="u", output="y", time="1")).name == "sine"


@pytest.mark.parametrize(("options", "message"), [
    ({"time": None}, "the time base is unknown; give the time column or the sample rate"),
    ({"rate_hz": 0.0}, "not a sample rate: 0 Hz; allowed: above 0 Hz"),
    ({"rate_hz": float("nan")}, "not a sample rate"),
    ({"first_row": -1}, "not a range of rows: -1:; allowed: FIRST:STOP"),
    ({"first_row": 9, "stop_row": 9}, "not a range of rows: 9:9"),
])
def test_options_that_make_no_sense_are_usage_errors(tmp_path: Path, options: dict[str, Any], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        imported(tmp_path, **options)


@pytest.mark.parametrize(("text", "message"), [
    (TEXT.replace("0.100,2,", "0.100,two,"), "run.csv:102: column 2 (u): not a number: 'two'"),
    (TEXT.replace("0.100,2,", "0.100,"), "run.csv:102: unequal columns: 2 cells; allowed: 3"),
    (TEXT.replace("0.100,", "0.109,"), "run.csv:102: the time base is broken: 0.109 s after 0.099 s"),
    ("time,u,y\n0,1,2\n", "too few rows: 1 from row 0 on; allowed: at least 2"),
    ("time,u\n0,1\n", "unknown column 'y'; allowed: time, u"),
])
def test_a_faulty_table_is_named_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(FileError) as caught:
        imported(tmp_path, text)
    assert message in str(caught.value)
    assert caught.value.exit_code == 2


def test_a_broken_time_base_is_named_by_the_line_of_the_file_in_a_range_too(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"run\.csv:102: the time base is broken"):
        imported(tmp_path, TEXT.replace("0.100,", "0.109,"), first_row=40)


def test_a_long_table_is_read_as_it_stands(tmp_path: Path) -> None:
    """As long and as oddly shaped as the longest real input: 188,000 rows, a trailing empty column."""
    values = np.random.default_rng(0).standard_normal((188_000, 2)).round(6)
    body = "".join(f"{u},{y},,\n" for u, y in values.tolist())
    (tmp_path / "long.csv").write_text('"uBenchMark","yBenchMark","fs",\n' + body)
    made = read_table(tmp_path / "long.csv", Asked(input="uBenchMark", output="yBenchMark", rate_hz=51_200.0))
    assert np.array_equal(made.y, values[:, 1])


GAPPY = "".join(f"{k / 1000:.3f},{k % 7},{np.sin(k / 9):.6f}\n" for k in range(200) if not 50 <= k < 60 and k != 120)


def test_rows_that_the_times_lack_are_refused_with_all_of_them_told(tmp_path: Path) -> None:
    with pytest.raises(FileError) as caught:
        imported(tmp_path, "time,u,y\n" + GAPPY)
    assert "run.csv:52: the time base is broken: 0.06 s after 0.049 s; in all 2 x gap (first at" in str(caught.value)
    assert "--gaps lost" in str(caught.value)


@pytest.mark.parametrize(("intersample", "at_the_gap"), [("held", [0.0] * 10), ("linear", [4 / 11, 8 / 11, 12 / 11])])
def test_rows_that_the_times_lack_may_be_lost_samples(
    tmp_path: Path, intersample: str, at_the_gap: list[float],
) -> None:
    made = imported(tmp_path, "time,u,y\n" + GAPPY, gaps_lost=True, intersample=intersample)
    whole = imported(tmp_path)
    there = made.ledger == Entry.RECORDED
    assert (made.u.size, made.rate_hz, made.count(Entry.LOST)) == (200, 1000.0, 11)
    assert np.flatnonzero(~there).tolist() == [*range(50, 60), 120]
    assert np.array_equal(made.u[there], whole.u[there])
    assert np.array_equal(made.y[there], whole.y[there])
    assert np.isnan(made.y[~there]).all()
    # u before and behind the gap: 49 % 7 = 0 and 60 % 7 = 4
    assert made.u[50 : 50 + len(at_the_gap)] == pytest.approx(at_the_gap)
    u_is = "held" if intersample == "held" else "a straight line"
    assert made.events[0].text == f"the table lacks 11 samples in 2 gaps of the times, where u is taken as {u_is}"


def test_readings_that_are_no_numbers_may_be_lost_samples_and_u_may_not(tmp_path: Path) -> None:
    text = re.sub("(0.100,2,).*", r"\1", re.sub("(0.102,4,).*", r"\1NaN", TEXT))
    with pytest.raises(FileError, match=r"run\.csv:102: column 3 \(y\): an empty cell"):
        imported(tmp_path, text)
    made = imported(tmp_path, text, gaps_lost=True)
    assert np.flatnonzero(made.ledger == Entry.LOST).tolist() == [100, 102]
    assert made.events[0].text == "the table lacks 2 readings that are no numbers"
    with pytest.raises(FileError, match=r"column 2 \(u\): an empty cell"):
        imported(tmp_path, text.replace("0.110,5,", "0.110,,"), gaps_lost=True)


def test_a_gap_that_is_no_whole_number_of_samples_is_not_lost_samples(tmp_path: Path) -> None:
    late = "".join(f"{(k + 0.4 * (k >= 50)) / 1000:.4f},{k % 7},0\n" for k in range(100) if not 50 <= k < 55)
    with pytest.raises(FileError, match="the time base is not uniform"):
        imported(tmp_path, "time,u,y\n" + late, gaps_lost=True)


def test_more_lost_than_there_is_is_refused(tmp_path: Path) -> None:
    two = "".join(f"{t},0,0\n" for t in [*range(20), *range(10**12, 10**12 + 20)])
    with pytest.raises(FileError, match="more rows are missing than there are"):
        imported(tmp_path, "time,u,y\n" + two, gaps_lost=True)


def test_units_in_headings_count_and_what_was_converted_is_said(tmp_path: Path) -> None:
    text = TEXT.replace("time,u,y", "Time (ms),u [mV],y/µV")
    made, plain = imported(tmp_path, text, time="Time", output="y/µV"), imported(tmp_path)
    assert np.array_equal(made.u, plain.u[:] / 1e3)
    assert np.array_equal(made.y, plain.y[:] / 1e6)
    assert made.rate_hz == 1e6
    assert made.origin.equipment.settings["understood"] == (
        "u in mV, of which one is 0.001 V; y in µV, of which one is 1e-06 V; Time in ms, of which one is 0.001 s")


@pytest.mark.parametrize(("heading", "message"), [
    ("u [A]", "column 2 (u [A]): wrong unit 'A'; allowed: a voltage"), ("u [counts]", "wrong unit 'counts'"),
    ("u [mv]", "unknown unit 'mv'"),
])
def test_units_that_are_no_voltage_are_refused(tmp_path: Path, heading: str, message: str) -> None:
    with pytest.raises(FileError) as caught:
        imported(tmp_path, TEXT.replace("time,u,", f"time,{heading},"))
    assert message in str(caught.value)
    assert "leave it out and the numbers are taken as V" in str(caught.value)


def test_decimal_commas_are_said(tmp_path: Path) -> None:
    made = imported(tmp_path, TEXT.replace(",", ";").replace(".", ","))
    assert np.array_equal(made.y, imported(tmp_path).y)
    assert made.origin.equipment.settings["understood"] == "decimal commas, first in line 2"


def test_columns_must_be_said_for_a_table_of_another_program(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"which columns are u and y.*allowed: 1 to 3: time, u, y; give --input and"):
        imported(tmp_path, input=None)


def test_a_long_table_is_read_as_a_short_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Everything that is a stretch at a time is made small."""
    short = imported(tmp_path, "time,u,y\n" + GAPPY, gaps_lost=True)
    monkeypatch.setattr("rig.spool.LONG", 16)
    monkeypatch.setattr("rig.readers.text.AT_ONCE", 100)
    monkeypatch.setattr("identify.trace.blocks.__defaults__", (16,))
    long = imported(tmp_path, "time,u,y\n" + GAPPY, gaps_lost=True)
    assert isinstance(long.u, Stored)
    assert isinstance(long.y, Stored)
    assert np.array_equal(long.u[:], short.u)
    assert np.array_equal(long.y[:], short.y, equal_nan=True)
    assert long.events == short.events
    assert np.array_equal(long.ledger, short.ledger)
    write(tmp_path / "long.h5", long)
    assert np.array_equal(read(tmp_path / "long.h5").u[:], short.u)
