"""Which lamps does the page show, and does each say in words what it says in colour?"""

from dataclasses import dataclass

import numpy as np

from rig.live.watching import Watch
from rig.narration import span

AT_END = 2e-3  # of a range: what is nearer to its end counts as being there
LATE_S, LATE_SAMPLES = 1.0, 20_000  # of recording that the page may not have looked at, before it says so


@dataclass(frozen=True)
class Lamp:
    """One lamp: ``off`` where nothing is known, ``good``, ``warn`` or ``bad``, and its words, which say as much."""

    state: str
    words: str


def lamps(watch: Watch) -> dict[str, Lamp]:
    """Return the lamps by name."""
    return {"run": _run_lamp(watch), "overrun": _overrun_lamp(watch), "input": _input_lamp(watch),
            "output": _output_lamp(watch), "page": _page_lamp(watch)}


def _run_lamp(watch: Watch) -> Lamp:
    stands = watch.stands
    if stands.going_on:
        return Lamp("good", "recording")
    return Lamp("good", "complete") if stands.complete else Lamp("bad", "ended early")


def _overrun_lamp(watch: Watch) -> Lamp:
    return Lamp("bad", f"{watch.lost} samples lost") if watch.lost else Lamp("good", "no sample lost")


def _input_lamp(watch: Watch) -> Lamp:
    """Tell whether y came to the end of the input's range."""
    ranges_v = watch.about.ranges_v
    met = reached(watch, "y")
    if ranges_v is None or met is None:
        return Lamp("off", "range not known" if ranges_v is None else "no reading yet")
    low, high = ranges_v[2:]
    at_end = _at_end(met, low, high)
    return Lamp("bad" if at_end else "good", f"y {between(met)}: {'at the end of' if at_end else 'within'} "
                f"the input's {low:g} to {high:g} V")


def _output_lamp(watch: Watch) -> Lamp:
    """Tell whether u came to its limit: that of the protocol, or the end of the output's range."""
    limits, ranges_v, met = watch.limits, watch.about.ranges_v, reached(watch, "u")
    bounds = [(limits.low_v, limits.high_v)] if limits else []
    bounds += [(ranges_v[0], ranges_v[1])] if ranges_v else []
    if not bounds or met is None:
        return Lamp("off", "no limit known" if not bounds else "nothing put out yet")
    low, high = max(low for low, _ in bounds), min(high for _, high in bounds)
    at_end = _at_end(met, low, high)
    return Lamp("warn" if at_end else "good", f"u {between(met)}: {'at the end of' if at_end else 'within'} "
                f"its limits {low:g} to {high:g} V")


def _page_lamp(watch: Watch) -> Lamp:
    """Tell whether the page keeps up; the run does not wait for it either way."""
    behind_s = watch.behind / watch.about.rate_hz
    if behind_s > LATE_S and watch.behind > LATE_SAMPLES:
        return Lamp("warn", f"this page is {span(behind_s)} of recording behind; the run is not")
    return Lamp("good", "this page is up to date")


def reached(watch: Watch, name: str) -> tuple[float, float] | None:
    """Return the least and the largest sample so far."""
    held = watch.whole[name]
    known = np.isfinite(held.low)
    return (float(held.low[known].min()), float(held.high[known].max())) if known.any() else None


def _at_end(met: tuple[float, float], low: float, high: float) -> bool:
    near = AT_END * (high - low)
    return met[0] <= low + near or met[1] >= high - near


def between(met: tuple[float, float] | None) -> str:
    """Return two levels in words."""
    return "not known yet" if met is None else f"{met[0]:.4g} to {met[1]:.4g} V"
