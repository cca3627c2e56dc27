"""Does a page of an answer say at its top that a recording it is from is incomplete?"""

from pathlib import Path

import numpy as np

from identify.compared import compare
from identify.page.document import Page
from rig import comparing, workflow
from rig.question import Source
from rig.recorded import Entry, Equipment, Origin, Recording
from tests.unit.identify.compared.test_compare import MODEL, day
from tests.unit.identify.page.test_report import explanation, identification

RUNS = workflow.Runs((), (), MODEL, incomplete=(("friday", "stopped by <Ctrl-C>"),))


def header(page: Page) -> str:
    """Return what stands above all else."""
    text = page.html_with(lambda panel: "")
    return text[text.index("<header") : text.index("</header>")]


def recording(name: str, kept: int) -> Recording:
    """Return a recording of which so many of 100 samples are kept."""
    ledger = np.full(100, Entry.NOT_RECEIVED, dtype=np.uint8)
    ledger[:kept] = Entry.RECORDED
    y = np.where(ledger == Entry.RECORDED, 1.0, np.nan)
    return Recording(name=name, rate_hz=1000.0, u=np.zeros(100), y=y, ledger=ledger, title=name,
                     complete=kept == 100, reason="" if kept == 100 else "stopped",
                     origin=Origin(Equipment("bench:", "integrator")))  # fmt: skip


def test_an_identification_and_an_explanation_say_so() -> None:
    for page in (workflow.identification_page(identification(), RUNS),
                 workflow.explanation_page(explanation(), None, RUNS)):
        assert "Incomplete:</b> friday: stopped by &lt;Ctrl-C&gt;" in header(page)


def test_a_comparison_says_which_side_is() -> None:
    found = compare(MODEL, day(1), day(2), physics=False)
    sources = tuple(Source(Path(f"{name}.h5"), "") for name in ("monday", "friday"))
    done = comparing.Compared(sources, (recording("monday", 100), recording("friday", 70)), found, (), ())
    told = header(comparing.comparison_page(done))
    assert "Incomplete:</b> friday.h5: stopped" in told
    assert "monday.h5: " not in told


def test_nothing_is_said_of_whole_recordings() -> None:
    assert "Incomplete" not in header(workflow.identification_page(identification(), workflow.Runs((), (), MODEL)))
