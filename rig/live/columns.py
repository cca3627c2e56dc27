"""Which points does the page draw at this moment?"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.live.envelope import drawn, outline
from rig.live.watching import Watch

BRANCHES = ("loading", "unloading", "plateau", "saturated")
CLOSE, TRAIL = 400, 1200
"""Columns of what is looked at closely, and points of the way through the loop."""
VISIBLE = 1024
"""Parts of its height that a picture of a whole run shows: what moves less need not be drawn again."""
Columns = dict[str, NDArray[Any]]


def columns(watch: Watch) -> dict[str, Columns]:
    """Return what each source of the page holds now, by name: numbers alone, times in s, levels in V."""
    points = {branch: _points(watch, branch) for branch in BRANCHES}
    held = {"latest": _latest(watch), "whole": _whole(watch), "residual": _residual(watch), "hull": _hull(watch),
            "trail": _trail(watch), "borders": _borders(watch), **points}
    return {name: _begun(each) for name, each in held.items()}


def _begun(held: Columns) -> Columns:
    """Return columns, those with nothing in them yet with a point that is nowhere: a legend shows what has a point."""
    return {name: values if values.size else np.full(1, np.nan, dtype=np.float32) for name, values in held.items()}


def _single(values: Any) -> NDArray[np.float32]:
    """Return values as finely as a screen shows them."""
    return np.asarray(values, dtype=np.float32)


def _coarse(held: Columns) -> Columns:
    """Return levels no finer than a picture of them shows: they stand still while the run changes nothing there."""
    levels = np.hstack([values[np.isfinite(values)] for values in held.values()])
    span = float(np.ptp(levels)) if levels.size else 0.0
    step = 2.0 ** np.floor(np.log2(span / VISIBLE)) if span else 1.0
    return {name: _single(np.round(values / step) * step if span else values) for name, values in held.items()}


def _latest(watch: Watch) -> Columns:
    """Return the signals of the last seconds."""
    latest = watch.latest
    lines = {name: drawn(values, latest.first, CLOSE) for name, values in latest.signals.items() if name != "v"}
    t = watch.about.start_s + lines["u"][0] / watch.about.rate_hz
    return {"t": t, **{name: _single(values) for name, (_, values) in lines.items()}}


def _whole(watch: Watch) -> Columns:
    """Return u and y from the first sample on, as lines through the least and the largest of every column."""
    of = {name: watch.whole[name] for name in ("u", "y")}
    count, width = of["u"].low.size, of["u"].width
    index = np.column_stack((np.arange(count) + 0.25, np.arange(count) + 0.75)).ravel() * width
    t = watch.about.start_s + index / watch.about.rate_hz
    return {"t": t, **_coarse({name: outline(each.low, each.high) for name, each in of.items()})}


def _residual(watch: Watch) -> Columns:
    """Return least, largest and mean of the residual in every column, and the noise of a reading beside it."""
    held, mean = watch.whole["residual"], watch.means.means()
    t = watch.about.start_s + (np.arange(mean.size) + 0.5) * held.width / watch.about.rate_hz
    noise = np.full(mean.size, np.nan if watch.noise_v is None else watch.noise_v)
    return {"t": t, **_coarse({"low": held.low, "high": held.high, "mean": mean, "noise": noise, "minus": -noise})}


def _hull(watch: Watch) -> Columns:
    """Return a bar from the least to the largest y at every level of v that was met, none where v jumped over it."""
    hull = watch.hull
    met = np.isfinite(hull.low)
    v, low, high = hull.levels_v()[met], hull.low[met], hull.high[met]
    half_v = 0.5 * hull.width_v
    return {"left": _single(v - half_v), "right": _single(v + half_v), **_coarse({"low": low, "high": high})}


def _trail(watch: Watch) -> Columns:
    """Return the way of the last samples through the loop, by the readings and by the model."""
    signals = watch.latest.signals
    every = max(-(-signals["v"].size // TRAIL), 1)
    return {name: _single(signals[name][-1::-every][::-1]) for name in ("v", "y", "x")}


def _points(watch: Watch, branch: str) -> Columns:
    """Return the settled dwells that end on one branch, after a point that is nowhere, for the legend."""
    found = [point for point in watch.points if point.branch == branch]
    return {"v": _single([np.nan, *(point.v_v for point in found)]),
            "y": _single([np.nan, *(point.y_v for point in found)])}


def _borders(watch: Watch) -> Columns:
    """Return the model's borders over the levels of v that were met, one line broken in two."""
    if watch.plain is None or not np.isfinite(watch.hull.low).any():
        return {"v": _single([]), "y": _single([])}
    met = watch.hull.levels_v()[np.isfinite(watch.hull.low)]
    ends = np.array([met[0], met[-1], np.nan])
    lines = [(ends, slope * (ends - crossing)) for slope, crossing in watch.plain.borders()]
    v, y = np.hstack(lines) if lines else np.empty((2, 0))
    return {"v": _single(v), "y": _single(y)}
