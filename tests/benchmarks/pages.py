"""What do the pages of all kinds of answers look like, and what do they cost?

``python -m tests.benchmarks.pages FOLDER`` answers trials of every kind and writes each page there, as HTML and as PDF;
where a Chromium is installed also its picture at a desk's width and at a phone's, to be looked at.
"""

import shutil
import sys
import time
from collections.abc import Callable
from pathlib import Path

from identify.compared import compare
from identify.explain import explain
from identify.joint import identify
from identify.page.blocks import Panels, blocks_of
from identify.page.comparison_page import Beside, comparison_page
from identify.page.document import Page
from identify.page.report import explanation_page, identification_page
from identify.trace import Trace
from tests.browser import BROWSERS, DESK, PHONE, at_size, chromium, overflows, whole_page
from tests.proof.ask import trace_of
from tests.proof.bench import record
from tests.proof.cases import CASES
from tests.trials import model_of

EXPLAINED = {
    "consistent": "clean, op-amp", "one effect": "saturation", "two effects": "saturation and hum",
    "undecided": "extra_pole, G1", "unnamed": "crosstalk", "linear F": "backlash",
}  # fmt: skip
CASE = {case.name: case for case in CASES}


def recorded(name: str) -> tuple[list[Trace], list[Trace]]:
    """Return the runs of a case to fit and to hold out."""
    runs = record(CASE[name])
    return ([trace_of(run) for run in runs if not run.held_out], [trace_of(run) for run in runs if run.held_out])


def explained(name: str) -> Page:
    train, test = recorded(name)
    told = explain(model_of(CASE[name].nominal), train, test)
    return explanation_page(told, identify(told.model, (*train, *test)))


def bent() -> Page:
    train, test = recorded("curved_border")
    return identification_page(identify(model_of(CASE["curved_border"].nominal), (*train, *test), None, "curved"))


def compared() -> Page:
    """Return the page on the same rig's two staircases, of which one goes further."""
    (first, second, *_), _ = recorded("clean, op-amp")
    found = compare(model_of(CASE["clean, op-amp"].nominal), [first], [second], physics=False)
    return comparison_page(found, Beside(first.name, second.name))


PAGES: dict[str, Callable[[], Page]] = {
    **{kind: (lambda name=name: explained(name)) for kind, name in EXPLAINED.items()},
    "bent borders": bent, "compared": compared,
}  # fmt: skip


def measured(page: Page, path: Path) -> str:
    """Write a page; return its row of the table: panels, kB and processor seconds on the screen and on paper."""
    began = time.process_time()
    html = page.html()
    between = time.process_time()
    pdf = page.pdf()
    ended = time.process_time()
    path.with_suffix(".html").write_text(html, encoding="utf-8")
    path.with_suffix(".pdf").write_bytes(pdf)
    count = sum(len(b.numbers) for b in blocks_of(page.html_with(lambda panel: "0")) if isinstance(b, Panels))
    return (f"{count} | {len(html.encode()) / 1e3:.0f} | {between - began:.1f} | {len(pdf) / 1e3:.0f} | "
            f"{ended - between:.1f}")  # fmt: skip


def looked_at(paths: list[Path]) -> None:
    """Write the picture of every page at both widths, and say what must be scrolled sideways."""
    with chromium() as browser:
        for path in paths:
            for name, size in (("desk", DESK), ("phone", PHONE)):
                at_size(browser, size)
                browser.get(path.with_suffix(".html").resolve().as_uri())
                whole_page(browser, path.with_name(f"{path.name}_{name}.png"))
                if (beyond := overflows(browser, size)) > 0:
                    print(f"{path.name}: {beyond} pixels wider than a {name}")


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    print("| answer | panels | HTML, kB | s | PDF, kB | s |\n|---|---|---|---|---|---|")
    for kind, make in PAGES.items():
        paths.append(folder / kind.replace(" ", "_"))
        print(f"| {kind} | {measured(make(), paths[-1])} |", flush=True)
    if any(map(shutil.which, BROWSERS)):
        looked_at(paths)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "pages"))
