"""How does a page get onto paper: set by matplotlib on sheets of A4, two panels beside one another?

All lengths are points, 1/72 inch, and heights are counted from the top of a sheet.
"""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, final

from identify.page.blocks import Block, Grid, Kind, Panels, Words, blocks_of
from identify.page.drawing import DPI, INK, PALE, PANEL_IN, Panel, page_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.font_manager import FontProperties
    from matplotlib.transforms import Bbox

INCH = 72.0
SHEET, MARGIN = (595.3, 841.9), 48.0
WIDTH, BOTTOM = SHEET[0] - 2.0 * MARGIN, SHEET[1] - MARGIN
BESIDE = 10.0  # between two panels, and two columns of a table
LEADING = 1.35
ABOVE_PANELS = 6.0
SOFT = "#515c68"
ROUNDS = 2  # in which axes are fitted into their place: their labels take more room the wider they are
FEW_LINES = 3.0  # that must follow a heading on its sheet


@dataclass(frozen=True)
class Face:
    """How words are set: size in points, weight, colour, the room above them, and whether letters are equally wide."""

    size: float
    weight: str = "normal"
    colour: str = INK
    above: float = 3.0
    indent: float = 0.0
    family: str = "sans-serif"

    @property
    def line(self) -> float:
        """Return the height of a line."""
        return self.size * LEADING

    def font(self) -> "FontProperties":
        """Return what matplotlib calls it."""
        from matplotlib.font_manager import FontProperties

        return FontProperties(family=self.family, size=self.size, weight=self.weight)

    def width(self, text: str) -> float:
        """Return how wide a text is."""
        from matplotlib.textpath import text_to_path

        return float(text_to_path.get_text_width_height_descent(text, self.font(), False)[0])


FACES: dict[Kind, Face] = {
    "kicker": Face(7.5, "bold", SOFT, 0.0), "h1": Face(14.0, "bold", above=2.0), "h2": Face(11.0, "bold", above=14.0),
    "h3": Face(9.5, "bold", above=9.0), "p": Face(9.0), "soft": Face(8.0, colour=SOFT),
    "incomplete": Face(9.0, "bold", above=6.0), "equation": Face(8.5, family="monospace"), "li": Face(9.0, indent=12.0),
    "pre": Face(7.5, above=4.0, family="monospace"), "caption": Face(7.5, colour=SOFT, above=3.0),
}  # fmt: skip
CELL, HEADING, STRONG = Face(8.0), Face(7.5, "bold", SOFT), Face(8.0, "bold")
FOOT = Face(7.0, colour=SOFT)
HEADS = frozenset({"h2", "h3"})


def printed(html: str, panels: Sequence[Panel], title: str) -> bytes:
    """Return a page as a PDF, the same bytes for the same page; ``panels`` are what its pictures' addresses number."""
    from matplotlib.backends.backend_pdf import PdfPages

    buffer = io.BytesIO()
    found = blocks_of(html)
    with page_style(_panel_width() / (PANEL_IN[0] * INCH)):
        press = _Press(panels)
        for block, after in zip(found, [*found[1:], None], strict=True):
            press.put(block, after)
        with PdfPages(buffer, metadata={"Title": title, "Creator": None, "CreationDate": None}) as pages:
            for number, sheet in enumerate(press.sheets, 1):
                _write(sheet, SHEET[0] - MARGIN, SHEET[1] - 24.0, f"{number} of {len(press.sheets)}", FOOT, "right")
                pages.savefig(sheet, dpi=DPI)
    return buffer.getvalue()


def wrapped(text: str, face: Face, width: float) -> Iterator[str]:
    """Yield the lines of a text, broken between words, and within one where it is wider than a line."""
    line = ""
    for word in text.split(" "):
        longer = f"{line} {word}" if line else word
        if face.width(longer) <= width:
            line = longer
            continue
        if line:
            yield line
        *whole, line = _cut(word, face, width)
        yield from whole
    yield line


def _cut(word: str, face: Face, width: float) -> list[str]:
    """Return a word in pieces that each fit into a line."""
    pieces = [""]
    for char in word:
        if face.width(pieces[-1] + char) > width and pieces[-1]:
            pieces.append("")
        pieces[-1] += char
    return pieces


def columns(grid: Grid, width: float) -> list[float]:
    """Return how wide the columns of a table are: as wide as they need, the widest ones sharing what is left."""
    rows = [*([grid.headings] if grid.headings else []), *grid.rows]
    needs = [max(STRONG.width(cell) for cell in column) + BESIDE for column in zip(*rows, strict=True)]
    left, found = width, dict.fromkeys(range(len(needs)), 0.0)
    for done, at in enumerate(sorted(found, key=lambda i: needs[i])):
        found[at] = min(needs[at], left / (len(needs) - done))
        left -= found[at]
    return list(found.values())


@final
class _Press:
    """The sheets set so far, and how far down the last one is full."""

    def __init__(self, panels: Sequence[Panel]) -> None:
        self.sheets: list[Figure] = []
        self._panels = panels
        self._y = 0.0
        self._turn()

    def put(self, block: Block, after: Block | None) -> None:
        """Set a block; a heading stays with what is under it."""
        match block:
            case Words(kind, text):
                face = FACES[kind]
                self._room(face.line + (self._least(after) if kind in HEADS else 0.0))
                self._words(text, face)
            case Grid():
                self._grid(block)
            case Panels(numbers):
                for first in range(0, len(numbers), 2):
                    self._row([self._panels[number] for number in numbers[first : first + 2]])

    def _least(self, block: Block | None) -> float:
        """Return how much of a block must not be parted from the heading over it."""
        if isinstance(block, Panels):
            return ABOVE_PANELS + max(_height(self._panels[number]) for number in block.numbers[:2])
        return FEW_LINES * CELL.line

    def _turn(self) -> None:
        """Begin a sheet."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure

        sheet = Figure(figsize=(SHEET[0] / INCH, SHEET[1] / INCH))
        FigureCanvasAgg(sheet)
        self.sheets.append(sheet)
        self._y = MARGIN

    def _room(self, height: float) -> None:
        """Begin a sheet where so much does not fit on this one."""
        if self._y + height > BOTTOM and self._y > MARGIN:
            self._turn()

    def _words(self, text: str, face: Face) -> None:
        self._y += face.above if self._y > MARGIN else 0.0
        for paragraph in text.split("\n"):
            for line in wrapped(paragraph, face, WIDTH - face.indent):
                self._room(face.line)
                self._y += face.line
                _write(self.sheets[-1], MARGIN + face.indent, self._y - 0.3 * face.size, line, face)

    def _grid(self, grid: Grid) -> None:
        widths = columns(grid, WIDTH)
        self._y += CELL.above
        if any(grid.headings):
            self._cells(grid.headings, widths, HEADING)
        for i, row in enumerate(grid.rows):
            self._cells(row, widths, STRONG if i == grid.strong else CELL)

    def _cells(self, row: Sequence[str], widths: Sequence[float], face: Face) -> None:
        """Set one row of a table, with a line under it."""
        lines = [list(wrapped(cell, face, width - BESIDE)) for cell, width in zip(row, widths, strict=True)]
        height = face.line * max(map(len, lines)) + 3.0
        self._room(height)
        x = MARGIN
        for cell, width in zip(lines, widths, strict=True):
            for i, line in enumerate(cell, 1):
                _write(self.sheets[-1], x, self._y + i * face.line - 0.3 * face.size, line, face)
            x += width
        self._y += height
        _rule(self.sheets[-1], self._y - 1.0)

    def _row(self, panels: Sequence[Panel]) -> None:
        """Set one or two panels beside one another."""
        height = max(map(_height, panels))
        self._y += ABOVE_PANELS
        self._room(height)
        for i, panel in enumerate(panels):
            left = MARGIN + i * (_panel_width() + BESIDE)
            _place(self.sheets[-1], panel, (left, self._y, _panel_width(), _height(panel)))
        self._y += height


def _panel_width() -> float:
    return (WIDTH - BESIDE) / 2.0


def _height(panel: Panel) -> float:
    return panel.height_in / PANEL_IN[0] * _panel_width()


def _write(sheet: "Figure", x: float, y: float, text: str, face: Face, side: str = "left") -> None:
    """Put one line on a sheet, its letters standing at height y."""
    sheet.text(x / SHEET[0], 1.0 - y / SHEET[1], text, fontproperties=face.font(), color=face.colour, ha=side)


def _rule(sheet: "Figure", y: float) -> None:
    """Draw a thin line across a sheet."""
    from matplotlib.lines import Line2D

    at = 1.0 - y / SHEET[1]
    sheet.add_artist(Line2D((MARGIN / SHEET[0], 1.0 - MARGIN / SHEET[0]), (at, at), color=PALE, linewidth=0.5))


def _place(sheet: "Figure", panel: Panel, box: tuple[float, float, float, float]) -> None:
    """Draw a panel into (left, top, width, height) of a sheet, its labels and its legend within."""
    left, top, width, height = box
    wanted = (left, SHEET[1] - top - height, left + width, SHEET[1] - top)
    axes = sheet.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_position(_relative(wanted))
    panel.draw(axes)
    if panel.pixels:
        for line in axes.lines:
            line.set_rasterized(True)
    for _ in range(ROUNDS):
        _fit(sheet, axes, wanted)


def _fit(sheet: "Figure", axes: "Axes", wanted: tuple[float, float, float, float]) -> None:
    """Move the edges of axes by what their labels stand out of, or fall short of, the box (x0, y0, x1, y1)."""
    taken = axes.get_tightbbox()
    assert taken is not None
    taken = taken.transformed(sheet.dpi_scale_trans.inverted())
    now = axes.get_position()
    edges = (now.x0 * SHEET[0], now.y0 * SHEET[1], now.x1 * SHEET[0], now.y1 * SHEET[1])
    ends = (taken.x0 * INCH, taken.y0 * INCH, taken.x1 * INCH, taken.y1 * INCH)
    axes.set_position(_relative(tuple(e + w - t for e, w, t in zip(edges, wanted, ends, strict=True))))


def _relative(box: Sequence[float]) -> "Bbox":
    """Return a box (x0, y0, x1, y1) from the lower left corner as shares of a sheet."""
    from matplotlib.transforms import Bbox

    x0, y0, x1, y1 = box
    return Bbox(((x0 / SHEET[0], y0 / SHEET[1]), (x1 / SHEET[0], y1 / SHEET[1])))
