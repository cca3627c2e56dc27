"""Which pictures show what was measured, what the model makes of it, and where the two part?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from identify.bent.border import of_points
from identify.blocks import Gain
from identify.chain import Chain, signals
from identify.explain.explanation import Profile
from identify.harmonic.measured import MeasuredPoint
from identify.identification import Branch, FrequencyPoint, Identification
from identify.model import Backlash, CurvedBacklash, LinearF, Model, Rational
from identify.natural_units import prefix_of, shown
from identify.observe import Observation, rms
from identify.page.drawing import (
    AFTER,
    BEFORE,
    INK,
    PALE,
    Picture,
    draw_signal,
    embedded,
    longest_stretch,
    new_figure,
    outline,
)
from identify.stage import Place
from identify.trace import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_RUNS = 6
DRAWN = 1 << 21  # samples of a run, at most: drawing needs all of them in memory
BRANCHES: dict[Branch, tuple[str, str]] = {
    "loading": ("#1f5fa8", "o"), "unloading": ("#2a8c5a", "s"), "plateau": ("#8a949e", "D"),
    "saturated": ("#c23b3b", "^"),
}  # fmt: skip


@dataclass(frozen=True)
class Answer:
    """A chain under the name and colour it has in every picture, beside the runs it is held against."""

    label: str
    colour: str
    chain: Chain
    observations: tuple[Observation, ...]

    @cached_property
    def residuals(self) -> tuple[Array, ...]:
        """Return the residual of every run, V; NaN where a sample does not count."""
        return tuple(np.where(o.use, o.residual(self.chain), np.nan) for o in self.observations)


def beginnings(observations: Sequence[Observation]) -> tuple[Observation, ...]:
    """Return of every run what is drawn of it."""
    return tuple(o.until(DRAWN) for o in observations)


def staircase(found: Identification) -> Picture | None:
    """Draw the settled readings by branch over the fitted borders, and below how far they lie from them."""
    if not found.staircase or isinstance(found.model.f, LinearF):
        return None
    figure, (over, under) = new_figure(1, 2, 3.6)
    levels = np.array([point.level_v for point in found.staircase])
    span = np.linspace(levels.min(), levels.max(), 50)
    styles: tuple[tuple[Branch, str], ...] = (("loading", "-"), ("unloading", "--"))
    for branch, style in styles:
        line = border(found.model, branch, span)
        over.plot(span, line, style, color=INK, linewidth=1.0, label=f"{branch} border")
    for branch in BRANCHES:
        _draw_branch(over, under, found, branch)
    under.axhline(0.0, color=INK, linewidth=0.8)
    over.set(xlabel="level of u in V", ylabel="settled reading of y in V", title="readings and borders")
    under.set(xlabel="level of u in V", ylabel="reading minus border in mV", title="how far off the borders")
    over.legend(fontsize=7.5)
    return Picture(
        "Staircase and borders", embedded(figure),
        f"{len(found.staircase)} settled readings of the staircase over the two fitted borders of the backlash",
        "Each point is the mean of one settled dwell with its 95 % interval. Points on a plateau or a rail lie off the "
        "borders and are not used to draw them.",
    )  # fmt: skip


def _draw_branch(over: "Axes", under: "Axes", found: Identification, branch: Branch) -> None:
    """Draw the readings of one branch, and their distance from its border where it has one."""
    points = [point for point in found.staircase if point.branch == branch]
    if not points:
        return
    colour, marker = BRANCHES[branch]
    at = np.array([point.level_v for point in points])
    mean = np.array([point.mean_v.value for point in points])
    halves = np.array([[p.mean_v.value - p.mean_v.low, p.mean_v.high - p.mean_v.value] for p in points]).T
    over.errorbar(at, mean, halves, fmt=marker, color=colour, markersize=4, capsize=2, label=f"{branch} ({len(at)})")
    if branch in ("loading", "unloading"):
        off = mean - border(found.model, branch, at)
        under.errorbar(at, 1e3 * off, 1e3 * halves, fmt=marker, color=colour, markersize=4, capsize=2)


def border(model: Model, branch: Branch, level_v: Array) -> Array:
    """Return the settled reading on a border of the backlash, V, at levels of u, V (paper eqs. 6-7 through G1, G2)."""
    if isinstance(model.f, CurvedBacklash):
        curve = of_points(model.f.loading if branch == "loading" else model.f.unloading)
        return np.asarray(model.g2.dc_gain * curve.at(model.g1.dc_gain * level_v))
    assert isinstance(model.f, Backlash)
    slope, crossing = (model.f.s_l, model.f.d_l_v) if branch == "loading" else (model.f.s_u, model.f.d_u_v)
    return np.asarray(model.g2.dc_gain * slope * (model.g1.dc_gain * level_v - crossing))


def loop(answers: Sequence[Answer]) -> Picture:
    """Draw what F makes of v: the path of (v, w) over all runs, for each answer."""
    figure, axes = new_figure(1, len(answers), 3.6)
    for ax, answer in zip(axes, answers, strict=True):
        taps = [signals(answer.chain, o.trace) for o in answer.observations]
        v = np.concatenate([tap[answer.chain.index(Place.G1) - 1] for tap in taps])
        w = np.concatenate([tap[answer.chain.index(Place.F) - 1] for tap in taps])
        ax.plot(*outline(v, w), color=answer.colour, linewidth=0.9)
        ax.set(xlabel="v, the input of F, in V", ylabel="w, the output of F, in V", title=answer.label)
    memory = answers[0].chain.stage_of(Gain) is None
    return Picture(
        "Backlash loop" if memory else "What F does", embedded(figure, pixels=True),
        "Path of F's output w against its input v: " + " beside ".join(answer.label for answer in answers),
        "Neither v nor w can be measured on the bench; both are what the fitted model says, over all runs.",
    )  # fmt: skip


def residuals(answers: Sequence[Answer]) -> Picture:
    """Draw recording minus model over time, run by run, over the band of the noise; the last answer again by itself."""
    runs = answers[0].observations[:MOST_RUNS]
    columns = 2 if len(answers) > 1 else 1
    figure, axes = new_figure(len(runs), columns, 0.7 + 1.55 * len(runs))
    for row, observation in enumerate(runs):
        time = observation.trace.start_s + np.arange(observation.trace.size) / observation.trace.rate_hz
        for column in range(columns):
            ax = axes[row * columns + column]
            drawn = answers if column == 0 else answers[-1:]
            _residual_axes(ax, time, observation, [(a, a.residuals[row]) for a in drawn])
            ax.set_title(observation.trace.name, loc="left")
    left_out = len(answers[0].observations) - len(runs)
    more = f" {left_out} more runs are not drawn." if left_out else ""
    more += f" A long run is drawn up to sample {DRAWN}." if any(o.trace.size == DRAWN for o in runs) else ""
    return Picture(
        "Residual " + ("before and after" if columns == 2 else "of the fit"), embedded(figure),
        f"Recording minus model over time for {len(runs)} runs, the noise drawn as a grey band",
        f"The grey band is plus and minus two standard deviations of the noise.{more}",
    )  # fmt: skip


def _residual_axes(ax: "Axes", time: Array, observation: Observation, drawn: Sequence[tuple[Answer, Array]]) -> None:
    """Draw the residuals of one run in the unit that suits the largest of them."""
    largest = max((float(np.nanmax(np.abs(e), initial=0.0)) for _, e in drawn), default=0.0)
    factor, prefix = prefix_of(max(largest, observation.noise_v), "V")
    band = 2.0 * observation.noise_v / factor
    ax.axhspan(-band, band, color=PALE, alpha=0.7, linewidth=0)
    for answer, residual in drawn:
        text = f"{answer.label.removesuffix(' model')}, {shown(rms(residual[np.isfinite(residual)]), 'V', 3)} rms"
        draw_signal(ax, time, residual / factor, answer.colour, text)
    ax.set(xlabel="time in s", ylabel=f"y - model in {prefix}V")
    ax.locator_params(axis="x", nbins=5)
    ax.legend(fontsize=7, loc="upper right", frameon=True, framealpha=0.85, edgecolor="none", handlelength=1.0)


def spectra(answers: Sequence[Answer]) -> Picture | None:
    """Draw the amplitude spectral density of the residuals of the run with the longest gapless stretch."""
    from scipy.signal import welch

    observations = answers[0].observations
    stretches = [longest_stretch(o.use) for o in observations]
    longest = int(np.argmax([part.stop - part.start for part in stretches]))
    observation, part = observations[longest], stretches[longest]
    if part.stop - part.start < 64:
        return None
    figure, (ax,) = new_figure(1, 1, 2.9)
    rate = observation.trace.rate_hz
    for answer in answers:
        residual = answer.residuals[longest][part]
        frequency, power = welch(residual, rate, nperseg=min(4096, residual.size), detrend="constant")
        ax.loglog(frequency[1:], 1e3 * np.sqrt(power[1:]), color=answer.colour, linewidth=0.9, label=answer.label)
    ax.axhline(1e3 * observation.noise_v * np.sqrt(2.0 / rate), color=INK, linestyle="--", linewidth=0.9, label="noise")
    ax.set(xlabel="frequency in Hz", ylabel="residual in mV/√Hz", title=observation.trace.name)
    ax.legend(fontsize=7.5)
    return Picture(
        "Spectrum of the residual", embedded(figure),
        "Amplitude spectral density of recording minus model, " + " and ".join(a.label for a in answers),
        "Where a curve stands above the dashed line, something other than white noise is left at that frequency.",
    )  # fmt: skip


def frequency_response(found: Identification) -> Picture | None:
    """Draw gain and phase of both linear blocks at the frequencies that were excited, over the fitted functions."""
    if not (found.g1 or found.g2):
        return None
    figure, axes = new_figure(2, 2, 4.6)
    g1, g2 = found.blocks
    unit = found.own_points.v_p.value if found.own_points else 1.0
    read = found.measured
    sets = (("G1", found.g1, read.g1, scaled(g1, unit)), ("G2", found.g2, read.g2, scaled(g2, g2.dc_gain)))
    for column, (name, points, measured, block) in enumerate(sets):
        _response_axes(axes[column], axes[2 + column], points, block)
        _draw_measured(axes[column], axes[2 + column], measured, block)
        axes[column].set(title=name, ylabel="gain")
        axes[2 + column].set(xlabel="frequency in Hz", ylabel="phase in degrees")
    return Picture(
        "Frequency response of G1 and G2", embedded(figure),
        f"Gain and phase of G1 at {len(found.g1)} and of G2 at {len(found.g2)} frequencies with 95 % intervals",
        "Points with 95 % intervals at the excited frequencies and, for G2, at harmonics; the line is the fitted "
        "rational function. Squares are measured from harmonics or a multisine without that function. Scaled as in the "
        "paper: V_p = 1, G2(0) = 1.",
    )  # fmt: skip


def scaled(block: Rational, unit: float) -> Rational:
    """Return a block over the gain that counts as one."""
    return Rational(tuple(b / unit for b in block.num), block.den, block.dead_time_s)


def _response_axes(gain: "Axes", phase: "Axes", points: Sequence[FrequencyPoint], block: Rational) -> None:
    """Draw one block: its gain in one axes, its phase below."""
    gain.set_xscale("log")
    phase.set_xscale("log")
    if not points:
        return
    at = np.array([point.frequency_hz for point in points])
    span = np.geomspace(0.5 * at.min(), 2.0 * at.max(), 200)
    answer = response(block, span)
    gain.plot(span, np.abs(answer), color=AFTER)
    phase.plot(span, np.degrees(np.unwrap(np.angle(answer))), color=AFTER)
    for ax, scale, intervals in (
        (gain, 1.0, [p.gain for p in points]), (phase, 180.0 / np.pi, [p.phase_rad for p in points]),
    ):  # fmt: skip
        halves = scale * np.array([[i.value - i.low, i.high - i.value] for i in intervals]).T
        ax.errorbar(at, [scale * i.value for i in intervals], yerr=halves, fmt="o", color=INK, markersize=4, capsize=2)


def _draw_measured(gain: "Axes", phase: "Axes", points: Sequence[MeasuredPoint], block: Rational) -> None:
    """Draw what needs no rational form, each phase on the turn of the curve."""
    for ax, scale, told in (
        (gain, 1.0, [(p.frequency_hz, p.gain) for p in points]),
        (phase, 180.0 / np.pi, [(p.frequency_hz, p.phase_rad) for p in points]),
    ):
        known = [(f, interval) for f, interval in told if interval is not None]
        if not known:
            continue
        at = np.array([f for f, _ in known])
        value = np.array([i.value for _, i in known])
        halves = np.array([[i.value - i.low, i.high - i.value] for _, i in known]).T
        if ax is phase:
            fine = np.geomspace(0.01 * at.min(), at.max(), 2000)
            value += 2.0 * np.pi * np.rint(
                (np.interp(at, fine, np.unwrap(np.angle(response(block, fine)))) - value) / (2.0 * np.pi)
            )
        ax.errorbar(
            at, scale * value, yerr=scale * halves, fmt="s", color=BEFORE, markersize=4, capsize=2, fillstyle="none",
        )  # fmt: skip


def response(block: Rational, frequency_hz: Array) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    """Return num(jw)/den(jw) exp(-jw dead_time)."""
    s = 2j * np.pi * frequency_hz
    return np.asarray(np.polyval(block.num, s) / np.polyval(block.den, s) * np.exp(-s * block.dead_time_s))


def mismatch(profiles: Sequence[Profile], noise_v: float) -> Picture | None:
    """Draw along which coordinate the mismatch gathers, before and after the model was improved."""
    if not profiles:
        return None
    columns = min(len(profiles), 3)
    rows = -(-len(profiles) // columns)
    figure, axes = new_figure(rows, columns, 0.4 + 2.3 * rows)
    for ax, profile in zip(axes, profiles, strict=False):
        _draw_profile(ax, profile, noise_v)
    axes[0].legend(fontsize=7.5, frameon=True, framealpha=0.85, edgecolor="none")
    for ax in axes[len(profiles):]:
        ax.set_visible(False)
    return Picture(
        "Where the mismatch sits", embedded(figure),
        "Root mean square of recording minus model along " + ", ".join(profile.axis for profile in profiles),
        "Tall orange bars say where the plain model fails; the blue ones are what the improved model leaves there. The "
        "scale is logarithmic.",
    )  # fmt: skip


def _draw_profile(ax: "Axes", profile: Profile, noise_v: float) -> None:
    """Draw one coordinate, sizes on a logarithmic axis so that both models and the noise are seen."""
    factor, prefix = prefix_of(max(float(np.nanmax(profile.before_v)), noise_v), "V")
    floor = 0.3 * noise_v / factor
    for sizes_v, colour, label in ((profile.before_v, BEFORE, "before"), (profile.after_v, AFTER, "after")):
        sizes = np.maximum(sizes_v / factor, floor)
        ax.stairs(sizes, profile.edges, baseline=floor, fill=True, color=colour, alpha=0.85, label=label)
    ax.axhline(noise_v / factor, color=INK, linestyle="--", linewidth=0.9, label="noise")
    ax.set_yscale("log")
    ax.set_ylim(bottom=floor)
    ax.set(xlabel=f"{profile.axis} in {profile.unit}" if profile.unit else profile.axis, ylabel=f"rms in {prefix}V")
