"""What may be missing that nobody thought of? Laws put together by chance: what is changed, by what, and how.

A made-up kind is what somebody thought of, and the product has learnt from most of them. Here the three words of a law
are drawn, ``gap by warmth, beyond``: nobody chose it, and nothing was built for it. What the catalogue has, and what a
map of one level is to any tool, is left out.
"""

from collections.abc import Callable, Iterator

import numpy as np
from scipy.signal import lfilter

from tests.proof.integrator import Array, play
from tests.proof.outside import pushed_about
from tests.proof.physics import Change, Place, Scene, borders

Sized = Callable[[Array, Array, Scene], Array]
Asked = Callable[[Array, Scene], Array]


def _step_s(signal: Array, scene: Scene) -> float:
    """Return the time between two values of a signal, s: a sub-step, or a sample of what is read."""
    return 1.0 / scene.grid.rate_hz if signal.size == scene.grid.samples else scene.grid.step_s


def _run_s(signal: Array, scene: Scene) -> Array:
    return np.asarray(np.arange(signal.size) * _step_s(signal, scene))


def _behind(signal: Array, tau_s: float, scene: Scene) -> Array:
    """Return a signal behind a pole, at rest before the start, as the rig is: a staircase begins with a step."""
    share = -np.expm1(-_step_s(signal, scene) / tau_s)
    return np.asarray(lfilter([share], [1.0, share - 1.0], signal))


# --- by what: about -1 to 1 ----------------------------------------------------------------------------------------


def level(signal: Array, scene: Scene) -> Array:
    """Return the level of the signal itself."""
    return signal / scene.values["top"]


def size(signal: Array, scene: Scene) -> Array:
    """Return the level without its sign."""
    return np.abs(level(signal, scene))


def speed(signal: Array, scene: Scene) -> Array:
    """Return how fast the signal moves, either way."""
    return np.asarray(np.abs(np.gradient(signal, _step_s(signal, scene))) / scene.values["speed"])


def way(signal: Array, scene: Scene) -> Array:
    """Return which way the signal moved last."""
    moves = np.sign(np.diff(signal, prepend=signal[0]))
    return moves[np.maximum.accumulate(np.where(moves != 0.0, np.arange(moves.size), 0))]


def load(signal: Array, scene: Scene) -> Array:
    """Return the size of late."""
    return _behind(size(signal, scene), scene.values["tau"], scene)


def warmth(signal: Array, scene: Scene) -> Array:
    """Return the square of late."""
    return _behind(level(signal, scene) ** 2, scene.values["tau"], scene)


def history(signal: Array, scene: Scene) -> Array:
    """Return the level of late."""
    return _behind(level(signal, scene), scene.values["tau"], scene)


def work(signal: Array, scene: Scene) -> Array:
    """Return how much the signal moved of late."""
    return _behind(speed(signal, scene), scene.values["tau"], scene)


def peak(signal: Array, scene: Scene) -> Array:
    """Return how far the signal ever was from zero in the run."""
    return np.maximum.accumulate(size(signal, scene))


def rest(signal: Array, scene: Scene) -> Array:
    """Return how long it is that the signal turned, towards one in ``tau``."""
    turned = np.flatnonzero(np.diff(way(signal, scene), prepend=0.0))
    at = np.arange(signal.size)
    last = turned[np.maximum(np.searchsorted(turned, at, side="right") - 1, 0)] if turned.size else np.zeros_like(at)
    return np.asarray(-np.expm1(-np.maximum(at - last, 0) * _step_s(signal, scene) / scene.values["tau"]))


def clock(signal: Array, scene: Scene) -> Array:
    """Return the time since the first run began."""
    return (scene.grid.start_s + _run_s(signal, scene)) / scene.values["span"]


def moment(signal: Array, scene: Scene) -> Array:
    """Return whether a moment of the clock is past."""
    return (scene.grid.start_s + _run_s(signal, scene) > scene.values["moment"]).astype(float)


def run(signal: Array, scene: Scene) -> Array:
    """Return the time since the run began, towards one in ``tau``."""
    return np.asarray(-np.expm1(-_run_s(signal, scene) / (5.0 * scene.values["tau"])))


def wave(signal: Array, scene: Scene) -> Array:
    """Return a sine of the clock."""
    return np.sin(2.0 * np.pi * scene.values["frequency"] * (scene.grid.start_s + _run_s(signal, scene)))


def drive(signal: Array, scene: Scene) -> Array:
    """Return what the DAC holds, wherever the signal is."""
    at = np.minimum(_run_s(signal, scene) * scene.grid.rate_hz, scene.u.size - 1).astype(int)
    return scene.u[at] / scene.values["u"]


BY: dict[str, Asked] = {f.__name__: f for f in (
    level, size, speed, way, load, warmth, history, work, peak, rest, clock, moment, run, wave, drive,
)}  # fmt: skip

# --- how: a shape of that ------------------------------------------------------------------------------------------

HOW: dict[str, Callable[[Array], Array]] = {
    "straight": lambda q: q,
    "square": np.square,
    "beyond": lambda q: np.sign(q) * np.maximum(np.abs(q) - 0.35, 0.0),
    "switch": lambda q: (q > 0.35).astype(float),
    "turning": lambda q: np.sin(2.5 * np.pi * q),
}
STEPS = ("way", "moment")  # have two values: a shape is none

# --- what ----------------------------------------------------------------------------------------------------------


def gain(signal: Array, change: Array, scene: Scene) -> Array:
    """Scale a signal, by up to 0.3."""
    return signal * (1.0 + 0.3 * change)


def offset(signal: Array, change: Array, scene: Scene) -> Array:
    """Add to a signal, up to 0.2 of how far it goes."""
    return signal + 0.2 * scene.values["top"] * change


def lagging(signal: Array, change: Array, scene: Scene) -> Array:
    """Put a share of the signal behind a pole."""
    return signal + np.clip(change, -0.9, 1.0) * (_behind(signal, scene.values["pole"], scene) - signal)


def timing(signal: Array, change: Array, scene: Scene) -> Array:
    """Read later, by up to 3 ms, or earlier."""
    return np.asarray(signal - 3e-3 * change * np.gradient(signal, _step_s(signal, scene)))


def gap(v: Array, change: Array, scene: Scene) -> Array:
    """Move both crossings out, by up to 0.6 of half the gap."""
    out = 0.6 * scene.rig.half_gap_v * change
    return _between(v, scene, -out, out)


def middle(v: Array, change: Array, scene: Scene) -> Array:
    """Move both crossings up, by up to 0.6 of half the gap."""
    up = 0.6 * scene.rig.half_gap_v * change
    return _between(v, scene, up, up)


def crossing(v: Array, change: Array, scene: Scene) -> Array:
    """Move the crossing of rises alone."""
    return _between(v, scene, np.zeros(v.size), 0.6 * scene.rig.half_gap_v * change)


def _between(v: Array, scene: Scene, upper: Array, lower: Array) -> Array:
    rig = scene.rig
    return play(rig.s_l * (v - rig.d_l_v - lower), rig.s_u * (v - rig.d_u_v - upper), 0.0, 1.0, 0.0)


def slope(v: Array, change: Array, scene: Scene) -> Array:
    """Turn the border of rises about its crossing, by up to 0.2."""
    lower, upper = borders(v, scene.rig)
    return play(np.minimum(lower * (1.0 + 0.2 * change), upper), upper, 0.0, 1.0, 0.0)


def hold(v: Array, change: Array, scene: Scene) -> Array:
    """Push w while it is held, by up to its range in half a second."""
    return np.asarray(pushed_about(*borders(v, scene.rig), 2.0 * scene.values["w"] * change * scene.grid.step_s))


WHAT: dict[str, tuple[str, Place, Sized]] = {
    "gain of u": ("source", "drive", gain),
    "offset of u": ("source", "drive", offset),
    "lag of u": ("source", "drive", lagging),
    "gain of v": ("G1", "v", gain),
    "offset of v": ("G1", "v", offset),
    "lag of v": ("G1", "v", lagging),
    "gap": ("F", "play", gap),
    "middle": ("F", "play", middle),
    "crossing": ("F", "play", crossing),
    "slope": ("F", "play", slope),
    "hold": ("F", "play", hold),
    "gain of w": ("F", "w", gain),
    "offset of w": ("F", "w", offset),
    "lag of x": ("G2", "x", lagging),
    "gain of y": ("sense", "y", gain),
    "offset of y": ("sense", "y", offset),
    "timing of y": ("sense", "y", timing),
}
TAKEN = {  # by effects of the catalogue
    "gain of v by warmth, straight", "gain of w by warmth, straight", "gap by speed, straight",
    "offset of y by clock, straight", "gain of y by clock, straight", "offset of y by drive, straight",
    "gap by clock, straight",
}  # fmt: skip
SUDDEN = {"speed", "work"}  # u jumps: it has no speed


def names() -> Iterator[tuple[str, str, str]]:
    """Yield what, by what and how of every law that may be drawn."""
    for what, (stage, _, change) in WHAT.items():
        for by in BY:
            for how in HOW if by not in STEPS else ("straight",):
                mapped = change in (gain, offset) and (by in ("level", "size") or (by, stage) == ("drive", "source"))
                sudden = stage == "source" and by in SUDDEN
                if not mapped and not sudden and named(what, by, how) not in TAKEN:
                    yield what, by, how


def named(what: str, by: str, how: str) -> str:
    return f"{what} by {by}, {how}"


def _law(what: str, by: str, how: str) -> tuple[Place, Change]:
    _, place, change = WHAT[what]

    def law(signal: Array, scene: Scene) -> Array:
        return change(signal, scene.values["k"] * HOW[how](BY[by](signal, scene)), scene)

    return place, law


COMPOSED: dict[str, tuple[Place, Change]] = {named(*words): _law(*words) for words in names()}
