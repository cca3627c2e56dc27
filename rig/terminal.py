"""How is a long job shown while it goes on, and an error when it ends one?

Progress goes to stderr, results to stdout. On a terminal there is a bar with what is being done, for how long, and how
long it still takes; elsewhere a plain line of the same now and then: whoever reads a log sees that a job lives, and a
short job says nothing. Rich is loaded when a bar is shown.
"""

import logging
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from time import monotonic
from typing import TYPE_CHECKING, TextIO

from rig.errors import RigError, visible
from rig.progress import Show, silent

if TYPE_CHECKING:
    from rich.progress import Progress

BROKEN = 70
"""Exit code of a fault in the program itself (EX_SOFTWARE): no script may take it for an answer."""
EVERY_S = 10.0
"""Between two plain lines."""
ENOUGH = 0.02
"""Share of a job that must be over before the time of the rest is told from it."""


@contextmanager
def bar(title: str, quiet: bool) -> Iterator[Show]:
    """Give a function of (sentence, share 0 to 1) that shows progress and the time left; with ``quiet``, none."""
    if quiet:
        yield silent
    elif sys.stderr.isatty():
        with _drawn(title) as show:
            yield show
    else:
        yield _Lines(title, sys.stderr).show


@contextmanager
def counted(title: str, quiet: bool, unit: str = "samples") -> Iterator[Callable[[int, int], None]]:
    """Give a function of (done, total) that shows the same."""
    with bar(title, quiet) as show:
        yield lambda done, total: show(f"{done} of {total} {unit}", done / max(total, 1))


def left_s(passed_s: float, share: float) -> float | None:
    """Return how long the rest of a job takes at the pace so far, s; None where that cannot be told."""
    return passed_s * (1.0 - share) / share if ENOUGH <= share < 1.0 else None


def in_words(rest_s: float | None) -> str:
    """Return how long a job still takes in words; empty where that is not known, or it took longer than thought."""
    return f"about {rounded(rest_s)} left" if rest_s and rest_s > 0.0 else ""


def rounded(seconds: float) -> str:
    """Return a time in words, as exactly as an estimate is."""
    if seconds < 99.5:
        return f"{max(seconds, 1.0):.0f} s" if seconds < 10.0 else f"{5.0 * round(seconds / 5.0):.0f} s"
    return f"{seconds / 60.0:.0f} min" if seconds < 5400.0 else f"{seconds / 3600.0:.1f} h"


@contextmanager
def _drawn(title: str) -> Iterator[Show]:
    """Give what keeps a bar on a terminal; it is taken away at the end."""
    began = monotonic()
    with _bar() as shown:
        task = shown.add_task(title, total=1.0, ends_s=None)

        def show(sentence: str, share: float) -> None:
            now = monotonic()
            words = visible(f"{title}: {sentence}" if sentence and not sentence.startswith(title) else title)
            rest_s = left_s(now - began, share)
            shown.update(task, description=words, completed=share, ends_s=None if rest_s is None else now + rest_s)

        yield show


def _bar() -> "Progress":
    """Return a bar with what is done, its share, how long it takes, and the time left."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        SpinnerColumn,
        Task,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
    )
    from rich.text import Text

    class Rest(TextColumn):
        """The time left as it was told last, less what has passed since."""

        def render(self, task: Task) -> Text:
            ends_s: float | None = task.fields["ends_s"]
            return Text(in_words(None if ends_s is None else ends_s - monotonic()))

    told = TextColumn("{task.description}", markup=False)
    columns = (SpinnerColumn(), told, BarColumn(bar_width=24), TaskProgressColumn(), TimeElapsedColumn(), Rest(""))
    return Progress(*columns, console=Console(stderr=True), transient=True)


class _Lines:
    """Plain lines of progress, the first after a while."""

    def __init__(self, title: str, stream: TextIO) -> None:
        self._title, self._stream = title, stream
        self._began = self._last = monotonic()

    def show(self, sentence: str, share: float) -> None:
        """Say how far the job is where the last line is long ago."""
        now = monotonic()
        if now - self._last < EVERY_S:
            return
        self._last = now
        passed = now - self._began
        parts = (f"{100.0 * share:.0f} %", sentence, f"{rounded(passed)} so far", in_words(left_s(passed, share)))
        self._stream.write(f"{visible(self._title)}: {visible(', '.join(filter(None, parts)))}\n")
        self._stream.flush()


def set_up_log(debug: bool) -> None:
    """Send the program's log to stderr with ``debug``, nowhere without: what matters is told in the results."""
    if debug:
        logging.basicConfig(level=logging.INFO, format="%(name)s: %(message)s", stream=sys.stderr)
    else:
        logging.getLogger("rig").addHandler(logging.NullHandler())
        logging.getLogger("drivers").addHandler(logging.NullHandler())


def failed(error: RigError, debug: bool, stream: TextIO | None = None) -> int:
    """Tell an error in one message and return its exit code; with ``debug``, where it was raised comes first."""
    stream = stream or sys.stderr
    if debug:
        traceback.print_exception(error, file=stream)
    stream.write(f"rig: {error}\n")
    return error.exit_code


def broken(error: Exception, debug: bool, stream: TextIO | None = None) -> int:
    """Tell of a fault in the program itself and return its exit code."""
    stream = stream or sys.stderr
    if debug:
        traceback.print_exception(error, file=stream)
    what = f"{type(error).__name__}: {error}".splitlines()[0]
    stream.write(f"rig: a fault in the program itself: {what}; run it again with --debug and report what it prints\n")
    return BROKEN
