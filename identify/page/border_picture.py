"""Which picture shows how bent the borders are, and how sure that is?"""

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from identify.bent.curved import SIDES
from identify.bent.curves import Bend, CurvePoint
from identify.natural_units import prefix_of, shown
from identify.page.drawing import AFTER, BEFORE, INK, Panel, Picture, legend_above

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LOOKS = {"L": AFTER, "U": BEFORE}


def borders(bend: Bend) -> Picture:
    """Draw both borders with their knots, and beside them how far from straight they are, with 95 % bands."""
    far = {name: _off_line(bend.along[side]) for side, name in SIDES.items()}
    told = " and ".join(f"{shown(float(np.max(np.abs(off))), 'V', 3)} for the {name} border"
                        for name, off in far.items())
    return Picture(
        "Shape of the borders",
        (Panel(partial(_draw_borders, bend), "Loading and unloading border of the backlash as curves over v, with the "
               f"{sum(map(len, bend.curves.values()))} points they run through.", 3.2),
         Panel(partial(_draw_bands, bend), f"Distance of both borders from straight lines, with 95 % bands: at most "
               f"{told}.", 3.2)),
        f"{bend.sentence} The band is the 95 % interval at each v; beyond their ends the borders go on straight.",
    )  # fmt: skip


def _draw_borders(bend: Bend, ax: "Axes") -> None:
    for side, name in SIDES.items():
        along, knots, look = bend.along[side], bend.curves[side], LOOKS[side]
        ax.plot([p.v_v for p in along], [p.w_v.value for p in along], look.line, color=look.colour,
                label=f"{name} border")  # fmt: skip
        ax.plot([p.v_v for p in knots], [p.w_v.value for p in knots], look.marker, color=look.colour, markersize=3.5)
    ax.set(xlabel="v, the input of F, in V", ylabel="w, the output of F, in V")
    legend_above(ax)


def _draw_bands(bend: Bend, ax: "Axes") -> None:
    """Draw how far each border lies from its straight line, and the band of its intervals."""
    factor, prefix = prefix_of(max(float(np.max(np.abs(_off_line(points)))) for points in bend.along.values()), "V")
    for side, name in SIDES.items():
        points, look = bend.along[side], LOOKS[side]
        v, off = [p.v_v for p in points], _off_line(points)
        low = off + np.array([p.w_v.low - p.w_v.value for p in points])
        high = off + np.array([p.w_v.high - p.w_v.value for p in points])
        ax.fill_between(v, low / factor, high / factor, color=look.colour, alpha=0.3, linewidth=0)
        ax.plot(v, off / factor, look.line, color=look.colour, label=f"{name} border")
    ax.axhline(0.0, color=INK, linewidth=0.8)
    ax.set(xlabel="v, the input of F, in V", ylabel=f"w minus straight line in {prefix}V")
    legend_above(ax)


def _off_line(points: tuple[CurvePoint, ...]) -> np.ndarray:
    """Return w less its straight line, V."""
    v, w = np.array([p.v_v for p in points]), np.array([p.w_v.value for p in points])
    return np.asarray(w - np.polyval(np.polyfit(v, w, 1), v))
