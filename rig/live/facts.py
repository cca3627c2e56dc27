"""What does the page say at this moment, in words beside its pictures?"""

from bisect import bisect_right
from dataclasses import asdict
from typing import Any

import numpy as np

from identify.natural_units import shown
from identify.trace import Array
from rig.live.lamps import between, lamps, reached
from rig.live.watching import Watch
from rig.narration import span


def facts(watch: Watch) -> dict[str, Any]:
    """Return what the page says now; all texts are plain, whatever stands in them."""
    about, stands = watch.about, watch.stands
    return {
        "title": about.title or about.name, "question": about.question,
        "device": f"{about.model or 'a device'} at {about.address}", "file": about.name,
        "started": about.started, "going_on": stands.going_on, "state": _state(watch),
        "share": stands.acknowledged / about.size,
        "progress": _progress(watch), "step": _step(watch), "events": _events(watch), "model": _model(watch),
        "figures": _figures(watch), "lamps": {name: asdict(lamp) for name, lamp in lamps(watch).items()},
        "alternatives": _alternatives(watch),
    }


def _state(watch: Watch) -> str:
    """Return how the run stands, in one sentence."""
    stands = watch.stands
    if stands.going_on:
        return "Recording."
    kept = f"{stands.acknowledged} of {watch.about.size} samples kept"
    return f"Ended: {stands.reason}." if stands.complete else f"Ended early: {stands.reason} ({kept})."


def _progress(watch: Watch) -> str:
    """Return how far the run is and how long it still takes."""
    about, stands = watch.about, watch.stands
    done_s, whole_s = stands.acknowledged / about.rate_hz, about.size / about.rate_hz
    told = f"{span(done_s)} of {span(whole_s)} ({100.0 * stands.acknowledged / about.size:.0f} %)"
    left_s = watch.left_s() if stands.going_on else None
    return told if left_s is None else f"{told}, about {span(float(f'{left_s:.2g}'))} left"


def _step(watch: Watch) -> str:
    """Return what is being played."""
    about, at = watch.about, max(watch.stands.acknowledged - 1, 0)
    number = bisect_right([step.start for step in about.steps], at) - 1
    if number < 0 or not watch.stands.acknowledged:
        return "nothing yet"
    step = about.steps[number]
    again = f", pass {step.repeat + 1}" if step.repeat else ""
    return f"{step.label}{again} ({number + 1} of {len(about.steps)})"


def _events(watch: Watch) -> list[str]:
    """Return what happened, as the run said when it ended."""
    return [f"{event.kind}: {event.text}" for event in watch.stands.events]


def _model(watch: Watch) -> str:
    moving = "" if watch.about.initial == "rest" else "; it starts at rest, and the rig was in motion"
    return f"{watch.model_words}{moving if watch.plain else ''}"


def _figures(watch: Watch) -> dict[str, str]:
    """Return the numbers of the page."""
    signals, noise_v = watch.latest.signals, watch.noise_v
    seen = {name: signals[name] for name in ("u", "y") if signals[name].size}
    settled = "settled readings" if watch.dwells.noise_v else "the rig file"
    return {
        **{name: _level(values[-1]) for name, values in seen.items()},
        "residual": _rms(watch.squares.rms, noise_v), "latest": _rms(_latest_rms(watch), noise_v),
        "noise": "not known yet" if noise_v is None else f"{shown(noise_v, 'V', 3)} rms, from {settled}",
        "dwells": str(len(watch.points)), "samples": f"{watch.stands.acknowledged}",
    }


def _level(value: float) -> str:
    return shown(float(value), "V", 4) if np.isfinite(value) else "lost"


def _latest_rms(watch: Watch) -> float | None:
    """Return the rms of the residual of what is looked at closely, V."""
    residual = watch.latest.signals["y"] - watch.latest.signals["x"]
    known = residual[np.isfinite(residual)]
    return float(np.sqrt(np.mean(np.square(known)))) if known.size else None


def _rms(value_v: float | None, noise_v: float | None) -> str:
    if value_v is None:
        return "none"
    times = f", {value_v / noise_v:.3g} x the noise" if noise_v else ""
    return f"{shown(value_v, 'V', 3)} rms{times}"


def _alternatives(watch: Watch) -> dict[str, str]:
    """Return what is to be seen in each picture, for who does not see it."""
    latest, residual = watch.latest.signals, watch.whole["residual"]
    last_s = latest["u"].size / watch.about.rate_hz
    off = "no model to compare with" if watch.plain is None else f"residual {_rms(watch.squares.rms, watch.noise_v)}"
    branches = ", ".join(f"{sum(p.branch == branch for p in watch.points)} {branch}"
                         for branch in ("loading", "unloading", "plateau", "saturated"))
    ends = ", ".join(f"{label} {_ends(latest[name])}" for name, label in (("u", "u"), ("y", "y"), ("x", "model")))
    return {
        "latest": f"The last {span(last_s)}: {ends}.",
        "whole": f"The whole run so far: u {between(reached(watch, 'u'))}, y {between(reached(watch, 'y'))}.",
        "loop": f"y against {'v' if watch.plain else 'u'}: {len(watch.points)} settled dwells ({branches}).",
        "residual": f"Reading less model: {off}, {between(reached(watch, 'residual'))}."
        if np.isfinite(residual.low).any() else f"Reading less model: {off}.",
    }


def _ends(values: Array) -> str:
    known = values[np.isfinite(values)]
    return between((float(known.min()), float(known.max()))) if known.size else "not known"
