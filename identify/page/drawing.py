"""How does a figure become part of a page that needs nothing from elsewhere?

Figures are SVG with their text kept as text, or PNG where there are too many lines, embedded as data. Long signals are
drawn as the envelope of their extremes, so that a page stays small and no peak is lost.
"""

import base64
import io
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from identify.trace import Array, Mask

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Cells = NDArray[np.int64]

BEFORE, AFTER, INK, PALE = "#d1711f", "#1f5fa8", "#27323d", "#c9d1d9"
WIDTH_IN = 8.6
ENVELOPE_BINS = 500
LATTICE = 1500  # parts across a picture: more than it has pixels
DPI = 150  # of pictures with so many lines that they are kept as pixels
STYLE: Any = {
    "svg.fonttype": "none", "svg.hashsalt": "rig", "font.family": "sans-serif", "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.edgecolor": "#8a949e", "axes.labelcolor": INK, "text.color": INK, "xtick.color": INK, "ytick.color": INK,
    "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.color": "#e6eaee",
    "axes.axisbelow": True, "legend.frameon": False, "lines.linewidth": 1.2, "path.simplify": True,
}  # fmt: skip


@dataclass(frozen=True)
class Picture:
    """A figure as a data URI, with the heading over it and the words that stand for it where it cannot be seen."""

    title: str
    data: str
    alt: str
    caption: str = ""


@contextmanager
def page_style() -> Iterator[None]:
    """Draw everything inside in the style of the page."""
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        yield


def new_figure(rows: int, columns: int, height_in: float) -> tuple["Figure", list["Axes"]]:
    """Return a figure of ``rows`` x ``columns`` axes, and the axes row by row."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_IN, height_in), layout="constrained")
    return figure, list(figure.subplots(rows, columns, squeeze=False).ravel())


def embedded(figure: "Figure", pixels: bool = False) -> str:
    """Return the figure as a data URI, PNG with ``pixels``, else SVG; the same figure gives the same text."""
    buffer = io.BytesIO()
    if pixels:
        figure.savefig(buffer, format="png", dpi=DPI, metadata={"Software": None})
    else:
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    kind = "png" if pixels else "svg+xml"
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"


def envelope(values: Array, bins: int = ENVELOPE_BINS) -> tuple[Array, Array, Array]:
    """Return sample index (M,), lowest and highest value (M,) of at most ``bins`` stretches; NaN is passed over."""
    size = values.size
    if size <= 2 * bins:
        return np.arange(size, dtype=np.float64), values, values
    first = np.linspace(0, size, bins, endpoint=False).astype(np.int64)
    low, high = np.fmin.reduceat(values, first), np.fmax.reduceat(values, first)
    middle = 0.5 * (first + np.append(first[1:], size) - 1)
    return middle, np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)


def draw_signal(axes: "Axes", time: Array, values: Array, colour: str, label: str) -> None:
    """Draw a signal over time, as a line where it is short and as the band of its extremes where it is long."""
    index, low, high = envelope(values)
    if low is high:
        axes.plot(time, values, color=colour, linewidth=0.8, label=label)
    else:
        at = np.interp(index, np.arange(time.size), time)
        axes.fill_between(at, low, high, color=colour, linewidth=0.5, label=label)


def outline(x: Array, y: Array) -> tuple[Array, Array]:
    """Return a path in the plane with each piece of it once, NaN between pieces; detail too fine to see is lost."""
    cell = cells(x) * LATTICE + cells(y)
    moved = np.flatnonzero(np.diff(cell))
    pieces = np.unique(cell[moved] * LATTICE**2 + cell[moved + 1])
    begins, ends = np.divmod(pieces, LATTICE**2)
    points = np.column_stack((begins, ends))
    return _between_gaps(x, points // LATTICE), _between_gaps(y, points % LATTICE)


def cells(x: Array) -> Cells:
    """Return which of ``LATTICE`` equal parts of its range every value of x is in."""
    return np.asarray(np.rint((x - np.min(x)) / (float(np.ptp(x)) or 1.0) * (LATTICE - 1)), dtype=np.int64)


def _between_gaps(x: Array, pairs: Cells) -> Array:
    """Return the values of x that pairs of cells (M, 2) stand for, NaN behind every pair, shape (3 M,)."""
    values = np.min(x) + pairs * float(np.ptp(x)) / (LATTICE - 1)
    return np.asarray(np.column_stack((values, np.full(values.shape[0], np.nan))).ravel(), dtype=np.float64)


def longest_stretch(use: Mask) -> slice:
    """Return the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], use, [False])).astype(np.int8)))
    starts, stops = edges[::2], edges[1::2]
    if starts.size == 0:
        return slice(0, 0)
    at = int(np.argmax(stops - starts))
    return slice(int(starts[at]), int(stops[at]))
