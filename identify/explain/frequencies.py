"""At which frequency, free of the stimulus, would a line explain most: added, on the gain, the delay or the gap?"""

from collections.abc import Sequence

import numpy as np
from scipy.fft import next_fast_len, rfft

from identify.chain import Chain, signals, simulate
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
    chain, runs = evidence.chain, evidence.observations
    asked = [asked_of_v(chain, o) if place is Place.G1 else o.masked_residual(chain) for o in runs]
    return _followed_hz(evidence, asked, [_signal(o, chain, place) for o in runs])


def flutter_hz(evidence: Evidence) -> float:
    """Return the frequency at which the residual follows the rate of the answer in most runs, Hz, zero excluded."""
    chain, runs = evidence.chain, evidence.observations
    left = [o.masked_residual(chain) for o in runs]
    return _followed_hz(evidence, left, [np.gradient(simulate(chain, o.trace)) for o in runs])


def _followed_hz(evidence: Evidence, asked: Sequence[Array], followed: Sequence[Array]) -> float:
    """Return the frequency at which what is asked of every run follows a signal in most, Hz, zero excluded."""
    spectra = [_followed(evidence, *pair) for pair in zip(asked, followed, strict=True)]
    lines = max((hz for hz, _ in spectra), key=len)
    told = sum(np.interp(lines, hz, height) for hz, height in spectra)
    return float(lines[np.argmax(told)])


def _followed(evidence: Evidence, asked: Array, signal: Array) -> tuple[Array, Array]:
    """Return frequencies, Hz, and the log of how far what is asked times the signal stands out of the median there."""
    product = asked * (signal - np.mean(signal))
    size = next_fast_len(PADDED * product.size, real=True)
    spectrum = np.abs(rfft((product - np.mean(product)) * np.hanning(product.size), size))
    spectrum[: PADDED * PADDED] = 0.0
    height = np.log1p(spectrum / (float(np.median(spectrum)) or 1.0))
    return np.arange(spectrum.size) / (size * evidence.sample_s), height


def _signal(observation: Observation, chain: Chain, place: Place) -> Array:
    """Return the signal at the source, at the sense or behind G1, or the branch that F is on, +-1."""
    if place in (Place.SOURCE, Place.SENSE):
        return (observation.trace.u if place == Place.SOURCE else observation.trace.y)[:]
    behind = signals(chain, observation.trace)[chain.index(place) - 1]
    return np.sign(np.diff(behind, prepend=behind[:1])) if place == Place.F else behind
