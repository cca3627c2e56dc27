"""Which pictures show the rig that was identified: the borders under its readings, its loop, its two blocks?"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from identify.bent.border import of_points
from identify.blocks import Gain
from identify.chain import signals
from identify.harmonic.measured import MeasuredPoint
from identify.identification import Branch, FrequencyPoint, Identification, StairPoint
from identify.interval import Interval
from identify.model import Backlash, CurvedBacklash, LinearF, Model, Rational
from identify.natural_units import prefix_of, shown
from identify.page.answers import Answer
from identify.page.drawing import (
    AFTER,
    BEFORE,
    INK,
    Look,
    Panel,
    Picture,
    legend_above,
    logarithmic,
)
from identify.page.thinned import outline
from identify.stage import Place
from identify.trace import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Points = Sequence[tuple[float, Interval]]

BRANCHES: dict[Branch, Look] = {
    "loading": Look("#083a72", "-", "o"), "unloading": Look("#00795a", "--", "s"), "plateau": Look("#66717c", "", "D"),
    "saturated": Look("#c22f2f", "", "^"),
}  # fmt: skip
BORDERS: tuple[Branch, ...] = ("loading", "unloading")
TURN = 2.0 * np.pi


def staircase(found: Identification) -> Picture | None:
    """Draw the settled readings by branch over the fitted borders, and beside it how far they lie from them."""
    if not found.staircase or isinstance(found.model.f, LinearF):
        return None
    return Picture(
        "Staircase and borders",
        (Panel(partial(_draw_stairs, found), _stairs_words(found), 3.2),
         Panel(partial(_draw_off, found), _off_words(found), 3.2)),
        "Each point is the mean of one settled dwell with its 95 % interval. Points on a plateau or a rail lie off the "
        "borders and are not used to draw them.",
    )  # fmt: skip


def border(model: Model, branch: Branch, level_v: Array) -> Array:
    """Return the settled reading on a border of the backlash, V, at levels of u, V (paper eqs. 6-7 through G1, G2)."""
    if isinstance(model.f, CurvedBacklash):
        curve = of_points(model.f.loading if branch == "loading" else model.f.unloading)
        return np.asarray(model.g2.dc_gain * curve.at(model.g1.dc_gain * level_v))
    assert isinstance(model.f, Backlash)
    slope, crossing = (model.f.s_l, model.f.d_l_v) if branch == "loading" else (model.f.s_u, model.f.d_u_v)
    return np.asarray(model.g2.dc_gain * slope * (model.g1.dc_gain * level_v - crossing))


def _of(found: Identification, branch: Branch) -> list[StairPoint]:
    return [point for point in found.staircase if point.branch == branch]


def _off(found: Identification, branch: Branch) -> list[tuple[float, Interval]]:
    """Return how far the readings of a branch lie from its border, V, by level."""
    points = _of(found, branch)
    lines = border(found.model, branch, np.array([point.level_v for point in points]))
    return [(p.level_v, _shifted(p.mean_v, -float(line))) for p, line in zip(points, lines, strict=True)]


def _shifted(interval: Interval, by: float, scale: float = 1.0) -> Interval:
    return Interval(*(scale * (end + by) for end in (interval.value, interval.low, interval.high)))


def _draw_stairs(found: Identification, ax: "Axes") -> None:
    levels = np.array([point.level_v for point in found.staircase])
    span = np.linspace(levels.min(), levels.max(), 50)
    for branch in BORDERS:
        ax.plot(span, border(found.model, branch, span), BRANCHES[branch].line, color=INK, linewidth=1.0,
                label=f"{branch} border")  # fmt: skip
    for branch, look in BRANCHES.items():
        if points := [(point.level_v, point.mean_v) for point in _of(found, branch)]:
            _points(ax, points, look, f"{branch} ({len(points)})")
    ax.set(xlabel="level of u in V", ylabel="settled reading of y in V")
    legend_above(ax)


def _stairs_words(found: Identification) -> str:
    counts = ", ".join(f"{len(_of(found, branch))} {branch}" for branch in BRANCHES if _of(found, branch))
    levels = [point.level_v for point in found.staircase]
    ends = f"{shown(min(levels), 'V')} to {shown(max(levels), 'V')}"
    return f"{len(levels)} settled readings at levels of u from {ends} over the two fitted borders: {counts}."


def _draw_off(found: Identification, ax: "Axes") -> None:
    off = {branch: _off(found, branch) for branch in BORDERS}
    factor, prefix = prefix_of(max((abs(i.value) for points in off.values() for _, i in points), default=0.0), "V")
    for branch, points in off.items():
        if points:
            scaled_points = [(level, _shifted(i, 0.0, 1.0 / factor)) for level, i in points]
            _points(ax, scaled_points, BRANCHES[branch], branch)
    ax.axhline(0.0, color=INK, linewidth=0.8)
    ax.set(xlabel="level of u in V", ylabel=f"reading minus border in {prefix}V")
    if any(off.values()):
        legend_above(ax)


def _off_words(found: Identification) -> str:
    sizes = [abs(i.value) for branch in BORDERS for _, i in _off(found, branch)]
    if not sizes:
        return "No settled reading lies on a border."
    return f"Readings minus their borders at {len(sizes)} levels of u: {shown(max(sizes), 'V', 3)} at most."


def _points(ax: "Axes", points: Points, look: Look, label: str = "", hollow: bool = False) -> None:
    """Draw values with their intervals."""
    value = np.array([interval.value for _, interval in points])
    halves = np.array([[i.value - i.low, i.high - i.value] for _, i in points]).T
    halves[~np.isfinite(halves)] = np.nan  # an interval without an end has no bar
    ax.errorbar([at for at, _ in points], value, halves, fmt=look.marker, color=look.colour, markersize=4, capsize=2,
                elinewidth=0.9, fillstyle="none" if hollow else "full", label=label or None)  # fmt: skip


def loop(answers: Sequence[Answer]) -> Picture:
    """Draw what F makes of v: the path of (v, w) over all runs, for each answer."""
    memory = answers[0].chain.stage_of(Gain) is None
    return Picture(
        "Backlash loop" if memory else "What F does", tuple(_loop(answer) for answer in answers),
        "Neither v nor w can be measured on the bench; both are what the fitted model says, over all runs.",
    )  # fmt: skip


def _loop(answer: Answer) -> Panel:
    taps = [signals(answer.chain, o.trace) for o in answer.observations]
    v, w = (np.concatenate([tap[answer.chain.index(place) - 1] for tap in taps]) for place in (Place.G1, Place.F))
    ends = [f"{shown(float(x.min()), 'V')} to {shown(float(x.max()), 'V')}" for x in (v, w)]
    words = f"Path of F's output w, {ends[1]}, over its input v, {ends[0]}, as the {answer.label} has it."
    return Panel(partial(_draw_loop, answer, *outline(v, w)), words, 3.2, pixels=True)


def _draw_loop(answer: Answer, v: Array, w: Array, ax: "Axes") -> None:
    ax.plot(v, w, color=answer.look.colour, linewidth=0.9)
    ax.set(xlabel="v, the input of F, in V", ylabel="w, the output of F, in V", title=answer.label)


def frequency_response(found: Identification) -> Picture | None:
    """Draw gain and phase of both linear blocks at the frequencies that were excited, over the fitted functions."""
    if not (found.g1 or found.g2):
        return None
    g1, g2 = found.blocks
    unit = found.own_points.v_p.value if found.own_points else 1.0
    read = found.measured
    sets = (("G1", found.g1, read.g1, scaled(g1, unit)), ("G2", found.g2, read.g2, scaled(g2, g2.dc_gain)))
    quantities = (Quantity("gain", "gain", _gain, _gains), Quantity("phase", "phase in degrees", _degrees, _phases))
    panels = tuple(
        Panel(partial(_draw_response, quantity, *one), _response_words(quantity.name, *one[:2]), 2.6)
        for quantity in quantities for one in sets
    )  # fmt: skip
    return Picture(
        "Frequency response of G1 and G2", panels,
        "Points with 95 % intervals at the excited frequencies and, for G2, at harmonics; the line is the fitted "
        "rational function. Squares are measured from harmonics or a multisine without that function. Scaled as in the "
        "paper: V_p = 1, G2(0) = 1.",
    )  # fmt: skip


def _response_words(what: str, name: str, points: Sequence[FrequencyPoint]) -> str:
    if not points:
        return f"No {what} of {name} was measured at any frequency."
    ends = sorted(points, key=lambda point: point.frequency_hz)
    told = ", ".join(
        f"{p.gain.value:.3g} at {shown(p.frequency_hz, 'Hz')}" if what == "gain" else
        f"{np.degrees(p.phase_rad.value):.3g} degrees at {shown(p.frequency_hz, 'Hz')}"
        for p in dict.fromkeys((ends[0], ends[-1]))
    )  # fmt: skip
    return f"{what.capitalize()} of {name}, measured points over the fitted function: {told}."


def scaled(block: Rational, unit: float) -> Rational:
    """Return a block over the gain that counts as one."""
    return Rational(tuple(b / unit for b in block.num), block.den, block.dead_time_s)


@dataclass(frozen=True)
class Quantity:
    """What a frequency response is drawn by: the name, its axis, the fitted curve, and the measured points."""

    name: str
    axis: str
    curve: Callable[[Rational, Array], Array]
    points: Callable[[Sequence[FrequencyPoint] | Sequence[MeasuredPoint], Rational], Points]


def _draw_response(
    quantity: Quantity, name: str, points: Sequence[FrequencyPoint], measured: Sequence[MeasuredPoint],
    block: Rational, ax: "Axes",
) -> None:  # fmt: skip
    if points:
        span = _span(points)
        ax.plot(span, quantity.curve(block, span), color=AFTER.colour, label="fitted function")
        _points(ax, quantity.points(points, block), Look(INK), "fitted, 95 %")
    if known := quantity.points(measured, block):
        _points(ax, known, BEFORE, "measured, 95 %", hollow=True)
    ax.set(xlabel="frequency in Hz", ylabel=f"{quantity.axis} of {name}")
    logarithmic(ax, "x")
    if points or known:
        legend_above(ax, name, columns=3)


def _span(points: Sequence[FrequencyPoint]) -> Array:
    """Return the frequencies at which the fitted function is drawn, Hz."""
    at = [point.frequency_hz for point in points]
    return np.geomspace(0.5 * min(at), 2.0 * max(at), 200)


def _gain(block: Rational, frequency_hz: Array) -> Array:
    return np.asarray(np.abs(response(block, frequency_hz)))


def _gains(points: Sequence[FrequencyPoint] | Sequence[MeasuredPoint], _block: Rational) -> Points:
    return [(point.frequency_hz, point.gain) for point in points if point.gain is not None]


def _degrees(block: Rational, frequency_hz: Array) -> Array:
    return np.asarray(np.degrees(_phase(block, frequency_hz)))


def _phases(points: Sequence[FrequencyPoint] | Sequence[MeasuredPoint], block: Rational) -> Points:
    """Return phases, degrees, each on the turn of the fitted curve."""
    known = [(point.frequency_hz, point.phase_rad) for point in points if point.phase_rad is not None]
    if not known:
        return []
    at = np.array([frequency for frequency, _ in known])
    fine = np.geomspace(0.01 * at.min(), at.max(), 2000)
    curve = np.interp(at, fine, _phase(block, fine))
    value = np.array([interval.value for _, interval in known])
    turns = TURN * np.rint((curve - value) / TURN)
    return [(f, _shifted(i, float(turn), 180.0 / np.pi)) for (f, i), turn in zip(known, turns, strict=True)]


def _phase(block: Rational, frequency_hz: Array) -> Array:
    return np.asarray(np.unwrap(np.angle(response(block, frequency_hz))))


def response(block: Rational, frequency_hz: Array) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    """Return num(jw)/den(jw) exp(-jw dead_time)."""
    s = 2j * np.pi * frequency_hz
    return np.asarray(np.polyval(block.num, s) / np.polyval(block.den, s) * np.exp(-s * block.dead_time_s))
