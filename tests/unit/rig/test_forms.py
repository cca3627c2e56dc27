"""Does a form report the first thing that matters, at the place it has in the file?"""

from typing import Annotated

import pytest
from pydantic import Tag

from rig.errors import FileError
from rig.forms import BY_SHAPE, Form, Seconds, Volts
from rig.yamlfile import parse_yaml


class Inner(Form):
    """A mapping."""

    level: Volts
    time: Seconds = 0.0


class Outer(Form):
    """A mapping with a union in it."""

    entries: list[Annotated[Annotated[Inner, Tag("mapping")] | Annotated[Volts, Tag("plain")], BY_SHAPE]]


def refused(text: str) -> str:
    with pytest.raises(FileError) as caught:
        Outer.read(parse_yaml(text, "f.yaml"))
    return str(caught.value)


def test_both_members_of_a_union_are_read() -> None:
    read = Outer.read(parse_yaml("entries: [3 V, {level: 1 V}]", "f.yaml"))
    assert read.entries == [3.0, Inner(level="1 V")]  # type: ignore[arg-type]


def test_only_the_member_meant_reports_and_without_its_tag() -> None:
    assert refused("entries:\n  - {level: 1}\n") == (
        "f.yaml:2: entries[0].level: a number without a unit: 1; allowed: a voltage; write '1 V'")
    assert refused("entries:\n  - 1\n").startswith("f.yaml:2: entries[0]: a number without a unit: 1")


def test_a_misspelt_key_comes_before_the_missing_one_it_causes() -> None:
    assert refused("entries:\n  - {levl: 1 V}\n").startswith("f.yaml:2: entries[0].levl: unknown key 'levl'")


def test_a_missing_key_is_named_at_its_mapping() -> None:
    assert refused("entries:\n  - {time: 1 s}\n") == "f.yaml:2: entries[0]: the key 'level' is missing; add 'level:'"


def test_a_negative_time_is_refused() -> None:
    text = refused("entries: [{level: 1 V, time: -1 s}]")
    assert "f.yaml:1: entries[0].time: must be greater than or equal to 0" in text


def test_what_is_no_mapping_lists_the_keys() -> None:
    assert refused("- 1\n") == "f.yaml:1: a mapping is needed: [1]; allowed: the keys entries"
