"""Which pictures show where a mismatch enters, where it gathers, and what unnamed physics looks like?"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from identify.explain.explanation import Explanation, Finding, Profile
from identify.explain.shape import Shape
from identify.explain.survey import StageShare
from identify.natural_units import prefix_of, shown
from identify.page.drawing import AFTER, BEFORE, EDGE, INK, Panel, Picture, legend_above, logarithmic
from identify.trace import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEAST = 0.3  # times the noise: where the axis of sizes begins
ROOM_IN, ROW_IN = 0.6, 0.46  # of the picture of stages: its axis, and each stage


def stages(told: Explanation) -> Picture | None:
    """Draw which share of the mismatch a correction at each stage could explain."""
    if not told.survey or told.location is None:
        return None
    here = {told.location.stage, *(finding.stage for finding in told.effects)}
    listed = ", ".join(f"{row.stage} {100.0 * row.share:.3g} % ({row.kind} of {row.axis})" for row in told.survey)
    words = f"Share of the mismatch that a free correction at each stage could explain: {listed}."
    return Picture(
        "Which stage could explain it",
        (Panel(partial(_draw_stages, told.survey, here), words, ROOM_IN + ROW_IN * len(told.survey)),),
        "Before anything was named, a correction of free form was tried at every stage. The longer the bar, the more "
        "of the mismatch it could take away; the stage reported is filled. Stages next to each other often look alike.",
    )  # fmt: skip


def _draw_stages(survey: Sequence[StageShare], here: set[str], ax: "Axes") -> None:
    rows = list(reversed(survey))
    for i, row in enumerate(rows):
        face = BEFORE.colour if row.stage in here else "white"
        ax.barh(i, 100.0 * row.share, color=face, edgecolor=BEFORE.colour if row.stage in here else EDGE, height=0.42)
        ax.text(0.0, i + 0.3, f"{100.0 * row.share:.3g} %: {row.kind}, {row.axis}", va="bottom")
    ax.set_yticks(range(len(rows)), [row.stage for row in rows])
    ax.set(xlim=(0.0, 103.0), ylim=(-0.4, len(rows) - 0.2), xlabel="share of the mismatch, in %",
           xticks=range(0, 101, 25))  # fmt: skip
    ax.grid(visible=False, axis="y")


def mismatch(profiles: Sequence[Profile], noise_v: float) -> Picture | None:
    """Draw along which coordinate the mismatch gathers, before and after the model was improved."""
    if not profiles:
        return None
    panels = tuple(Panel(partial(_draw_profile, p, noise_v), _profile_words(p, noise_v), 2.5) for p in profiles)
    return Picture(
        "Where the mismatch sits", panels,
        "Tall bars say where the plain model fails; the dark line is what the improved model leaves there. The "
        "scale is logarithmic.",
    )  # fmt: skip


def _draw_profile(profile: Profile, noise_v: float, ax: "Axes") -> None:
    """Draw one coordinate, sizes on a logarithmic axis so that both models and the noise are seen."""
    factor, prefix = prefix_of(max(float(np.nanmax(profile.before_v)), noise_v), "V")
    floor = LEAST * noise_v / factor
    before, after = (_above(sizes_v / factor, floor) for sizes_v in (profile.before_v, profile.after_v))
    ax.stairs(before, profile.edges, baseline=floor, fill=True, facecolor=(BEFORE.colour, BEFORE.filling),
              edgecolor=BEFORE.colour, linewidth=0.8, label="plain model")  # fmt: skip
    ax.stairs(after, profile.edges, baseline=None, color=AFTER.colour, linewidth=1.8, label="improved model")
    ax.axhline(noise_v / factor, color=INK, linestyle=":", label="noise")
    ax.set(xlabel=f"{profile.axis} in {profile.unit}" if profile.unit else profile.axis, ylabel=f"rms in {prefix}V")
    logarithmic(ax, "y")
    ax.set_ylim(bottom=floor)
    legend_above(ax, columns=3)


def _above(sizes: Array, floor: float) -> Array:
    """Return sizes that a logarithmic axis from ``floor`` on can show; NaN where no sample was."""
    return np.where(sizes > 0.0, np.maximum(sizes, floor), np.nan)


def _profile_words(profile: Profile, noise_v: float) -> str:
    """Return where the plain model fails most, and what the improved one leaves there."""
    if np.isnan(profile.before_v).all():
        return f"Nothing is known along {profile.axis}."
    at = int(np.nanargmax(profile.before_v))
    low, high = (shown(float(end), profile.unit, 3) for end in profile.edges[at : at + 2])
    before, after = (shown(float(sizes[at]), "V", 3) for sizes in (profile.before_v, profile.after_v))
    return (f"Recorded y minus model along {profile.axis}: largest from {low} to {high}, where the plain model leaves "
            f"{before} rms and the improved model {after}; noise {shown(noise_v, 'V', 3)}.")  # fmt: skip


def shape(finding: Finding) -> Picture | None:
    """Draw what unnamed physics does along its own coordinate, with its 95 % band."""
    if finding.shape is None:
        return None
    straight = " Its straight part is left out: it cannot be told from slope and crossing of F."
    level = finding.shape.axis.startswith("level")
    return Picture(
        "What it looks like", (Panel(partial(_draw_shape, finding.shape), _shape_words(finding.shape)),),
        "The line is what was fitted, the band its 95 % interval." + (straight if level else ""),
    )  # fmt: skip


def _draw_shape(drawn: Shape, ax: "Axes") -> None:
    prefix = _draw_curves(ax, drawn)
    ax.axhline(1.0 if drawn.values == "gain" else 0.0, color=INK, linewidth=0.8)
    unit = f"{prefix}{drawn.value_unit}" if drawn.value_unit != "V/V" else "V/V"
    ax.set(xlabel=f"{drawn.axis} in {drawn.unit}", ylabel=f"{drawn.values} in {unit}")
    if any(drawn.names):
        legend_above(ax)


def _draw_curves(ax: "Axes", drawn: Shape) -> str:
    """Draw the curves of a shape; return the prefix of their unit."""
    factor, prefix = _unit(drawn)
    for name, curve, half, look in zip(drawn.names, drawn.curves, drawn.halves, (AFTER, BEFORE), strict=False):
        ax.fill_between(drawn.at, (curve - half) / factor, (curve + half) / factor, color=look.colour, alpha=0.25)
        ax.plot(drawn.at, curve / factor, look.line, color=look.colour, label=name or None)
    if drawn.axis == "frequency":
        logarithmic(ax, "x")
    low, high = _ends(drawn)
    room = 0.4 * (high - low) + 1e-12  # a band wider than this says that the data do not tell, however wide
    ax.set_ylim((low - room) / factor, (high + room) / factor)
    return prefix


def _unit(drawn: Shape) -> tuple[float, str]:
    largest = max(float(np.max(np.abs(curve))) for curve in drawn.curves)
    return prefix_of(largest, drawn.value_unit) if drawn.value_unit != "V/V" else (1.0, "")


def _ends(drawn: Shape) -> tuple[float, float]:
    return min(float(np.min(c)) for c in drawn.curves), max(float(np.max(c)) for c in drawn.curves)


def _shape_words(drawn: Shape) -> str:
    """Return where each curve is lowest and highest."""
    told = [f"{name or 'it'} runs from {_at(drawn, curve, int(np.argmin(curve)))} to "
            f"{_at(drawn, curve, int(np.argmax(curve)))}"
            for name, curve in zip(drawn.names, drawn.curves, strict=True)]  # fmt: skip
    return f"{drawn.values} along {drawn.axis} with its 95 % band: {'; '.join(told)}."


def _at(drawn: Shape, curve: Array, i: int) -> str:
    return f"{shown(float(curve[i]), drawn.value_unit, 3)} at {shown(float(drawn.at[i]), drawn.unit, 3)}"
