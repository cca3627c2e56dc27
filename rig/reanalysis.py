"""What does a question answer to, in a process that may be anywhere and may fail?"""

import threading
import traceback
from collections.abc import Mapping
from pathlib import Path
from time import perf_counter

from rig import workflow
from rig.errors import FileError, RigError
from rig.outputs import json_text
from rig.provenance import program
from rig.question import Question, Source, versions
from rig.work import Kind, Order, Outcome

FAILURE = "rig.failure/1"


class TooLongError(RigError):
    """An answer takes longer than it may."""


_one_at_a_time = threading.Lock()
"""A process with several threads of work gains nothing from a second answer beside the first."""


def answered(question: Question, progress: workflow.Progress | None = None) -> str:
    """Return the JSON of the answer to a question; raise FileError when the recordings cannot tell."""
    runs = workflow.load_asked(question)
    if question.job == "identify":
        found = workflow.identify_runs(runs, progress, question.borders, question.knots)
        return workflow.answer_json(found, {**runs.beside(), **question.told()})
    return workflow.answer_json(workflow.explain_runs(runs, progress), {**runs.beside(), **question.told()})


def work(order: Order) -> Outcome:
    """Do what is ordered; no error leaves this function."""
    from rig.compiled import take_turns

    take_turns()
    with _one_at_a_time:
        began = perf_counter()
        try:
            kind, text, message = _done(order, _in_time(order))
        except Exception as error:  # of the machine, before the recording was seen
            kind, text, message = "failed", "", _sentence(error)
        return Outcome(order.path, kind, text, message, perf_counter() - began)


def _in_time(order: Order) -> workflow.Progress:
    """Return a progress that raises TooLongError once the time of an order is over.

    A process of our own is ended besides (``rig/crew.py``); one of a cluster does the work of others too, and is not.
    """
    until = None if order.limit_s is None else perf_counter() + order.limit_s

    def look(sentence: str, share: float) -> None:
        if until is not None and perf_counter() > until:
            raise TooLongError(order.too_long)

    return look


def _done(order: Order, progress: workflow.Progress) -> tuple[Kind, str, str]:
    """Return kind, text and message; raise what goes wrong before the bytes of the recording are known."""
    _check_program(order.program)
    before = order.path.stat() if order.path.is_file() else None
    source = Source.of(order.path)
    if source.sha256 == order.known:
        return "unchanged", "", ""
    question = order.question.of((order.path,))
    try:
        text = answered(question, progress)
    except (MemoryError, OSError, TooLongError) as error:
        return "failed", "", _sentence(error)
    except Exception as error:
        message = _sentence(error)
        return "failed", json_text({"schema": FAILURE, "message": message, **question.told()}), message
    after = order.path.stat()
    if before is None or (before.st_ino, before.st_size, before.st_mtime_ns) != (
        after.st_ino, after.st_size, after.st_mtime_ns,
    ):  # fmt: skip
        raise FileError("the recording changed while it was in use", where=str(order.path), do="start again")
    return "answered", text, ""


def _check_program(expected: Mapping[str, str]) -> None:
    """Raise RigError where this program is not the one that ordered."""
    mine, theirs = versions(program()), versions(expected)
    other = [key for key in sorted({*mine, *theirs}) if mine.get(key) != theirs.get(key)]
    if other:
        raise RigError(
            "the worker runs another program", value=f"{other[0]} {mine.get(other[0])}",
            allowed=f"{theirs.get(other[0])}, as where the batch was started", do="install the same versions on both",
        )  # fmt: skip


def _sentence(error: Exception) -> str:
    """Return what went wrong in one line; a fault in the program names its place."""
    if isinstance(error, RigError):
        return " ".join(str(error).split())
    if isinstance(error, MemoryError):
        return "not enough memory for this recording"
    if isinstance(error, OSError):
        return f"{error.filename or 'the system'}: {error.strerror or error}"
    frame = traceback.extract_tb(error.__traceback__)[-1]
    what = " ".join(f"{type(error).__name__}: {error}".split())
    return f"a fault in the program itself: {what} ({Path(frame.filename).name}:{frame.lineno})"
