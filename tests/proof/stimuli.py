"""What is played in a trial: the staircases, the sines and the two runs kept back for the proof."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
RATE_HZ = 10_000.0
PAUSE_S = 2.3  # between two runs, while the operator changes the protocol

# Fig. 13 (physics.md 1.5): from rest to -3 V, up to +3 V (k = 1..13), down to -3.5 V (k = 14..26).
FIG13_LEVELS_V = tuple(float(v) for v in np.concatenate([np.arange(-3.0, 3.1, 0.5), np.arange(2.5, -3.6, -0.5)]))
HELD_OUT_LEVELS_V = (-2.8, -2.1, -1.3, -0.4, 0.3, 0.9, 1.6, 2.3, 2.8, 2.2, 1.7, 0.8, 0.1, -0.6, -1.5, -2.2)
# Lines of the multisine: no harmonic of the mains, no two on the same harmonic ladder, 1 Hz apart at least.
MULTISINE_HZ = (3.0, 7.0, 11.0, 17.0, 23.0, 31.0, 43.0)


@dataclass(frozen=True)
class Segment:
    """Samples [start, stop) under one stimulus; the same label with another ``repeat`` is the same stimulus again."""

    label: str
    kind: str
    start: int
    stop: int
    repeat: int = 0


@dataclass(frozen=True)
class Stimulus:
    """What the DAC holds, ``u`` in V, shape (N,), its segments, and the pause since the run before."""

    name: str
    u: Array
    segments: tuple[Segment, ...]
    rate_hz: float = RATE_HZ
    pause_s: float = PAUSE_S


def staircase(name: str, levels_v: tuple[float, ...], dwell_s: float, repeats: int = 1) -> Stimulus:
    """Return the levels held for ``dwell_s`` each, the whole walk ``repeats`` times."""
    once = np.repeat(np.asarray(levels_v), round(dwell_s * RATE_HZ))
    return repeated(name, "staircase", once, repeats)


def sine(name: str, frequency_hz: float, amplitude_v: float, periods: int, repeats: int) -> Stimulus:
    """Return ``repeats`` stretches of u = amplitude_v sin(2 pi f t), ``periods`` each, from zero.

    Raise ValueError unless a stretch is a whole number of samples: it would be no repeat of the one before.
    """
    samples = periods * RATE_HZ / frequency_hz
    if samples != round(samples):
        raise ValueError(f"{name}: {periods} periods of {frequency_hz} Hz are {samples} samples, not a whole number")
    once = amplitude_v * np.sin(2.0 * np.pi * frequency_hz * np.arange(round(samples)) / RATE_HZ)
    return repeated(name, "sine", once, repeats)


def multisine(name: str, peak_v: float, repeats: int, lines_hz: tuple[float, ...] = MULTISINE_HZ) -> Stimulus:
    """Return ``lines_hz`` with equal amplitudes and Schroeder phases over periods of 1 s, scaled to ``peak_v``."""
    t = np.arange(round(RATE_HZ)) / RATE_HZ
    index = np.arange(len(lines_hz))
    phases = -np.pi * index * (index + 1) / len(lines_hz)
    once = np.sin(2.0 * np.pi * np.outer(t, lines_hz) + phases).sum(axis=1)
    return repeated(name, "multisine", once * peak_v / np.abs(once).max(), repeats)


def repeated(name: str, kind: str, once: Array, repeats: int) -> Stimulus:
    """Return ``once``, V, shape (n,), played ``repeats`` times, a segment each."""
    segments = tuple(Segment(name, kind, r * once.size, (r + 1) * once.size, r) for r in range(repeats))
    return Stimulus(name, np.tile(once, repeats), segments)


def training() -> tuple[Stimulus, ...]:
    """Return the runs a model may be fitted to: 8.9 s.

    Two step sizes and two hold times; a walk that meets the rails and one that does not; two amplitudes at 10 Hz; one
    sine on the mains frequency and two off its multiples; the last (2 V < d) leaves the gap stuck and moves only what
    bypasses it.
    """
    return (
        staircase("staircase", FIG13_LEVELS_V, 0.08, 2),
        staircase("staircase_0.6", tuple(0.6 * level for level in FIG13_LEVELS_V), 0.03, 2),
        sine("sine_10hz_3.4v", 10.0, 3.4, 2, 4),
        sine("sine_10hz_2.6v", 10.0, 2.6, 2, 4),
        sine("sine_31hz_8v", 31.25, 8.0, 5, 4),
        sine("sine_50hz_9.5v", 50.0, 9.5, 5, 4),
        sine("stuck_62hz_5v", 62.5, 5.0, 8, 4),
    )


def held_out() -> tuple[Stimulus, ...]:
    """Return the runs kept back, 3.6 s: another kind of stimulus and other levels, w within reach of the training."""
    return (
        multisine("multisine", 5.6, 2),
        staircase("staircase_other", HELD_OUT_LEVELS_V, 0.05, 2),
    )
