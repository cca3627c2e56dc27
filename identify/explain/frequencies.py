"""At which frequency, free of the stimulus, would a line explain most: added, on the gain, the delay or the gap?"""

from collections.abc import Sequence
from functools import partial

import numpy as np
from scipy.fft import next_fast_len, rfft

from identify.chain import signals, simulate
from identify.evidence import Evidence
from identify.explain.anew import LINE, line_anew
from identify.explain.in_front import asked_of_v, lines_in_front
from identify.observe import Observation
from identify.stage import Place
from identify.trace import Array

LINES = 4  # frequencies at which a line in front of the gap is tried
PADDED = 8  # times the length of a run, with zeros: places a peak between bins


def line_hz(evidence: Evidence) -> float:
    """Return the frequency of a line that no repeat brings back, Hz, or else that of the longest run's highest peak."""
    hz, chance = line_anew(evidence.chain, evidence.observations)
    return hz if chance < LINE else evidence.strongest_line_hz


def in_front_hz(evidence: Evidence) -> tuple[float, ...]:
    """Return the likeliest frequencies of a line in front of the gap, Hz.

    Several: at turns few instants tell of v, and a line elsewhere explains nearly as much.
    """
    return lines_in_front(evidence.chain, evidence.fine.observations, LINES)


def ripple_hz(evidence: Evidence, place: Place) -> float:
    """Return the frequency at which the residual follows the signal at a place in most runs, Hz, zero excluded.

    At F that signal is the branch: a gap that widens puts one border down and the other up. At G1 it is v, followed by
    what the residual asks of it. What hangs on the stimulus makes lines, too, but in every run others: the runs are
    asked together.
    """
    residual = partial(asked_of_v, evidence.chain) if place is Place.G1 else partial(_residual, evidence)
    return _followed_hz(evidence, [(residual(o), _signal(o, evidence, place)) for o in evidence.observations])


def flutter_hz(evidence: Evidence) -> float:
    """Return the frequency at which the residual follows the rate of the answer in most runs, Hz, zero excluded."""
    chain, runs = evidence.chain, evidence.observations
    return _followed_hz(evidence, [(_residual(evidence, o), np.gradient(simulate(chain, o.trace))) for o in runs])


def _residual(evidence: Evidence, observation: Observation) -> Array:
    """Return the residual of a run, V, zero where it is not used."""
    return np.where(observation.use, observation.residual(evidence.chain), 0.0)


def _followed_hz(evidence: Evidence, runs: Sequence[tuple[Array, Array]]) -> float:
    """Return the frequency at which the first of two signals follows the second in most runs, Hz, zero excluded."""
    spectra = [_followed(evidence, residual, signal) for residual, signal in runs]
    lines = max((hz for hz, _ in spectra), key=len)
    told = sum(np.interp(lines, hz, height) for hz, height in spectra)
    return float(lines[np.argmax(told)])


def _followed(evidence: Evidence, residual: Array, signal: Array) -> tuple[Array, Array]:
    """Return frequencies, Hz, and the log of how far the residual times the signal stands out of the median there."""
    product = residual * (signal - np.mean(signal))
    size = next_fast_len(PADDED * product.size, real=True)
    spectrum = np.abs(rfft((product - np.mean(product)) * np.hanning(product.size), size))
    spectrum[: PADDED * PADDED] = 0.0
    height = np.log1p(spectrum / (float(np.median(spectrum)) or 1.0))
    return np.arange(spectrum.size) / (size * evidence.sample_s), height


def _signal(observation: Observation, evidence: Evidence, place: Place) -> Array:
    """Return the signal at the source, at the sense or behind G1, or the branch that F is on, +-1."""
    if place == Place.F:
        w = signals(evidence.chain, observation.trace)[evidence.chain.index(Place.F) - 1]
        return np.sign(np.diff(w, prepend=w[:1]))
    behind = evidence.chain.index(Place.G1)
    if place == Place.G1 and behind:
        return signals(evidence.chain, observation.trace)[behind - 1]
    return (observation.trace.y if place == Place.SENSE else observation.trace.u)[:]
