"""What are gain and phase of a fitted linear block at the frequencies that were played, and how sure are they?"""

import math
from collections.abc import Sequence

import numpy as np

from identify.blocks import LinearBlock
from identify.chain import Chain
from identify.delay import delay_s
from identify.fit import DIFFERENCE, Fit
from identify.identification import FrequencyPoint
from identify.interval import Interval
from identify.noise import period_of, stretches
from identify.observe import Observation
from identify.trace import Array, part

MOST = 24  # frequencies reported
POWERFUL = 0.01  # share of the largest line above which a line of u counts as played


def played_hz(observations: Sequence[Observation], corner_hz: float) -> tuple[float, ...]:
    """Return the frequencies of periodic stimuli, Hz; a spread around ``corner_hz`` when none is periodic."""
    found: set[float] = set()
    for observation in observations:
        trace = observation.trace
        for start, stop in stretches(trace):
            u = part(trace.u, start, stop)
            period = period_of(u)
            if period and np.unique(u[:period]).size > 16:
                found |= set(np.round(_lines_hz(u[:period], trace.rate_hz), 6).tolist())
    if found:
        return tuple(sorted(found)[:MOST])
    return tuple(np.geomspace(0.1 * corner_hz, 10.0 * corner_hz, 9).tolist())


def _lines_hz(u: Array, rate_hz: float) -> Array:
    """Return the frequencies of the strong lines of one period."""
    spectrum = np.abs(np.fft.rfft(u - np.mean(u)))
    strong = np.flatnonzero(spectrum > POWERFUL * np.max(spectrum))
    return np.asarray(strong * rate_hz / u.size)


def points(
    fitted: Fit, block: LinearBlock, frequencies_hz: Sequence[float], inflation: float
) -> tuple[FrequencyPoint, ...]:
    """Return gain (V/V) and phase (rad) of a block with 95 % intervals from the fit's covariance (delta method)."""
    s = 2j * np.pi * np.asarray(frequencies_hz)
    centre = _log_response(fitted.chain, block, s)
    slopes = np.zeros((len(fitted.coordinates), s.size), dtype=np.complex128)
    for i, c in enumerate(fitted.coordinates):
        moved = fitted.chain.with_values({c.name: c.value(float(fitted.theta[i]) + DIFFERENCE)})
        slopes[i] = (_log_response(moved, block, s) - centre) / DIFFERENCE
    found = []
    for k, f in enumerate(frequencies_hz):
        parts = (slopes[:, k].real, slopes[:, k].imag)
        half = [1.96 * inflation * math.sqrt(max(float(part @ fitted.covariance @ part), 0.0)) for part in parts]
        gain, phase = float(np.exp(centre[k].real)), float(centre[k].imag)
        spread = Interval(gain, gain * float(np.exp(-half[0])), gain * float(np.exp(half[0])))
        found.append(FrequencyPoint(float(f), spread, Interval(phase, phase - half[1], phase + half[1])))
    return tuple(found)


def _log_response(chain: Chain, block: LinearBlock, s: np.ndarray) -> np.ndarray:
    """Return log G(s): log gain and continuous phase; all dead time counts for G2, where it is reported."""
    fitted = block.rational(tuple(chain.values[p.name] for p in block.parameters()))
    zeros, poles = np.roots(fitted.num), np.roots(fitted.den)
    scale = np.log(abs(fitted.dc_gain) + 0j) + (1j * np.pi if fitted.dc_gain < 0.0 else 0.0)
    value = scale + sum((np.log(1.0 - s / z) for z in zeros), np.zeros(s.size, dtype=np.complex128))
    value = value - sum((np.log(1.0 - s / p) for p in poles), np.zeros(s.size, dtype=np.complex128))
    return np.asarray(value - s * (delay_s(chain) if block.name == "G2" else 0.0))
