"""How is a long job shown while it goes on, and an error when it ends one?

Progress goes to stderr, and only to a terminal; results go to stdout. Rich is loaded when a bar is shown.
"""

import logging
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

from rig.errors import RigError

BROKEN = 70
"""Exit code of a fault in the program itself (EX_SOFTWARE): no script may take it for an answer."""


@contextmanager
def bar(title: str, quiet: bool) -> Iterator[Callable[[str, float], None]]:
    """Give a function of (sentence, share 0 to 1) that keeps a bar with the time left; silent away from a terminal."""
    if quiet or not sys.stderr.isatty():
        yield lambda sentence, share: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as shown:
        task = shown.add_task(title, total=1.0)
        yield lambda sentence, share: shown.update(task, description=sentence or title, completed=share)


@contextmanager
def counted(title: str, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    """Give a function of (done, total) that keeps the same bar."""
    with bar(title, quiet) as show:
        yield lambda done, total: show(title, done / max(total, 1))


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
