"""How does a picture become part of a page that needs nothing from elsewhere, and of one on paper?

A picture is a row of panels, each small enough to be read on a phone; a page sets two beside one another where it is
wide enough. Panels are SVG with their text kept as text, or PNG where there are too many lines, embedded as data. Their
colours differ in lightness as well, and what is told apart by colour is told apart by its line, its marker or its
filling, too: tests/unit/identify/page/test_palette.py looks at them as the colour-blind and a grey printer do.
"""

import base64
import io
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from identify.page.thinned import spread
from identify.trace import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Draw = Callable[["Axes"], None]

INK, EDGE, PALE, RECORDED = "#1f2933", "#66717c", "#d3dae0", "#868f99"
PANEL_IN = (4.4, 2.8)
DPI = 150  # of panels with so many lines that they are kept as pixels
LONGEST = 44  # characters of a name that a panel has room for
MISSING_GLYPH = "Glyph .* missing from font"  # a name in a script that the font of the picture lacks
SIZES = {"font.size": 9.0, "axes.titlesize": 9.0, "legend.fontsize": 8.5, "legend.title_fontsize": 9.0,
         "lines.linewidth": 1.3, "xtick.major.size": 3.5, "ytick.major.size": 3.5}  # fmt: skip
STYLE: Any = {
    "svg.fonttype": "none", "svg.hashsalt": "rig", "pdf.fonttype": 42, "text.parse_math": False,
    "font.family": "sans-serif", "axes.titlelocation": "left",
    "axes.edgecolor": EDGE, "axes.labelcolor": INK, "text.color": INK, "xtick.color": INK, "ytick.color": INK,
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#e6eaee",
    "axes.axisbelow": True, "legend.frameon": False, "path.simplify": True,
}  # fmt: skip


@dataclass(frozen=True)
class Look:
    """How one thing is drawn in every picture: its colour, its line, and the filling and hatching of its area."""

    colour: str
    line: str = "-"
    marker: str = "o"
    filling: float = 1.0
    hatch: str = ""


BEFORE = Look("#d55e00", "--", "s", 0.45)
AFTER = Look("#083a72")


@dataclass(frozen=True)
class Panel:
    """One set of axes: what draws it, and the words that stand for it where it cannot be seen."""

    draw: Draw
    alt: str
    height_in: float = PANEL_IN[1]
    pixels: bool = False


@dataclass(frozen=True)
class Picture:
    """Panels under one heading."""

    title: str
    panels: tuple[Panel, ...]
    caption: str = ""


@contextmanager
def page_style(scale: float = 1.0) -> Iterator[None]:
    """Draw everything inside in the style of the page, letters and lines so many times as large."""
    import matplotlib as mpl

    sizes: Any = {name: scale * size for name, size in SIZES.items()}
    with mpl.rc_context({**STYLE, **sizes}), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=MISSING_GLYPH)
        yield


def new_figure(width_in: float, height_in: float) -> tuple["Figure", "Axes"]:
    """Return a figure with one set of axes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    return figure, figure.subplots()


def embedded(panel: Panel) -> str:
    """Return a panel as a data URI; the same panel gives the same text."""
    buffer = io.BytesIO()
    with page_style():
        figure, axes = new_figure(PANEL_IN[0], panel.height_in)
        panel.draw(axes)
        if panel.pixels:
            figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
        else:
            figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    kind = "png" if panel.pixels else "svg+xml"
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"


def draw_signal(axes: "Axes", time: Array, values: Array, look: Look, label: str = "") -> None:
    """Draw a signal over time, as a line where it is short and as the area of its extremes where it is long."""
    at, low, high = spread(time, values)
    name = label or None
    if low is high:
        axes.plot(at, values, look.line, color=look.colour, linewidth=1.0, label=name)
    else:
        axes.fill_between(at, low, high, facecolor=(look.colour, look.filling), edgecolor=look.colour, linewidth=0.6,
                          label=name)  # fmt: skip


def legend_above(axes: "Axes", title: str = "", columns: int = 2) -> None:
    """Put the legend over the axes, where it hides nothing, the name of what is drawn in front of it."""
    axes.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, title=short(title) or None, alignment="left",
        borderaxespad=0.0, handlelength=1.7, handletextpad=0.5, columnspacing=1.0,
    )  # fmt: skip


def logarithmic(axes: "Axes", names: Sequence[str]) -> None:
    """Make axes ``x`` or ``y`` logarithmic, with numbers as one writes them."""
    from matplotlib.ticker import FuncFormatter, LogFormatter

    class Sparing(LogFormatter):
        """Writes numbers between the decades where there are too few of those to read from."""

        def __call__(self, x: float, pos: int | None = None) -> str:
            return f"{x:g}" if super().__call__(x, pos) else ""

    for name in names:
        axis = axes.xaxis if name == "x" else axes.yaxis
        (axes.set_xscale if name == "x" else axes.set_yscale)("log")
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(Sparing())


def short(name: str) -> str:
    """Return a name that fits over a panel: its middle left out where it is long, no characters that cannot be seen."""
    seen = "".join(char if char.isprintable() else "\N{REPLACEMENT CHARACTER}" for char in name)
    half = LONGEST // 2 - 2
    return seen if len(seen) <= LONGEST else f"{seen[:half]} ... {seen[-half:]}"
