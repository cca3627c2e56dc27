"""Which pictures show where a mismatch enters, what unnamed physics looks like, and that the model holds?"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from identify.chain import simulate
from identify.explain.explanation import Explanation, Finding
from identify.explain.shape import Shape
from identify.natural_units import prefix_of, shown
from identify.observe import Observation, rms
from identify.page.drawing import AFTER, BEFORE, INK, PALE, Picture, draw_signal, embedded, new_figure
from identify.page.pictures import DRAWN, Answer
from identify.trace import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_RUNS = 3
TICKS = 5  # of time, at most: more of them touch
SEEN = 500  # samples of the stretch in which two models differ most
HIGHLIGHT, OTHER = BEFORE, "#b9c2cb"


def stages(told: Explanation) -> Picture | None:
    """Draw which share of the mismatch a correction at each stage could explain."""
    if not told.survey or told.location is None:
        return None
    figure, (ax,) = new_figure(1, 1, 0.5 + 0.36 * len(told.survey))
    rows = list(reversed(told.survey))
    here = {told.location.stage, *(finding.stage for finding in told.effects)}
    shares = [100.0 * row.share for row in rows]
    ax.barh(range(len(rows)), shares, color=[HIGHLIGHT if row.stage in here else OTHER for row in rows], height=0.62)
    for i, row in enumerate(rows):
        ax.text(shares[i] + 1.0, i, f"{shares[i]:.3g} %: {row.kind}, {row.axis}", va="center", fontsize=8.0)
    ax.set_yticks(range(len(rows)), [row.stage for row in rows])
    ax.set(xlim=(0.0, 205.0), xlabel="share of the mismatch, in %", xticks=range(0, 101, 25))
    ax.grid(visible=False, axis="y")
    return Picture(
        "Which stage could explain it", embedded(figure),
        "Share of the mismatch that a free correction at each stage could explain: "
        + ", ".join(f"{row.stage} {100.0 * row.share:.3g} %" for row in told.survey),
        "Before anything was named, a correction of free form was tried at every stage. The longer the bar, the more "
        "of the mismatch it could take away; the stage reported is orange. Stages next to each other often look alike.",
    )  # fmt: skip


def shape(finding: Finding) -> Picture | None:
    """Draw what unnamed physics does along its own coordinate, with its 95 % band."""
    if finding.shape is None:
        return None
    figure, (ax,) = new_figure(1, 1, 2.8)
    prefix = _curves(ax, finding.shape)
    ax.axhline(1.0 if finding.shape.values == "gain" else 0.0, color=INK, linewidth=0.8)
    unit = f"{prefix}{finding.shape.value_unit}" if finding.shape.value_unit != "V/V" else "V/V"
    ax.set(xlabel=f"{finding.shape.axis} in {finding.shape.unit}", ylabel=f"{finding.shape.values} in {unit}")
    if any(finding.shape.names):
        ax.legend(fontsize=7.5)
    straight = " Its straight part is left out: it cannot be told from slope and crossing of F."
    level = finding.shape.axis.startswith("level")
    return Picture(
        "What it looks like", embedded(figure), f"{finding.shape.values} along {finding.shape.axis} with 95 % band",
        "The line is what was fitted, the band its 95 % interval." + (straight if level else ""),
    )  # fmt: skip


def _curves(ax: "Axes", drawn: Shape) -> str:
    """Draw the curves of a shape; return the prefix of their unit."""
    largest = max(float(np.max(np.abs(curve))) for curve in drawn.curves)
    factor, prefix = prefix_of(largest, drawn.value_unit) if drawn.value_unit != "V/V" else (1.0, "")
    for name, curve, half, colour in zip(drawn.names, drawn.curves, drawn.halves, (AFTER, BEFORE), strict=False):
        ax.fill_between(drawn.at, (curve - half) / factor, (curve + half) / factor, color=colour, alpha=0.25)
        ax.plot(drawn.at, curve / factor, color=colour, label=name or None)
    if drawn.axis == "frequency":
        ax.set_xscale("log")
    low, high = min(float(np.min(c)) for c in drawn.curves), max(float(np.max(c)) for c in drawn.curves)
    room = 0.4 * (high - low) + 1e-12  # a band wider than this says that the data do not tell, however wide
    ax.set_ylim((low - room) / factor, (high + room) / factor)
    return prefix


def before_and_after(plain: Answer, improved: Answer | None) -> Picture | None:
    """Draw held-out runs: where the plain model is furthest off, and what both models leave over all of the run."""
    runs = plain.observations[:MOST_RUNS]
    if not runs:
        return None
    answers = [plain] if improved is None else [plain, improved]
    figure, axes = new_figure(len(runs), 2, 0.6 + 2.0 * len(runs))
    for row, observation in enumerate(runs):
        residuals = [answer.residuals[row] for answer in answers]
        _closest(axes[2 * row], observation, answers, _worst(residuals[0], observation))
        _left(axes[2 * row + 1], observation, answers, residuals)
    axes[0].legend(fontsize=7.5, frameon=True, framealpha=0.85, edgecolor="none")
    left_out = len(plain.observations) - len(runs)
    more = f" {left_out} more runs are not drawn." if left_out else ""
    more += f" A long run is drawn up to sample {DRAWN}." if any(o.trace.size == DRAWN for o in runs) else ""
    return Picture(
        "Before and after, on data kept back", embedded(figure),
        "Held-out runs: recording and models where they differ most, and the residuals of both models over time",
        "Left: the stretch in which the plain model is furthest off. Right: recording minus model over the whole run; "
        f"the grey band is plus and minus two standard deviations of the noise.{more}",
    )  # fmt: skip


def _worst(residual: Array, observation: Observation) -> slice:
    """Return the stretch in which a residual is largest, samples."""
    size = min(SEEN, observation.trace.size)
    energy = np.concatenate(([0.0], np.cumsum(np.square(np.nan_to_num(residual)))))
    first = int(np.argmax(energy[size:] - energy[:-size]))
    return slice(first, first + size)


def _closest(ax: "Axes", observation: Observation, answers: Sequence[Answer], part: slice) -> None:
    """Draw the recording and the models' answers over a stretch."""
    trace = observation.trace
    time = trace.start_s + np.arange(part.start, part.stop) / trace.rate_hz
    ax.plot(time, trace.y[part], color=INK, linewidth=0.8, label="recorded")
    for answer in answers:
        line = "--" if answer is answers[0] else "-"
        predicted = simulate(answer.chain, trace.until(part.stop), observation.substeps)[part]
        ax.plot(time, predicted, line, color=answer.colour, linewidth=1.3, label=answer.label)
    ax.set(xlabel="time in s", ylabel="y in V")
    ax.locator_params(axis="x", nbins=TICKS)
    ax.set_title(trace.name, loc="left")


def _left(ax: "Axes", observation: Observation, answers: Sequence[Answer], residuals: Sequence[Array]) -> None:
    """Draw what the models leave of one run."""
    size = observation.trace.size
    time = observation.trace.start_s + np.arange(size) / observation.trace.rate_hz
    largest = max(float(np.nanmax(np.abs(e), initial=0.0)) for e in residuals)
    factor, prefix = prefix_of(max(largest, observation.noise_v), "V")
    band = 2.0 * observation.noise_v / factor
    ax.axhspan(-band, band, color=PALE, alpha=0.7, linewidth=0)
    for answer, e in zip(answers, residuals, strict=True):
        label = f"{answer.label.removesuffix(' model')}: {shown(rms(e[np.isfinite(e)]), 'V', 3)} rms"
        draw_signal(ax, time, e / factor, answer.colour, label)
    ax.set(xlabel="time in s", ylabel=f"y - model in {prefix}V")
    ax.locator_params(axis="x", nbins=TICKS)
    ax.legend(fontsize=7.5, loc="upper right", frameon=True, framealpha=0.85, edgecolor="none", handlelength=1.0)
