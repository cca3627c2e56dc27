"""What is drawn in a notebook, on axes of pyplot, where a report would hold a picture?"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from identify.page.drawing import AFTER, EDGE, INK, PALE, PANEL_IN, RECORDED, page_style
from identify.trace import Array, Mask, Samples

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from identify.explain.explanation import Explanation
    from identify.identification import Identification
    from identify.page.drawing import Picture

@dataclass(frozen=True)
class Look:
    """How a signal is drawn: the recording as a broad pale line where a model lies on it."""

    colour: str
    width: float = 1.0
    line: str = "-"


Extremes = tuple[Array, Array, Array]
"""Where the parts of a signal begin, and the lowest and highest value of each."""
ALONE, UNDER, OVER = Look(INK), Look(RECORDED, 3.0), Look(AFTER.colour)
WIDTH_IN, ROW_IN = 8.6, 2.2
COLUMNS = 1000  # parts a long signal is drawn by, each from its lowest value to its highest


def signals(
    title: str, rate_hz: float, drawn: Mapping[str, Samples], valid: Mask | None = None, start_s: float = 0.0,
    model: Samples | None = None,
) -> "list[Axes]":  # fmt: skip
    """Draw signals by name, V, over one time, one below the other, the answer of a ``model`` on top of y.

    Where samples are missing all but u, which is known, has a gap, and that is hatched. Returns the axes.
    """
    timed = partial(_times, rate_hz=rate_hz, start_s=start_s)
    with page_style():
        axes = _stacked(len(drawn))
        for ax, (name, signal) in zip(axes, drawn.items(), strict=True):
            beneath = name == "y" and model is not None
            _draw(ax, timed(extremes(signal, None if name == "u" else valid)), UNDER if beneath else ALONE, "recorded")
            if name == "y" and model is not None:
                _draw(ax, timed(extremes(model)), OVER, "model")
            if name != "u" and valid is not None and not valid.all():
                _draw_missing(ax, valid, rate_hz, start_s)
            if len(ax.get_legend_handles_labels()[1]) > 1:
                ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderaxespad=0.0)
            ax.set(ylabel=f"{name} in V")
        axes[0].set_title(title, loc="left")
        axes[-1].set_xlabel("time in s")
    return axes


def explanation(told: "Explanation") -> "list[Axes]":
    """Draw where recording and plain model differ most, and along what the mismatch gathers; return the axes."""
    from identify.page.place_pictures import mismatch
    from identify.page.report import at_first_glance

    where = mismatch(told.profiles, told.noise.rms_v)
    return _beside([*at_first_glance(told), *([where] if where else [])])


def identification(found: "Identification") -> "list[Axes]":
    """Draw the borders, or what F does where no staircase shows them, and G1 and G2; return the axes."""
    from identify.page.report import rig_at_first_glance

    return _beside(rig_at_first_glance(found))


def _beside(pictures: "Sequence[Picture]") -> "list[Axes]":
    """Draw the panels of pictures two in a row; return their axes, those left over taken away."""
    import matplotlib.pyplot as plt

    panels = [panel for picture in pictures for panel in picture.panels]
    rows = max(-(-len(panels) // 2), 1)
    with page_style():
        size = (2.0 * PANEL_IN[0], rows * PANEL_IN[1])
        _, grid = plt.subplots(rows, 2, squeeze=False, figsize=size, layout="constrained")
        axes = list(grid.ravel())
        for ax, panel in zip(axes, panels, strict=False):
            panel.draw(ax)
        for ax in axes[len(panels):]:
            ax.remove()
    return axes[: len(panels)]


def _stacked(rows: int) -> "list[Axes]":
    """Return axes one below the other over one time."""
    import matplotlib.pyplot as plt

    size = (WIDTH_IN, 0.8 + ROW_IN * rows)
    figure, axes = plt.subplots(rows, 1, sharex=True, squeeze=False, figsize=size, layout="constrained")
    figure.align_ylabels()
    return list(axes.ravel())


def _times(found: Extremes, rate_hz: float, start_s: float) -> Extremes:
    """Return extremes with times, s, in place of samples."""
    first, low, high = found
    return start_s + first / rate_hz, low, high


def _draw(ax: "Axes", found: Extremes, look: Look, label: str) -> None:
    """Draw one signal: its samples where they are few, else from the lowest to the highest of every part."""
    time, low, high = found
    if low is high:
        ax.plot(time, low, look.line, color=look.colour, linewidth=look.width, label=label)
    else:
        ax.fill_between(time, low, high, color=look.colour, linewidth=look.width, step="post", label=label)


def extremes(signal: Samples, valid: Mask | None = None) -> Extremes:
    """Return the first sample of at most ``COLUMNS`` parts of a signal, and its lowest and highest value in each.

    A part without a sample that counts has NaN. A long signal is read part by part.
    """
    if signal.size <= 2 * COLUMNS:
        values = np.asarray(signal[:], dtype=np.float64)
        values = values if valid is None else np.where(valid, values, np.nan)
        return np.arange(signal.size, dtype=np.float64), values, values
    ends = np.linspace(0, signal.size, COLUMNS + 1).astype(np.int64)
    low, high = np.empty(COLUMNS), np.empty(COLUMNS)
    for i, (a, b) in enumerate(pairwise(ends)):
        part = signal[a:b] if valid is None else np.where(valid[a:b], signal[a:b], np.nan)
        low[i], high[i] = np.fmin.reduce(part), np.fmax.reduce(part)
    return ends[:-1].astype(np.float64), low, high


def _draw_missing(ax: "Axes", valid: Mask, rate_hz: float, start_s: float) -> None:
    """Hatch the time in which samples are missing; one lost sample is as wide as a part."""
    ends = np.linspace(0, valid.size, min(valid.size, COLUMNS) + 1).astype(np.int64)
    missing = np.array([not valid[a:b].all() for a, b in pairwise(ends)])
    turns = np.flatnonzero(np.diff(np.concatenate(([False], missing, [False])).astype(np.int8)))
    at = start_s + ends[turns] / rate_hz
    spans = [(float(a), float(b - a)) for a, b in zip(at[::2], at[1::2], strict=True)]
    ax.broken_barh(spans, (0, 1), transform=ax.get_xaxis_transform(), facecolor=PALE, hatch="////", edgecolor=EDGE,
                   linewidth=0.8, label="samples missing")  # fmt: skip
