"""Are tables of other programs read as they are, and is every fault named with its line and column?"""

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rig.errors import FileError
from rig.readers import open_table
from rig.readers.text import TextTable, cells


def table(folder: Path, text: str | bytes, name: str = "t.csv") -> TextTable:
    (folder / name).write_bytes(text.encode() if isinstance(text, str) else text)
    found = open_table(folder / name)
    assert isinstance(found, TextTable)
    return found


def names(found: TextTable) -> list[str]:
    return [heading.text for heading in found.headings]


def refused(folder: Path, text: str | bytes, which: str = "1") -> str:
    with pytest.raises(FileError) as caught:
        table(folder, text).column(which, "V")
    assert "\n" not in str(caught.value)
    return str(caught.value).replace(str(folder) + "/", "")


@pytest.mark.parametrize("text", [
    "a,b\n1,2\n3,4\n", "a;b\n1;2\n3;4\n", "a\tb\n1\t2\n3\t4\n", "a b\n1  2\n 3 4\n", '"a","b"\n"1","2"\n3,4\n',
    "\ufeffa,b\r\n1,2\r\n3,4\r\n", "# a comment\n\na,b\n% another\n1,2\n\n3,4", "a;b\n1,0;2,0\n3,0;4,0\n",
    "a\tb\n1,0\t2\n3\t4,0\n",
])
def test_every_common_form_of_text_is_read(tmp_path: Path, text: str) -> None:
    found = table(tmp_path, text)
    assert names(found) == ["a", "b"]
    assert found.column("b", "").tolist() == [2.0, 4.0]
    assert found.column("1", "").tolist() == [1.0, 3.0]


def test_gzipped_text_is_read_whatever_its_name(tmp_path: Path) -> None:
    assert table(tmp_path, gzip.compress(b"a,b\n1,2\n", mtime=0), "t.dat").column("b", "").tolist() == [2.0]


def test_a_table_without_a_header_has_numbers_only(tmp_path: Path) -> None:
    found = table(tmp_path, "1,2\n3,4\n")
    assert names(found) == ["", ""]
    assert found.column("2", "").tolist() == [2.0, 4.0]


def test_a_trailing_empty_column_and_gaps_in_columns_not_asked_for(tmp_path: Path) -> None:
    found = table(tmp_path, '"u","y","fs",\n1,2,51200,\n3,4,,\n')
    assert found.column("y", "").tolist() == [2.0, 4.0]
    assert refused(tmp_path, '"u","y","fs",\n1,2,51200,\n3,4,,\n', "fs").startswith(
        "t.csv:3: column 3 (fs): an empty cell; allowed: finite numbers in every row")


def test_a_range_of_rows_is_read_and_named_by_file_lines(tmp_path: Path) -> None:
    found = table(tmp_path, "# note\na\n" + "\n".join(map(str, range(10))) + "\n")
    assert found.column("a", "", 3, 6).tolist() == [3.0, 4.0, 5.0]
    assert found.column("a", "", 20).size == 0
    assert found.place(0).endswith("t.csv:3")


@pytest.mark.parametrize(("text", "message"), [
    ("a,b\n1,2\nx,4\n", "t.csv:3: column 1 (a): not a number: 'x'; allowed: finite numbers in every row; correct"),
    ("1,2\nNaN,4\n", "t.csv:2: column 1: not a number: 'NaN'"),
    ("1,2\n1_000,4\n", "t.csv:2: column 1: not a number: '1_000'"),
    ("1,2\n0x10,4\n", "t.csv:2: column 1: not a number: '0x10'"),
    ("1,2\n1 000,4\n", "t.csv:2: column 1: not a number: '1 000'"),
    ("1,2\ninf,4\n", "t.csv:2: column 1: not a number: 'inf'"),
    ("a,b\n1,2\n3\n", "t.csv:3: unequal columns: 1 cells; allowed: 2 as in the lines before; complete the row"),
    ("a,b\n1,2,3\n", "t.csv:2: unequal columns: 3 cells; allowed: 2"),
    ("a b\n1 2\n3 4 5\n", "t.csv:3: unequal columns: 3 cells"),
    ("1,oops\n3,4\n", "t.csv:1: neither a header nor a row of numbers: 'oops'"),
    ("", "t.csv: the file is empty"),
    ("# only\n\n", "t.csv: no rows"),
    ("a,b\n", "t.csv: a header and no rows"),
    (b"\x7fELF\x00\x00", "t.csv: not a text table; allowed: CSV, TSV, or these gzipped"),
    (gzip.compress(b"a,b\n1,2\n" * 100, mtime=0)[:-30], "t.csv: cannot be read, or damaged"),
])
def test_what_is_wrong_is_named_with_its_line(tmp_path: Path, text: str | bytes, message: str) -> None:
    assert refused(tmp_path, text).startswith(message)


@pytest.mark.parametrize(("which", "message"), [
    ("input", "unknown column 'input'; allowed: inpt, output; did you mean 'inpt'?"),
    ("3", "no such column: 3; allowed: 1 to 2"),
    ("0", "no such column: 0; allowed: 1 to 2"),
])
def test_a_column_that_is_not_there(tmp_path: Path, which: str, message: str) -> None:
    assert message in refused(tmp_path, "inpt,output\n1,2\n", which)


def test_two_columns_of_one_name_need_a_number(tmp_path: Path) -> None:
    assert "two columns of one name: 'a'; give its number: 1 or 3" in refused(tmp_path, "a,b,a\n1,2,3\n", "a")
    assert table(tmp_path, "a,b,a\n1,2,3\n").column("3", "").tolist() == [3.0]


def test_files_that_are_not_there(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no such file"):
        open_table(tmp_path / "none.csv")
    with pytest.raises(FileError, match="not a file"):
        open_table(tmp_path)


@given(rows=st.lists(st.tuples(st.floats(allow_nan=False, allow_infinity=False), st.integers(-9, 9)), min_size=1))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=50)
def test_numbers_are_read_to_the_last_bit(tmp_path: Path, rows: list[tuple[float, int]]) -> None:
    found = table(tmp_path, "a,b\n" + "".join(f"{value!r},{other}\n" for value, other in rows))
    assert np.array_equal(found.column("a", ""), [value for value, _ in rows])


def test_latin_1_names_are_read(tmp_path: Path) -> None:
    assert table(tmp_path, "Größe,y\n1,2\n".encode("latin-1")).headings[0].text == "Größe"


def test_cells_lose_quotes_and_space() -> None:
    assert cells(' "a b" , 1 ', ",") == ["a b", "1"]


@pytest.mark.parametrize(("text", "units"), [
    ("t [s],u [mV]\n0,1\n", ["s", "mV"]), ("Time (ms);u (V)\n0;1\n", ["ms", "V"]), ("t/s\tu/mV\n0\t1\n", ["s", "mV"]),
    ("Time,Channel A\n(ms),(mV)\n\n0,1\n", ["ms", "mV"]), ("x-axis,2\nsecond,Volt\n0,1\n", ["s", "V"]),
    ("Time (UTC),u (filtered)\n0,1\n", ["", ""]), ("Dev1/ai0,a/b\n0,1\n", ["", ""]),
    ("t | u [µV]\n0 | 1\n", ["", "µV"]),
])
def test_units_are_read_from_headings_and_from_the_line_below(tmp_path: Path, text: str, units: list[str]) -> None:
    found = table(tmp_path, text)
    assert [heading.unit for heading in found.headings] == units
    assert found.column("1", "").tolist() == [0.0]
    assert found.column("2", "").tolist() == [1.0]


def test_a_column_is_found_by_its_name_with_and_without_its_unit(tmp_path: Path) -> None:
    found = table(tmp_path, "t [ms],u [mV]\n7,1234\n")
    assert found.column("u [mV]", "V").tolist() == found.column("u", "V").tolist() == [1.234]
    assert found.column("t", "s").tolist() == [0.007]


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig", "latin-1", "utf-8"])
def test_encodings_of_other_programs(tmp_path: Path, encoding: str) -> None:
    found = table(tmp_path, "Spannung µ,y\n1,2\n3,4\n".encode(encoding))
    assert found.column("Spannung µ", "V").tolist() == [1.0, 3.0]


def test_quotes_may_hold_the_delimiter(tmp_path: Path) -> None:
    found = table(tmp_path, '"u, raw",y\n"1",2\n3,"4"\n')
    assert names(found) == ["u, raw", "y"]
    assert found.column("y", "").tolist() == [2.0, 4.0]


def test_a_quote_that_does_not_end_does_not_swallow_the_next_row(tmp_path: Path) -> None:
    assert refused(tmp_path, 'a,b\n1,"2\n3,4"\n', "b").startswith("t.csv:3: column 2 (b): not a number: '4\"'")


def test_a_file_is_read_by_pieces_as_it_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "# note\na;b\n" + "".join(f"{k},5;{k}\n{'# between' if k % 3 else ''}\n" for k in range(200))
    whole = table(tmp_path, text)
    a = [k + 0.5 for k in range(200)]
    assert whole.column("a", "").tolist() == a
    for size in (1, 7, 64):
        monkeypatch.setattr("rig.readers.text.AT_ONCE", size)
        parts = table(tmp_path, text)
        assert parts.column("a", "").tolist() == a
        assert parts.column("b", "", 150, 160).tolist() == list(range(150, 160))
        assert parts.place(7) == whole.place(7) == f"{tmp_path / 't.csv'}:17"
        assert parts.remarks == ("decimal commas, first in line 3",)


def test_a_line_without_an_end_is_refused(tmp_path: Path) -> None:
    assert "a line that does not end" in refused(tmp_path, b"1," * (1 << 22))


def test_a_gzipped_bomb_of_nothing_is_refused_at_its_beginning(tmp_path: Path) -> None:
    assert "not a text table" in refused(tmp_path, gzip.compress(bytes(1 << 24)))
