"""Which pictures show recording and model over time, and how far apart they are?"""

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from identify.natural_units import prefix_of, shown
from identify.observe import Observation, rms
from identify.page.answers import Answer, cut, liveliest, worst
from identify.page.drawing import EDGE, PALE, RECORDED, Panel, Picture, draw_signal, legend_above, logarithmic
from identify.page.thinned import longest_stretch, noise_reach
from identify.trace import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_RUNS = 6
TICKS = 5  # of time, at most: more of them touch
SEEN = 3.0  # times the noise from which the stretch with the largest residual is worth more than any other
LOW_IN = 2.1  # height of a panel of which there are many


def glance(answers: Sequence[Answer], kind: str = "") -> Picture | None:
    """Draw the stretch in which the first answer is furthest off, or else in which most happens, and what is left."""
    found = _looked_at(answers[0])
    if found is None:
        return None
    row, part, off = found
    run = answers[0].observations[row]
    name, time = run.trace.name, run.trace.clock_s[part]
    why = f"{answers[0].label.capitalize()} and recording differ most here" if off else "Here the recording moves most"
    of = f"{name} ({kind})" if kind else name
    return Picture(
        f"At a glance: recording, {', '.join(a.label for a in answers)}",
        (overlay(answers, row, part),
         Panel(partial(_draw_close, answers, row, part), _close_words(answers, row, part))),
        f"{why}: {of}, {shown(float(time[0]), 's')} to {shown(float(time[-1]), 's')}. The grey band is what 95 of 100 "
        "readings stay within by noise alone.",
    )  # fmt: skip


def _looked_at(answer: Answer) -> tuple[int, slice, bool] | None:
    """Return which run to look at, which stretch of it, and whether its residual is more than noise there."""
    parts = {row: worst(answer.residuals[row]) for row, o in enumerate(answer.observations) if o.count}
    if not parts:
        return None
    sizes = {row: _rms(answer.residuals[row][part]) / answer.observations[row].noise_v for row, part in parts.items()}
    row = max(sizes, key=lambda one: sizes[one])
    if sizes[row] > SEEN:
        return row, parts[row], True
    lively = {row: liveliest(answer.observations[row]) for row in parts}
    row = max(lively, key=lambda one: lively[one][1])
    return row, lively[row][0], False


def overlay(answers: Sequence[Answer], row: int, part: slice) -> Panel:
    """Return the recording over a stretch as a broad line, with the models on top of it."""
    run = answers[0].observations[row]
    y = run.trace.y[part]
    ends = f"{shown(float(np.nanmin(y)), 'V')} to {shown(float(np.nanmax(y)), 'V')}"
    off = "; ".join(f"the {a.label} is off by up to {shown(_largest(a.residuals[row][part]), 'V', 3)}" for a in answers)
    words = f"Recorded y of {run.trace.name} over time, {ends}, with the models on top of it: {off}."
    return Panel(partial(_draw_overlay, answers, row, part), words)


def _draw_overlay(answers: Sequence[Answer], row: int, part: slice, ax: "Axes") -> None:
    run = answers[0].observations[row]
    time, y = run.trace.clock_s[part], run.trace.y[part]
    ax.plot(time, y, color=RECORDED, linewidth=4.0, solid_capstyle="round", label="recorded", zorder=2.0)
    for depth, answer in enumerate(answers):  # dashes last: where two models agree, both are seen
        look = answer.look
        ax.plot(time, y - answer.misfits[row][part], look.line, color=look.colour, label=answer.label,
                zorder=3.0 - 0.1 * depth)  # fmt: skip
    ax.set(xlabel="time in s", ylabel="y in V")
    _few_ticks(ax)
    legend_above(ax, run.trace.name, columns=3)


def _draw_close(answers: Sequence[Answer], row: int, part: slice, ax: "Axes") -> None:
    """Draw the residuals of a stretch, sample by sample."""
    run = answers[0].observations[row]
    pieces = [answer.residuals[row][part] for answer in answers]
    factor = _band(ax, run, pieces, 1.96)
    for depth, (answer, piece) in enumerate(zip(answers, pieces, strict=True)):
        look = answer.look
        ax.plot(run.trace.clock_s[part], piece / factor, look.line, color=look.colour, linewidth=1.0,
                label=f"{answer.name}, {shown(_rms(piece), 'V', 3)} rms", zorder=3.0 - 0.1 * depth)  # fmt: skip
    _few_ticks(ax)
    legend_above(ax)


def _close_words(answers: Sequence[Answer], row: int, part: slice) -> str:
    noise = answers[0].observations[row].noise_v
    left = " and ".join(f"{shown(_rms(a.residuals[row][part]), 'V', 3)} rms for the {a.label}" for a in answers)
    return f"Recorded y minus model over the same stretch: {left}, where the noise is {shown(noise, 'V', 3)}."


def residuals(answers: Sequence[Answer], title: str) -> Picture | None:
    """Draw recording minus model over time, run by run, over the band of the noise; the last answer again by itself."""
    runs = answers[0].observations[:MOST_RUNS]
    if not runs:
        return None
    panels = []
    for row in range(len(runs)):
        panels += [residual(answers, row)] + [residual(answers[-1:], row)] * (len(answers) > 1)
    left_out = len(answers[0].observations) - len(runs)
    more = f" {left_out} more runs are not drawn." if left_out else ""
    beside = f"Beside both, the {answers[-1].label} by itself. " if len(answers) > 1 else ""
    return Picture(
        title, tuple(panels),
        f"{beside}A filled area reaches from the lowest to the highest residual of each part of a run. In the grey "
        f"band it would stay with noise alone, in 95 of 100 parts.{more}{cut(runs)}",
    )  # fmt: skip


def residual(answers: Sequence[Answer], row: int) -> Panel:
    """Return what answers leave of one run, over all of its time."""
    run = answers[0].observations[row]
    left = ", ".join(
        f"the {a.label} {shown(a.left(row), 'V', 3)} rms and at most {shown(_largest(a.residuals[row]), 'V', 3)}"
        for a in answers
    )  # fmt: skip
    words = f"Recorded y minus model over all of {run.trace.name}: {left}; noise {shown(run.noise_v, 'V', 3)}."
    return Panel(partial(_draw_residual, answers, row), words, LOW_IN)


def _draw_residual(answers: Sequence[Answer], row: int, ax: "Axes") -> None:
    run = answers[0].observations[row]
    drawn = [answer.residuals[row] for answer in answers]
    factor = _band(ax, run, drawn, noise_reach(run.trace.size))
    for answer, e in zip(answers, drawn, strict=True):
        label = f"{answer.name}, {shown(answer.left(row), 'V', 3)} rms"
        draw_signal(ax, run.trace.clock_s, e / factor, answer.look, label)
    _few_ticks(ax)
    legend_above(ax, run.trace.name)


def _band(ax: "Axes", run: Observation, drawn: Sequence[Array], reach: float) -> float:
    """Draw within what the noise stays and name the axes; return the unit, V, that suits the largest residual."""
    factor, prefix = prefix_of(max(*(_largest(e) for e in drawn), run.noise_v), "V")
    band = reach * run.noise_v / factor
    ax.axhspan(-band, band, color=PALE, linewidth=0, zorder=0.5)
    for end in (-band, band):
        ax.axhline(end, color=EDGE, linestyle=":", linewidth=1.0, zorder=3)
    ax.set(xlabel="time in s", ylabel=f"y - model in {prefix}V")
    return factor


def _few_ticks(ax: "Axes") -> None:
    ax.locator_params(axis="x", nbins=TICKS)


def _largest(e: Array) -> float:
    """Return the largest size in e that is a number, 0 where there is none."""
    return float(np.nanmax(np.abs(e), initial=0.0)) if e.size else 0.0


def _rms(e: Array) -> float:
    """Return the rms of what are numbers in e."""
    return rms(e[np.isfinite(e)])


def spectra(answers: Sequence[Answer]) -> Picture | None:
    """Draw the amplitude spectral density of the residuals of the run with the longest gapless stretch."""
    observations = answers[0].observations
    stretches = [longest_stretch(o.use) for o in observations]
    row = int(np.argmax([part.stop - part.start for part in stretches]))
    part = stretches[row]
    if part.stop - part.start < 64:
        return None
    curves = [_density(answer, row, part) for answer in answers]
    return Picture(
        "Spectrum of the residual",
        (Panel(partial(_draw_spectra, answers, row, curves), _peaks(answers, row, curves)),),
        "Where a curve stands above the dotted line, something other than white noise is left at that frequency.",
    )  # fmt: skip


def _density(answer: Answer, row: int, part: slice) -> tuple[Array, Array]:
    """Return frequencies in Hz and the amplitude spectral density of a residual there, V/sqrt(Hz)."""
    from scipy.signal import welch

    piece = answer.residuals[row][part]
    rate = answer.observations[row].trace.rate_hz
    frequency, power = welch(piece, rate, nperseg=min(4096, piece.size), detrend="constant")
    return frequency[1:-1], np.sqrt(power[1:-1])  # at either end the density is another one


def _floor(run: Observation) -> float:
    """Return the density of the noise if it is white, V/sqrt(Hz)."""
    return run.noise_v * float(np.sqrt(2.0 / run.trace.rate_hz))


def _draw_spectra(
    answers: Sequence[Answer], row: int, curves: Sequence[tuple[Array, Array]], ax: "Axes"
) -> None:
    run = answers[0].observations[row]
    for answer, (frequency, density) in zip(answers, curves, strict=True):
        look = answer.look
        ax.plot(frequency, 1e3 * density, look.line, color=look.colour, linewidth=0.9, label=answer.label)
    ax.axhline(1e3 * _floor(run), color=EDGE, linestyle=":", label="noise")
    ax.set(xlabel="frequency in Hz", ylabel="residual in mV/√Hz")
    logarithmic(ax, "xy")
    legend_above(ax, run.trace.name, columns=3)


def _peaks(answers: Sequence[Answer], row: int, curves: Sequence[tuple[Array, Array]]) -> str:
    """Return where each curve stands highest above the noise."""
    run = answers[0].observations[row]
    told = [
        f"the {answer.label} leaves most at {shown(float(frequency[np.argmax(density)]), 'Hz', 3)}, "
        f"{float(np.max(density)) / _floor(run):.3g} times the noise"
        for answer, (frequency, density) in zip(answers, curves, strict=True)
    ]  # fmt: skip
    return f"Amplitude spectral density of recorded y minus model, {run.trace.name}: {'; '.join(told)}."
