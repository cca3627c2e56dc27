"""What does an operator play who was not told what to play? One to four runs of any kind, at any rate.

The study's own protocol (tests/proof/standard.py) has every experiment that tells physics apart; here there may be one
chirp, nothing may be held out, and what is held out may move farther than all that was fitted.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from tests.proof.rigs import Rig, Rng, between
from tests.proof.standard import SOURCE_V
from tests.proof.stimuli import Array, Stimulus, repeated

RATES_HZ = (2e3, 5e3, 10e3, 25e3, 50e3)
MOST = 4  # runs to be fitted
HELD_OUT = 0.7  # share of protocols of which a run is held out
REPEATS = (1, 1, 2, 3)
SECONDS = (0.15, 1.5)
REACH = (1.3, 3.5)  # peak over half the gap
LINES = (0.31, 0.73, 1.17, 1.9, 2.3, 3.7)  # of a multisine, over a tenth of what the lags of both blocks let through

Shape = Callable[[Rng, Array, float], Array]
"""A stimulus of peak 1 from random numbers, the instants in s, and the sum of the lags of both blocks, s."""


def protocol(rig: Rig, rng: Rng) -> tuple[tuple[Stimulus, ...], tuple[Stimulus, ...]]:
    """Return what is played to a rig: the runs a model may be fitted to, and the one kept back, where there is one."""
    rate_hz = float(rng.choice(RATES_HZ))
    training = tuple(_run(rig, rng, rate_hz, f"run_{i}") for i in range(int(rng.integers(1, MOST + 1))))
    return training, (_run(rig, rng, rate_hz, "kept"),) if rng.random() < HELD_OUT else ()


def _run(rig: Rig, rng: Rng, rate_hz: float, name: str) -> Stimulus:
    """Return one run of any kind, as far as the source reaches."""
    peak_v = min(rig.half_gap_v * between(rng, *REACH) + abs(rig.d_l_v + rig.d_u_v) / 2.0, SOURCE_V)
    lags_s = sum(den[-2] for den in (rig.g1_den, rig.g2_den))
    kind = str(rng.choice(sorted(SHAPES)))
    t = np.arange(round(between(rng, *SECONDS) * rate_hz)) / rate_hz
    once = peak_v * SHAPES[kind](rng, t, lags_s)
    played = repeated(name, kind, once, int(rng.choice(REPEATS)))
    return Stimulus(name, played.u, played.segments, rate_hz)


def _held(rng: Rng, t: Array, lags_s: float, least: float, most: float) -> NDArray[np.int64]:
    """Return the number of the level that is held at every instant, each for that many lags."""
    return np.floor(t / (between(rng, least, most) * lags_s)).astype(np.int64)


def _stairs(rng: Rng, t: Array, lags_s: float) -> Array:
    held = _held(rng, t, lags_s, 1.0, 8.0)
    return np.concatenate([[0.0], rng.uniform(-1.0, 1.0, held[-1])])[held]


def _random(rng: Rng, t: Array, lags_s: float) -> Array:
    held = _held(rng, t, lags_s, 0.3, 3.0)
    return rng.uniform(-1.0, 1.0, held[-1] + 1)[held]


def _binary(rng: Rng, t: Array, lags_s: float) -> Array:
    held = _held(rng, t, lags_s, 0.3, 3.0)
    return rng.choice([-1.0, 1.0], held[-1] + 1)[held]


def _sine(rng: Rng, t: Array, lags_s: float) -> Array:
    return np.sin(0.2 * np.pi * between(rng, 0.3, 4.0) / lags_s * t)


def _triangle(rng: Rng, t: Array, lags_s: float) -> Array:
    return 4.0 * np.abs((0.1 * between(rng, 0.2, 2.0) / lags_s * t + 0.25) % 1.0 - 0.5) - 1.0


def _chirp(rng: Rng, t: Array, lags_s: float) -> Array:
    low, high = 0.02 / lags_s, 1.0 / lags_s
    return np.sin(2.0 * np.pi * (low * t + (high - low) * t**2 / (2.0 * t[-1])))


def _multisine(rng: Rng, t: Array, lags_s: float) -> Array:
    phases = rng.uniform(0.0, 2.0 * np.pi, len(LINES))
    u = np.sin(0.2 * np.pi / lags_s * np.outer(t, LINES) + phases).sum(axis=1)
    return np.asarray(u / np.abs(u).max())


SHAPES: dict[str, Shape] = {
    "staircase": _stairs, "random": _random, "binary": _binary, "sine": _sine, "triangle": _triangle, "chirp": _chirp,
    "multisine": _multisine,
}  # fmt: skip
