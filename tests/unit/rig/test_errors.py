"""Does every error say what, where, the value, what is allowed, what to do, and carry its exit code?"""

import pytest

from rig.errors import (
    DeviceError,
    FileError,
    IncompleteError,
    MisfitError,
    RefusedError,
    RigError,
    UsageError,
    nearest,
    sentence,
    unknown,
    visible,
)


@pytest.mark.parametrize(("kind", "code"), [
    (RefusedError, 1), (UsageError, 2), (FileError, 2), (DeviceError, 3), (IncompleteError, 4),
])
def test_exit_codes_are_those_of_the_charter(kind: type[RigError], code: int) -> None:
    assert kind.exit_code == code
    assert issubclass(kind, RigError)


def test_message_has_all_its_parts_in_order() -> None:
    error = FileError("too high", where="a.yaml:3: limits", value="12 V", allowed="up to 10 V", do="lower it")
    assert str(error) == "a.yaml:3: limits: too high: 12 V; allowed: up to 10 V; lower it"


def test_parts_left_out_leave_no_trace() -> None:
    assert sentence("broken") == "broken"
    assert sentence("broken", do="mend it") == "broken; mend it"


def test_nearest_ignores_case_and_gives_up_on_nonsense() -> None:
    assert nearest("FREQUENZY", ["frequency", "amplitude"]) == "frequency"
    assert nearest("xyzzy", ["frequency", "amplitude"]) is None


def test_unknown_lists_what_is_valid_with_and_without_a_proposal() -> None:
    assert unknown("key", "stpes", ["steps", "rig"])["do"] == "did you mean 'steps'?"
    assert unknown("key", "qq", ["steps", "rig"]) == {"what": "unknown key 'qq'", "allowed": "rig, steps"}


def test_a_misfit_keeps_its_parts_when_it_is_placed() -> None:
    placed = MisfitError("no unit", value="3", allowed="a voltage", do="write 3 V").placed("p.yaml:2: level")
    assert isinstance(placed, FileError)
    assert str(placed) == "p.yaml:2: level: no unit: 3; allowed: a voltage; write 3 V"


@pytest.mark.parametrize(("said", "shown"), [
    ("no answer: b'\x00\x1b[2J'", r"no answer: b'\x00\x1b[2J'"), ("1.5 µV ± 3 %", "1.5 µV ± 3 %"),
    ("two\nlines", "two\nlines"), ("a\ttab", r"a\ttab"),
])
def test_control_characters_are_written_out(said: str, shown: str) -> None:
    assert visible(said) == shown
    assert str(DeviceError("what", value=said)) == f"what: {shown}"
