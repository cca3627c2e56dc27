"""Which picture shows how bent the borders are, and how sure that is?"""

from typing import TYPE_CHECKING

import numpy as np

from identify.bent.curved import SIDES
from identify.bent.curves import Bend, CurvePoint
from identify.natural_units import prefix_of
from identify.page.drawing import AFTER, BEFORE, INK, Picture, embedded, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = {"L": AFTER, "U": BEFORE}


def borders(bend: Bend) -> Picture:
    """Draw both borders with their knots, and beside them how far from straight they are, with 95 % bands."""
    figure, (over, under) = new_figure(1, 2, 3.6)
    for side, name in SIDES.items():
        _draw_border(over, bend, side, f"{name} border")
    factor, prefix = prefix_of(max(float(np.max(np.abs(_off_line(points)))) for points in bend.along.values()), "V")
    for side in SIDES:
        _draw_band(under, bend.along[side], side, factor)
    under.axhline(0.0, color=INK, linewidth=0.8)
    over.set(xlabel="v, the input of F, in V", ylabel="w, the output of F, in V", title="borders and their knots")
    under.set(xlabel="v, the input of F, in V", ylabel=f"w minus straight line in {prefix}V",
              title="how far from straight")  # fmt: skip
    over.legend(fontsize=7.5)
    return Picture(
        "Shape of the borders", embedded(figure),
        "Loading and unloading border of the backlash as curves, beside their distance from straight lines with bands",
        f"{bend.sentence} The band is the 95 % interval at each v; beyond their ends the borders go on straight.",
    )  # fmt: skip


def _draw_border(over: "Axes", bend: Bend, side: str, label: str) -> None:
    """Draw one border and its knots."""
    along, knots = bend.along[side], bend.curves[side]
    over.plot([p.v_v for p in along], [p.w_v.value for p in along], color=COLOURS[side], label=label)
    over.plot([p.v_v for p in knots], [p.w_v.value for p in knots], "o", color=COLOURS[side], markersize=3.5)


def _draw_band(under: "Axes", points: tuple[CurvePoint, ...], side: str, factor: float) -> None:
    """Draw how far one border lies from its straight line, and the band of its intervals."""
    v, off = [p.v_v for p in points], _off_line(points)
    low = off + np.array([p.w_v.low - p.w_v.value for p in points])
    high = off + np.array([p.w_v.high - p.w_v.value for p in points])
    under.fill_between(v, low / factor, high / factor, color=COLOURS[side], alpha=0.3, linewidth=0)
    under.plot(v, off / factor, color=COLOURS[side])


def _off_line(points: tuple[CurvePoint, ...]) -> np.ndarray:
    """Return w less its straight line, V."""
    v, w = np.array([p.v_v for p in points]), np.array([p.w_v.value for p in points])
    return np.asarray(w - np.polyval(np.polyfit(v, w, 1), v))
