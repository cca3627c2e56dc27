"""Does a glance say what a thing is, and is whatever stands in a file only ever text?"""

import numpy as np

from identify.notebook.glance import MOST_ROWS, Glance
from identify.trace import Step, Trace

HOSTILE = Glance("Trace", "<script>alert(1)</script>\x1b[2J", (("a\nb", "<b>"), ("\u202eright", "to left")))


def test_what_stands_in_a_file_is_text_in_a_notebook() -> None:
    page = HOSTILE.html()
    assert "<script" not in page
    assert "<b>" not in page.replace("<b>Trace</b>", "")
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in page


def test_what_stands_in_a_file_moves_nothing_on_a_terminal() -> None:
    lines = HOSTILE.text().split("\n")
    assert len(lines) == 3
    assert all(line.isprintable() for line in lines)
    assert lines[0].endswith("</script>\\x1b[2J")


def test_a_long_list_is_cut_and_says_so() -> None:
    many = Glance("Trace", "many", tuple((f"step {i}", "x") for i in range(MOST_ROWS + 7)))
    assert many.text().splitlines()[-1].split() == ["...", "7", "more"]
    assert many.html().count("<tr>") == MOST_ROWS + 1


def test_a_trace_says_what_is_missing() -> None:
    valid = np.ones(500, dtype=bool)
    valid[100:103] = False
    trace = Trace("monday", 1e3, np.zeros(500), np.zeros(500), steps=(Step("walk", "staircase", 0, 500),), valid=valid)
    lines = repr(trace).splitlines()
    assert lines[0] == "Trace: monday, 500 samples at 1 kHz, 500 ms, u held between samples"
    assert [line.split() for line in lines[1:]] == [["missing", "3", "samples"], ["walk", "500", "samples"]]
    assert "monday" in trace._repr_html_()
