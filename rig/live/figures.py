"""How does the page draw a run: which pictures, in which colours, from which columns?

Colours are those of Okabe and Ito, told apart by the colour-blind; lines differ in their dashes and points in their
shapes as well, so that they also differ in grey. No text of a file is drawn: an input goes by a name that is known
here, or by its number.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from bokeh.models import ColumnDataSource, DataRange1d, Range1d
from bokeh.plotting import figure

from rig.live.columns import BRANCHES, Columns
from rig.live.watching import Watch

BLUE, VERMILION, GREEN, PURPLE, BLACK, GREY = "#0072b2", "#c04a00", "#007a5a", "#a0447c", "#111111", "#6b6b6b"
SHAPES = {"loading": ("triangle", GREEN), "unloading": ("inverted_triangle", PURPLE), "plateau": ("square", BLACK),
          "saturated": ("x", VERMILION)}  # fmt: skip
KNOWN = ("u_measured", "v", "w")
DASHES = ("dotdash", "dotted", "dashdot", "dashed")
HEIGHT, TALL = 340, 400
EVERY, TURNS = 4, {"whole": 0, "residual": 2}
"""While a run goes on its pictures of all of it, which move little, have their turns once in so many: the browser's
time is for those that follow the signals."""


@dataclass(frozen=True)
class Figures:
    """The pictures by name, and the sources they draw from."""

    pictures: dict[str, figure]
    sources: dict[str, ColumnDataSource]

    def show(self, watch: Watch, held: dict[str, Columns], number: int) -> None:
        """Draw what is known now, the ``number``-th time; a picture of which nothing has moved is not drawn again."""
        for name, values in held.items():
            waits = watch.stands.going_on and name in TURNS and number % EVERY != TURNS[name]
            if not waits and not _same(self.sources[name].data, values):
                self.sources[name].data = values
        for name in ("whole", "residual"):  # a retry is another run, of another length
            self.pictures[name].x_range.update(end=_end_s(watch))


def _same(shown: Mapping[str, Any], held: Columns) -> bool:
    return all(np.array_equal(shown[name], values, equal_nan=True) for name, values in held.items())


def figures(watch: Watch, held: dict[str, Columns]) -> Figures:
    """Return the pictures of a run, and the columns that are drawn at first."""
    sources = {name: ColumnDataSource(values) for name, values in held.items()}
    pictures = {"loop": _loop(watch, sources), "latest": _latest(watch, sources["latest"]),
                "residual": _residual(watch, sources["residual"]), "whole": _whole(watch, sources["whole"])}
    for name, picture in pictures.items():
        picture.name = name
    return Figures(pictures, sources)


def _plot(x: str, y: str, watch: Watch | None = None) -> figure:
    """Return an empty picture; one over the whole run has its time axis from the beginning."""
    made = figure(height=HEIGHT, sizing_mode="stretch_width", x_axis_label=x, y_axis_label=y, toolbar_location="right",
                  tools="pan,box_zoom,wheel_zoom,reset,save", output_backend="canvas", lod_threshold=None)
    if watch is not None:
        made.x_range = Range1d(start=watch.about.start_s, end=_end_s(watch))
    made.toolbar.update(logo=None, active_drag=None, active_scroll=None)  # a finger that scrolls the page moves no plot
    for axis in (made.xaxis, made.yaxis):
        axis.axis_label_text_font_style = "normal"
        axis.axis_label_text_color = axis.major_label_text_color = BLACK
    return made


def _end_s(watch: Watch) -> float:
    return watch.about.start_s + watch.about.size / watch.about.rate_hz


def _legend(made: figure, ncols: int = 3) -> figure:
    """Put the legend above the picture, where it hides nothing, and let a click hide a line."""
    legend = made.legend[0]
    legend.update(orientation="horizontal", click_policy="hide", ncols=ncols, label_text_font_size="11px", padding=2,
                  spacing=4, border_line_color=None, label_text_color=BLACK)
    made.add_layout(legend, "above")
    return made


def _latest(watch: Watch, source: ColumnDataSource) -> figure:
    """Return u, y and the model's answer of the last seconds."""
    made = _plot("time in s", "level in V")
    made.line("t", "u", source=source, color=GREY, line_dash="dotted", line_width=1.5, legend_label="u commanded")
    made.line("t", "y", source=source, color=BLUE, line_width=1.5, legend_label="y read")
    made.line("t", "x", source=source, color=VERMILION, line_dash="dashed", line_width=2, legend_label="y by the model")
    for number, name in enumerate(watch.further):
        label = name if name in KNOWN else f"input {number + 2}"
        made.line("t", name, source=source, color=(GREEN, PURPLE)[number % 2], line_dash=DASHES[number],
                  legend_label=label)
    return _legend(made)


def _whole(watch: Watch, source: ColumnDataSource) -> figure:
    """Return u and y of the whole run."""
    made = _plot("time in s", "level in V", watch)
    made.line("t", "y", source=source, color=BLUE, legend_label="y, least to largest")
    made.line("t", "u", source=source, color=BLACK, line_dash="dotted", legend_label="u, least to largest")
    return _legend(made)


def _residual(watch: Watch, source: ColumnDataSource) -> figure:
    """Return reading less model over the whole run, beside the noise of a reading."""
    made = _plot("time in s", "y less model in V", watch)
    made.varea("t", "low", "high", source=source, color=BLUE, alpha=0.25, legend_label="least to largest")
    made.line("t", "mean", source=source, color=BLUE, line_width=2, legend_label="mean")
    for name in ("noise", "minus"):
        made.line("t", name, source=source, color=VERMILION, line_dash="dashed", line_width=2,
                  legend_label="± noise of a reading, rms")
    return _legend(made)


def _loop(watch: Watch, sources: dict[str, ColumnDataSource]) -> figure:
    """Return y over v as the model has v: the outline so far, the last samples, settled dwells, borders."""
    made = _plot("u in V, as no model tells v" if watch.plain is None else "v behind G1, by the model, in V", "y in V")
    made.quad("left", "right", "high", "low", source=sources["hull"], fill_color=BLUE, fill_alpha=0.18, line_color=None,
              legend_label="all y so far")
    last = made.line("v", "y", source=sources["trail"], color=BLUE, line_width=1.5, legend_label="last y")
    model = made.line("v", "x", source=sources["trail"], color=VERMILION, line_dash="dashed", line_width=2,
                      legend_label="by the model")
    made.line("v", "y", source=sources["borders"], color=BLACK, line_dash="dotted", line_width=1.5,
              legend_label="model's borders")
    points = []
    for branch in BRANCHES:
        marker, colour = SHAPES[branch]
        points.append(made.scatter("v", "y", source=sources[branch], marker=marker, size=9, line_color=colour,
                                   line_width=1.5, fill_color=colour if marker != "square" else "white",
                                   legend_label=f"settled, {branch}"))
    made.y_range = DataRange1d(renderers=[last, model, *points])  # borders run on, as far as v was met
    made.height = TALL
    return _legend(made, 2)  # three columns are wider than a phone
