"""Can a page be read where an operator reads it: at a desk, on a phone, on paper, and by those who see little of it?

Contrast is WCAG 2.1's, success criterion 1.4.3: at least 4.5 to 1 for every text.
"""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from identify.page.document import Imprint, Page
from identify.page.report import explanation_page, identification_page
from tests.browser import DESK, PHONE, at_size, complaints, overflows
from tests.unit.identify.page.test_report import MODEL, explanation, identification

if TYPE_CHECKING:
    from selenium.webdriver import Chrome

HOSTILE = '<script>document.title = "taken"</script>"\'><img src=x onerror="document.title=1">'
LONG = "a_name_that_somebody_made_of_very_many_words_without_any_room_between_them_and_that_no_line_of_a_phone_can_hold"
LEAST_CONTRAST = 4.5
CONTRASTS = """
const light = (c) => { const v = c / 255; return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; };
const luminance = ([r, g, b]) => 0.2126 * light(r) + 0.7152 * light(g) + 0.0722 * light(b);
const numbers = (text) => text.match(/[0-9.]+/g).map(Number);
const behind = (e) => { for (; e; e = e.parentElement) { const c = numbers(getComputedStyle(e).backgroundColor);
  if (c.length < 4 || c[3] === 1) return c.slice(0, 3); if (c[3] > 0) throw new Error("a ground seen through"); }
  return [255, 255, 255]; };
const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), found = [];
for (let n = walker.nextNode(); n; n = walker.nextNode()) {
  const e = n.parentElement; if (!n.textContent.trim() || ["SCRIPT", "STYLE"].includes(e.tagName)) continue;
  const [a, b] = [numbers(getComputedStyle(e).color), behind(e)].map(luminance).sort((x, y) => y - x);
  found.push([(a + 0.05) / (b + 0.05), n.textContent.trim().slice(0, 40)]); }
return found;
"""


def hostile() -> Page:
    model = replace(MODEL, title=HOSTILE)
    told = explanation(model=model, sentence=f"{LONG} {HOSTILE}", warnings=(HOSTILE,))
    named = [replace(o, trace=replace(o.trace, name=f"{name} {LONG}"))
             for o, name in ((told.train[0], HOSTILE), (told.test[0], "$\\frac{1}{$ \x07 名"))]  # fmt: skip
    told = replace(told, train=(named[0],), test=(named[1],))
    return explanation_page(told, None, Imprint(f"rig: {HOSTILE}\n# {LONG}\n", {"rig": HOSTILE}, ((LONG, HOSTILE),)))


PAGES = {
    "explained": lambda: explanation_page(explanation(), identification(), Imprint("spec: 1\n", {"rig": "0.1.0"})),
    "identified": lambda: identification_page(identification()),
    "hostile": hostile,
}


@pytest.fixture(scope="module", params=PAGES)
def opened(request: pytest.FixtureRequest, browser: "Chrome", tmp_path_factory: pytest.TempPathFactory) -> "Chrome":
    path: Path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(PAGES[request.param]().html(), encoding="utf-8")
    browser.get("about:blank")
    complaints(browser)  # of a page that was looked at before and whose server is gone
    browser.get(path.as_uri())
    return browser


@pytest.mark.parametrize("size", [DESK, PHONE])
def test_nobody_has_to_scroll_sideways(opened: "Chrome", size: tuple[int, int]) -> None:
    at_size(opened, size)
    assert overflows(opened, size) <= 0
    inside = "return [...document.querySelectorAll('main *')].filter(e => e.scrollWidth > e.clientWidth + 1 && " \
             "e.clientWidth > 0 && getComputedStyle(e).display !== 'inline').map(e => e.outerHTML.slice(0, 80))"
    assert opened.execute_script(inside) == []


def test_no_two_panels_share_a_line_of_a_phone(opened: "Chrome") -> None:
    at_size(opened, PHONE)
    where = "return [...document.images].map(i => [i.naturalWidth, i.getBoundingClientRect().top])"
    tops = opened.execute_script(where)
    assert all(width > 0 for width, _ in tops)
    assert len({top for _, top in tops}) == len(tops)


@pytest.mark.parametrize("medium", ["screen", "print"])
def test_every_word_stands_out_from_what_is_behind_it(opened: "Chrome", medium: str) -> None:
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": medium})
    found = opened.execute_script(CONTRASTS)
    opened.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": ""})
    assert len(found) > 20
    assert [text for text in found if text[0] < LEAST_CONTRAST] == []


def test_what_stands_in_files_is_shown_and_not_run(opened: "Chrome") -> None:
    assert opened.title not in ("taken", "1")
    assert complaints(opened) == []
    assert opened.execute_script("return document.scripts.length") == 0


def test_the_test_of_contrast_can_fail(browser: "Chrome", tmp_path: Path) -> None:
    (tmp_path / "pale.html").write_text("<p>ink</p><p style='color: #999'>pale</p>", encoding="utf-8")
    browser.get((tmp_path / "pale.html").as_uri())
    (ink, pale) = browser.execute_script(CONTRASTS)
    assert ink[0] == pytest.approx(21.0)
    assert pale[0] == pytest.approx(2.85, abs=0.01)
