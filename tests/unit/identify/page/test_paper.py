"""Does paper say what the screen says, all of it, on sheets of A4, with nothing beyond their edges?"""

import re

import pypdfium2
import pytest

from identify.page.blocks import Grid, Panels, Words, blocks_of
from identify.page.document import Imprint, Page
from identify.page.drawing import Panel
from identify.page.paper import CELL, FACES, WIDTH, columns, printed, wrapped
from identify.page.report import explanation_page
from tests.unit.identify.page.test_layout import LONG, hostile
from tests.unit.identify.page.test_report import explanation, identification

A4_PT = (595.3, 841.9)
HTML = """<style>p { color: red }</style><title>unseen</title><h1>One  &amp;
 two</h1><ol class="chain"><li><b>G1</b>linear</li><li class="here"><b>F</b>line</li></ol>
<table><thead><tr><th>a</th><th></th></tr></thead><tbody><tr><td>1</td><td>2</td></tr><tr class="strong"><td>3</td><td>
4</td></tr></tbody></table><figure><div class="panels"><img src="0" alt="x"><img src="1" alt="y"></div><figcaption>seen
</figcaption></figure><ol><li>this</li><li>that</li></ol><pre>  as: it
stands</pre><p></p>"""


def explained() -> Page:
    imprint = Imprint("spec: 1\nrig: a <b>\n", {"rig": "0.1.0"}, (("sine", "stopped by <Ctrl-C>"),))
    return explanation_page(explanation(), identification(), imprint)


@pytest.fixture(scope="module", params=[explained, hostile])
def sheets(request: pytest.FixtureRequest) -> tuple[Page, bytes]:
    page: Page = request.param()
    return page, page.pdf()


def squeezed(text: str) -> str:
    """Return what is left of a text when it does not matter where its lines end, nor what no font has."""
    return re.sub(r"[^!-~]", "", text)


def test_paper_has_every_word_of_the_screen_and_every_picture(sheets: tuple[Page, bytes]) -> None:
    page, held = sheets
    on_paper = squeezed("".join(sheet.get_textpage().get_text_bounded() for sheet in pypdfium2.PdfDocument(held)))
    told = [block.text for block in blocks_of(page.html_with(lambda panel: "0")) if isinstance(block, Words)]
    assert len(told) > 10
    assert [text for text in told if squeezed(text) not in on_paper and len(text) < 80] == []
    assert sum(squeezed(text) in on_paper for text in told) > 0.8 * len(told)  # the others go on on the next sheet


def test_nothing_stands_beyond_the_edge_of_a_sheet(sheets: tuple[Page, bytes]) -> None:
    for sheet in pypdfium2.PdfDocument(sheets[1]):
        assert sheet.get_size() == pytest.approx(A4_PT, abs=0.1)
        words = sheet.get_textpage()
        boxes = [words.get_charbox(i) for i in range(words.count_chars())]
        assert boxes
        assert min(left for left, *_ in boxes) >= 0.0
        assert max(right for _, _, right, _ in boxes) <= A4_PT[0]
        assert min(bottom for _, bottom, *_ in boxes) >= 0.0


def test_the_same_page_gives_the_same_bytes() -> None:
    panels = [Panel(lambda axes: axes.plot([0.0, 1.0], label="a line"), "a line")] * 2
    assert printed(HTML, panels, "twice") == printed(HTML, panels, "twice")


def test_what_stands_on_a_page_is_read_from_top_to_end() -> None:
    assert blocks_of(HTML) == [
        Words("h1", "One & two"), Words("p", "G1 → [F]"), Grid(("a", ""), (("1", "2"), ("3", "4")), 1), Panels((0, 1)),
        Words("caption", "seen"), Words("li", "1. this"), Words("li", "2. that"), Words("pre", "  as: it\nstands"),
    ]  # fmt: skip


def test_a_line_is_never_wider_than_its_room_and_loses_nothing() -> None:
    text = f"a few words, then {LONG} and some more"
    lines = list(wrapped(text, FACES["p"], 150.0))
    assert all(FACES["p"].width(line) <= 150.0 for line in lines)
    assert squeezed("".join(lines)) == squeezed(text)


def test_columns_that_need_little_have_what_they_need() -> None:
    widths = columns(Grid(("a", "b"), (("10.01 mV", LONG),)), WIDTH)
    assert sum(widths) == pytest.approx(WIDTH)
    assert widths[0] >= CELL.width("10.01 mV")
