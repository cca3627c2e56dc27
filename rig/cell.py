"""How does a long job show itself where it was asked for from Python: under a notebook's cell, or on a terminal?"""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic

from rig.errors import visible
from rig.progress import Show
from rig.terminal import bar, in_words, left_s

EVERY_S = 0.25
"""Between two lines under a cell: each goes to the browser."""


@contextmanager
def told_here(title: str, given: Show | None) -> Iterator[Show]:
    """Give what the caller wants to be told with; else a line under the cell, or a bar on a terminal.

    A script whose output goes elsewhere shows nothing.
    """
    if given is not None:
        yield given
    elif _in_a_notebook():
        with _under_the_cell(title) as show:
            yield show
    else:
        with bar(title, quiet=not sys.stderr.isatty()) as show:
            yield show


def _in_a_notebook() -> bool:
    """Tell whether a notebook's kernel runs this: a script that only talks to one has its modules loaded, too."""
    kernel = sys.modules.get("ipykernel.kernelapp")
    return kernel is not None and bool(kernel.IPKernelApp.initialized())


@contextmanager
def _under_the_cell(title: str) -> Iterator[Show]:
    """Give what keeps one line under the cell that runs; it is taken away at the end."""
    from IPython.display import display

    began, last = monotonic(), -EVERY_S
    line = display(_text(title), raw=True, display_id=True)  # type: ignore[no-untyped-call]

    def show(sentence: str, share: float) -> None:
        nonlocal last
        now = monotonic()
        if now - last >= EVERY_S:
            last = now
            parts = (f"{title}: {100.0 * share:.0f} %", sentence, in_words(left_s(now - began, share)))
            line.update(_text(", ".join(filter(None, parts))), raw=True)

    try:
        yield show
    finally:
        line.update(_text(""), raw=True)


def _text(words: str) -> dict[str, str]:
    return {"text/plain": visible(words)}
