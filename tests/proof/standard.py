"""What does a sensible operator play to a rig when any physics may be missing? Seven runs to fit, two kept back.

Every experiment of physics.md that separates one physics from another, scaled to what the rig file says of gap and
corners: two step sizes and two hold times, two amplitudes at one frequency, a faster sine as large as the source
allows, nested minor loops, a sine too small to move the gap, and the first staircase once more at the end.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from tests.proof.integrator import linear_block
from tests.proof.rigs import Rig, Rng, between
from tests.proof.stimuli import (
    FIG13_LEVELS_V,
    HELD_OUT_LEVELS_V,
    MULTISINE_HZ,
    RATE_HZ,
    Stimulus,
    multisine,
    repeated,
    sine,
    staircase,
)

SOURCE_V = 9.9  # what a source of +-10 V gives
LATER_S = 40.0  # before the first staircase is played again
SETTLED = 5.0  # time constants of both blocks in a hold
MAINS_HZ = (50.0, 60.0)
OFF_MAINS_HZ = 1.5  # a sine stays this far from the mains and their doubles
LOOPS = (1.0, 0.72, 0.86, 0.55, 0.65, 0.45)  # sizes of nested loops, larger and smaller in turn


def protocol(rig: Rig, rng: Rng) -> tuple[tuple[Stimulus, ...], tuple[Stimulus, ...]]:
    """Return what is played to a rig: the runs a model may be fitted to, and those kept back."""
    peak_v = min(rig.half_gap_v * between(rng, 1.8, 3.2) + abs(rig.d_l_v + rig.d_u_v) / 2.0, SOURCE_V / 1.2)
    hold_s = float(np.clip(SETTLED * sum(den[-2] for den in (rig.g1_den, rig.g2_den)), 0.05, 0.16))
    slow_hz = 0.5 * corner_hz(rig) * between(rng, 0.8, 2.0)
    stairs = scaled("staircase", FIG13_LEVELS_V, peak_v, hold_s, 2)
    training = (
        stairs,
        scaled("staircase_small", FIG13_LEVELS_V, 0.6 * peak_v, 0.5 * hold_s, 2),
        whole_sine("sine_large", slow_hz, reaching(rig, slow_hz, between(rng, 1.6, 2.4)), 1.0, 2),
        whole_sine("sine_medium", slow_hz, reaching(rig, slow_hz, between(rng, 1.2, 1.45)), 1.0, 2),
        _fast(rig, rng),
        _loops("minor_loops", peak_v, 0.5 * slow_hz),
        _stuck(rig, rng),
        replace(scaled("staircase_again", FIG13_LEVELS_V, peak_v, hold_s, 1), pause_s=LATER_S),
    )
    held_out = (
        _multisine(rig, 0.95 * peak_v, slow_hz),
        scaled("staircase_other", HELD_OUT_LEVELS_V, peak_v, hold_s, 2),
    )
    return training, held_out


def scaled(name: str, levels_v: tuple[float, ...], peak_v: float, dwell_s: float, repeats: int) -> Stimulus:
    """Return a walk of Fig. 13's shape whose highest level is ``peak_v``."""
    return staircase(name, tuple(peak_v / 3.0 * level for level in levels_v), dwell_s, repeats)


def response(rig: Rig, frequency_hz: float) -> float:
    """Return |G1| at a frequency."""
    s = 2j * np.pi * frequency_hz
    return float(abs(np.polyval(rig.g1_num, s) / np.polyval(rig.g1_den, s)))


def corner_hz(rig: Rig) -> float:
    """Return the frequency at which G1 has lost 3 dB or so: that of its slow pole."""
    return float(rig.g1_den[-1] / rig.g1_den[-2] / (2.0 * np.pi))


def reaching(rig: Rig, frequency_hz: float, factor: float) -> float:
    """Return the amplitude of u at which that of v is ``factor`` times half the gap, as far as the source goes."""
    return min(factor * rig.half_gap_v / response(rig, frequency_hz), SOURCE_V)


def whole_sine(name: str, frequency_hz: float, amplitude_v: float, seconds: float, repeats: int) -> Stimulus:
    """Return a sine near a frequency whose stretches of about ``seconds`` are whole samples and whole periods."""
    samples = round(RATE_HZ * seconds)
    periods = max(1, round(frequency_hz * seconds))
    return sine(name, RATE_HZ * periods / samples, amplitude_v, periods, repeats)


def _fast(rig: Rig, rng: Rng) -> Stimulus:
    """Return the sine that opens the gap by a quarter or so at the highest frequency the source allows."""
    factor = between(rng, 1.15, 1.5)
    ladder = np.geomspace(1.2 * corner_hz(rig), 150.0, 60)
    reached = [f for f in ladder if factor * rig.half_gap_v / response(rig, f) <= SOURCE_V]
    frequency_hz = off_mains(float(reached[-1] if reached else ladder[0]) * float(rng.uniform(0.6, 1.0)))
    return whole_sine("sine_fast", frequency_hz, reaching(rig, frequency_hz, factor), 0.8, 2)


def _stuck(rig: Rig, rng: Rng) -> Stimulus:
    """Return a sine that leaves the gap stuck: only what bypasses F moves the reading."""
    frequency_hz = off_mains(corner_hz(rig) * between(rng, 3.0, 7.0))
    return whole_sine("sine_stuck", frequency_hz, reaching(rig, frequency_hz, 0.7), 0.6, 2)


def off_mains(frequency_hz: float) -> float:
    """Return the frequency, moved off the mains and their doubles."""
    for line_hz in (harmonic * mains for harmonic in (1, 2) for mains in MAINS_HZ):
        if abs(frequency_hz - line_hz) < OFF_MAINS_HZ:
            return line_hz + 1.7 * OFF_MAINS_HZ
    return frequency_hz


def _loops(name: str, peak_v: float, rate_hz: float) -> Stimulus:
    """Return nested triangles, one after another and twice: minor loops at one slow speed."""
    quarter = max(20, round(0.25 * RATE_HZ / max(rate_hz, 4.0)))
    turns = [0.0, *(sign * size for size in LOOPS for sign in (1.0, -1.0)), 0.0]
    pieces = [np.linspace(a, b, max(2, round(quarter * abs(b - a))), endpoint=False) for a, b in pairwise(turns)]
    return repeated(name, "minor loops", peak_v * np.concatenate(pieces), 2)


def _multisine(rig: Rig, peak_v: float, slow_hz: float) -> Stimulus:
    """Return a multisine, its lines spread as the rig is slower or faster than the paper's, that takes v to a level.

    The level is one that the runs to be fitted have reached too: a proof asks for no extrapolation.
    """
    spread = max(1, round(slow_hz / 8.0))
    unit = multisine("multisine", 1.0, 2, tuple(spread * f for f in MULTISINE_HZ))
    reached = np.abs(linear_block(unit.u, rig.g1_num, rig.g1_den, 1.0 / RATE_HZ)).max()
    return replace(unit, u=unit.u * min(peak_v / reached, SOURCE_V))
