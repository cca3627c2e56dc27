"""Is progress told where somebody looks, in plain lines elsewhere, not at all when quiet, and never as markup?"""

import io
import re
import sys

import pytest

from rig import terminal
from rig.progress import each, told
from rig.tabular import Table
from rig.typed import say


class Screen(io.StringIO):
    """A terminal that keeps what is written."""

    def isatty(self) -> bool:
        return True


class Clock:
    """A clock that goes when it is told to."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    made = Clock()
    monkeypatch.setattr(terminal, "monotonic", made)
    return made


def test_away_from_a_terminal_a_long_job_says_a_plain_line_now_and_then(
    clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    with terminal.bar("explaining", quiet=False) as show:
        for second in range(26):
            clock.now = 100.0 + second
            show("trying what may be missing", second / 50.0)
    out, err = capsys.readouterr()
    assert not out
    assert err.splitlines() == [
        "explaining: 20 %, trying what may be missing, 10 s so far, about 40 s left",
        "explaining: 40 %, trying what may be missing, 20 s so far, about 30 s left",
    ]


def test_a_short_job_and_a_quiet_one_say_nothing(clock: Clock, capsys: pytest.CaptureFixture[str]) -> None:
    with terminal.bar("explaining", quiet=False) as show:
        show("trying", 0.5)
    with terminal.bar("explaining", quiet=True) as show:
        clock.now += 100.0
        show("trying", 0.5)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("passed_s", "share", "words"),
    [(10.0, 0.2, "about 40 s left"), (3.0, 0.5, "about 3 s left"), (100.0, 0.1, "about 15 min left"), (10.0, 0.001, ""),
     (3600.0, 0.25, "about 3.0 h left"), (5.0, 1.0, ""), (0.1, 0.9, "about 1 s left")],
)  # fmt: skip
def test_the_time_left_is_told_as_exactly_as_it_is_known(passed_s: float, share: float, words: str) -> None:
    assert terminal.in_words(terminal.left_s(passed_s, share)) == words


def test_what_took_longer_than_thought_promises_nothing() -> None:
    assert terminal.in_words(-1.0) == ""
    assert terminal.in_words(None) == ""


def seen(screen: Screen) -> str:
    """Return what a screen shows, without colours and cursor movements."""
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", screen.getvalue())


def test_on_a_terminal_there_is_a_bar_and_words_are_no_markup(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Screen()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "120")
    with terminal.counted("recording", quiet=False) as count:
        count(500, 1000)
    with terminal.bar("listing", quiet=False) as show:
        show("[red]a\x1b[2Jb[/red]", 0.5)
    assert "recording: 500 of 1000 samples" in seen(screen)
    assert " 50%" in seen(screen)
    assert "[red]a\\x1b[2Jb[/red]" in seen(screen)


TABLE = Table(("what", "how much"), (("[b]bold[/b]", "1"), ("x" * 30 + "\x07", "two words")), indent=2)


def test_a_table_is_plain_lines_away_from_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    say(["first", TABLE])
    assert capsys.readouterr().out.splitlines() == [
        "first",
        "  what" + 30 * " " + "  how much",
        "  [b]bold[/b]" + 25 * " " + "1",
        "  " + "x" * 30 + "\\x07  two words",
    ]


def test_a_table_is_drawn_on_a_terminal_no_wider_than_that(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Screen()
    monkeypatch.setattr(sys, "stdout", screen)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "44")
    say([TABLE])
    lines = seen(screen).splitlines()
    assert all(len(line) <= 44 for line in lines)
    assert any("[b]bold[/b]" in line for line in lines)
    assert any("\u2500" in line for line in lines)
    assert "\x07" not in screen.getvalue()


def test_a_job_of_parts_says_how_far_all_of_it_is() -> None:
    said: list[tuple[str, float]] = []
    for name, show in each(["a", "b"], lambda sentence, share: said.append((sentence, share))):
        show(f"half of {name}", 0.5)
    list(told([(0, 5), (5, 10)], 10, "y", lambda sentence, share: said.append((sentence, share))))
    assert said == [("a", 0.0), ("a: half of a", 0.25), ("b", 0.5), ("b: half of b", 0.75), ("y: 0 of 10 samples", 0.0),
                    ("y: 5 of 10 samples", 0.5)]  # fmt: skip
