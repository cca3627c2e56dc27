"""Is a file read as it stands, with the line of every value, and nothing guessed?"""

from pathlib import Path

import pytest

from rig.errors import FileError
from rig.yamlfile import Document, dotted, parse_json, parse_yaml, read_text, scalar

TEXT = """\
spec: 1
steps:
  - sine: {frequency: 50 Hz,
           amplitude: 3 V}
  - hold:
      level: 0 V
"""


def test_every_value_knows_its_line() -> None:
    document = parse_yaml(TEXT, "p.yaml")
    assert document.data == {
        "spec": 1, "steps": [{"sine": {"frequency": "50 Hz", "amplitude": "3 V"}}, {"hold": {"level": "0 V"}}]}
    assert document.at("steps", 0, "sine", "amplitude") == "p.yaml:4: steps[0].sine.amplitude"
    assert document.at("steps", 1, "hold", "level") == "p.yaml:6: steps[1].hold.level"


def test_a_key_that_is_not_there_is_placed_at_its_parent() -> None:
    assert parse_yaml(TEXT, "p.yaml").at("steps", 1, "hold", "time") == "p.yaml:5: steps[1].hold.time"


@pytest.mark.parametrize(("text", "value"), [
    ("yes", "yes"), ("no", "no"), ("on", "on"), ("010", 10), ("1e-4", 1e-4), ("1_000", "1_000"),
    ("2026-11-21", "2026-11-21"),
    ("12:30", "12:30"), ("true", True), ("~", None), ("0x10", "0x10"), (".5", 0.5), ("-3", -3), (".inf", ".inf"),
])
def test_plain_scalars_are_not_guessed_at(text: str, value: object) -> None:
    assert scalar(text) == value
    assert type(scalar(text)) is type(value)


def test_a_quoted_scalar_is_text() -> None:
    assert parse_yaml("a: '3'", "p").data == {"a": "3"}


@pytest.mark.parametrize(("text", "message"), [
    ("a: 1\nb: 2\na: 3\n", "p.yaml:3: the key 'a' twice"),
    ("a: &x 1\nb: *x\n", "p.yaml:1: anchors and aliases"),
    ("a: !!python/object/apply:os.system ['true']\n", "p.yaml:1: tags are not read"),
    ("a: [1, 2\nb: 3\n", "p.yaml:2: not valid YAML"),
    ("a: 1\n\tb: 2\n", "p.yaml:2: not valid YAML.*indent with spaces"),
    ("a: b: c\n", "p.yaml:1: not valid YAML.*quote text"),
    ("a: 1\n---\nb: 2\n", "p.yaml:2: a second document"),
    ("[1, 2]: 3\n", "p.yaml:1: a key must be plain text"),
    ("[" * 40 + "]" * 40, "nested too deeply"),
])
def test_what_could_be_misread_is_refused_with_its_line(text: str, message: str) -> None:
    with pytest.raises(FileError, match=message):
        parse_yaml(text, "p.yaml")


def test_an_empty_file_holds_nothing() -> None:
    assert parse_yaml("# only a comment\n", "p").data is None


def test_json_refuses_a_key_twice_and_names_the_line() -> None:
    with pytest.raises(FileError, match="the same key twice: a"):
        parse_json('{"a": 1, "a": 2}', "m.json")
    with pytest.raises(FileError, match=r"m\.json:2: not valid JSON"):
        parse_json('{"a": 1,\n}', "m.json")
    with pytest.raises(FileError, match="nested too deeply"):
        parse_json("[" * 100_000, "m.json")


def test_files_that_cannot_be_read_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="no such file"):
        read_text(tmp_path / "none.yaml")
    with pytest.raises(FileError, match="not a file"):
        read_text(tmp_path)
    (tmp_path / "latin.yaml").write_bytes(b"a: \xff\xfe")
    with pytest.raises(FileError, match="not UTF-8 text: byte 3"):
        read_text(tmp_path / "latin.yaml")
    (tmp_path / "large.yaml").write_bytes(b" " * 4_000_001)
    with pytest.raises(FileError, match="too large"):
        read_text(tmp_path / "large.yaml")


def test_the_suffix_chooses_json(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    path.write_text('{"a": 1e-4}')
    assert parse_yaml(read_text(path), str(path)).data == {"a": 1e-4}


def test_dotted_paths() -> None:
    assert dotted(("steps", 0, "sine")) == "steps[0].sine"
    assert Document("f", "", None).at() == "f"
