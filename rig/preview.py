"""What will a protocol look like on the bench, before it is played?"""

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from identify.page.drawing import AFTER, INK, PALE, draw_signal, new_figure, page_style, short
from identify.trace import Array, Samples, Stored, blocks, part
from rig.errors import FileError
from rig.plan import Plan
from rig.signals import extremes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_NAMES = 12
WIDTH_IN = 8.6
STRETCHES = 2000  # of a signal too long for memory: more than a picture has pixels across


def draw_plan(plan: Plan, path: str | Path) -> None:
    """Draw the samples of a plan over time between its limits, steps named; raise FileError when it cannot be written.

    The suffix of ``path`` says the kind of picture: png, svg, pdf.
    """
    with page_style():
        figure, ax = new_figure(WIDTH_IN, 3.2)
        at, values = outlined(plan.u)
        draw_signal(ax, at / plan.rate_hz, values, AFTER, "u")
        for level in (plan.limits.low_v, plan.limits.high_v):
            ax.axhline(level, color="#c23b3b", linestyle="--", linewidth=0.9)
        _name_steps(ax, plan)
        ax.set(xlabel="time in s", ylabel="u in V", title=f"{short(plan.title)} (limits dashed)")
        try:
            figure.savefig(path, dpi=120)
        except (OSError, ValueError) as error:
            raise FileError("the preview cannot be written", where=str(path), value=str(error).splitlines()[0],
                            allowed="a file .png, .svg or .pdf") from error


def outlined(signal: Samples) -> tuple[Array, Array]:
    """Return places and levels that look like the signal: of a long one the ends of every of so many stretches."""
    if not isinstance(signal, Stored):
        return np.arange(signal.size, dtype=np.float64), signal
    size = -(-signal.size // STRETCHES)
    rows = [extremes(part(signal, start, stop)) for start, stop in blocks(0, signal.size, size)]
    at = size * (np.arange(2 * len(rows)) // 2 + 0.5)
    return np.asarray(at, dtype=np.float64), np.array([level for row in rows for level in (row.low_v, row.high_v)])


def _name_steps(ax: "Axes", plan: Plan) -> None:
    """Mark where steps begin, unless there are too many to read."""
    for step in plan.steps if len(plan.steps) <= MOST_NAMES else ():
        start_s = step.start / plan.rate_hz
        ax.axvline(start_s, color=PALE, linewidth=0.8)
        ax.annotate(short(step.label), (start_s, plan.limits.high_v), xytext=(2, -9), textcoords="offset points",
                    fontsize=7, color=INK)  # fmt: skip
