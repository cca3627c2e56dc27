"""What are gain and phase of a fitted linear block at the frequencies that were played, and how sure are they?"""

from collections.abc import Callable, Sequence

import numpy as np

from identify.blocks import LinearBlock
from identify.chain import Chain
from identify.delay import delay_s
from identify.fit import Fit
from identify.identification import FrequencyPoint
from identify.noise import period_of, stretches
from identify.observe import Observation
from identify.trace import Array, part
from identify.uncertainty.propagation import propagated

MOST = 24  # frequencies reported
HARMONICS = 5  # of a played frequency at which G2 is told, as in the paper's Table 5
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
                found |= {float(f"{f:.7g}") for f in _lines_hz(u[:period], trace.rate_hz)}
    if found:
        return tuple(sorted(found)[:MOST])
    return tuple(np.geomspace(0.1 * corner_hz, 10.0 * corner_hz, 9).tolist())


def harmonics_hz(played: Sequence[float], observations: Sequence[Observation]) -> tuple[float, ...]:
    """Return the played frequencies and what F makes of them, up to the fifth harmonic below half the slowest rate."""
    highest = 0.5 * min(o.trace.rate_hz for o in observations)
    found = {float(f"{k * f:.6g}") for f in played for k in range(1, HARMONICS + 1) if k == 1 or k * f < highest}
    return tuple(sorted(found)) if len(found) <= MOST else tuple(played)


def _lines_hz(u: Array, rate_hz: float) -> Array:
    """Return the frequencies of the strong lines of one period."""
    spectrum = np.abs(np.fft.rfft(u - np.mean(u)))
    strong = np.flatnonzero(spectrum > POWERFUL * np.max(spectrum))
    return np.asarray(strong * rate_hz / u.size)


def points(
    fitted: Fit, block: LinearBlock, frequencies_hz: Sequence[float], inflation: float,
    unit: Callable[[Chain], float] | None = None,
) -> tuple[FrequencyPoint, ...]:  # fmt: skip
    """Return gain and phase (rad) of a block with 95 % intervals from the fit's covariance (delta method).

    The gain is told over ``unit``, the gain that counts as one; in V/V when there is none.
    """
    s = 2j * np.pi * np.asarray(frequencies_hz)

    def law(chain: Chain) -> Array:
        one = unit(chain) if unit else 1.0
        value = _log_response(chain, block, s) - np.log(abs(one)) - (1j * np.pi if one < 0.0 else 0.0)
        return np.concatenate((value.real, value.imag))

    found = propagated(fitted, law)
    gains, phases = found.intervals(inflation, "log")[: s.size], found.intervals(inflation)[s.size :]
    rows = zip(frequencies_hz, gains, phases, strict=True)
    return tuple(FrequencyPoint(float(f), gain, phase) for f, gain, phase in rows)


def _log_response(chain: Chain, block: LinearBlock, s: np.ndarray) -> np.ndarray:
    """Return log G(s): log gain and continuous phase; all dead time counts for G2, where it is reported."""
    fitted = block.fitted(chain.values)
    zeros, poles = np.roots(fitted.num), np.roots(fitted.den)
    scale = np.log(abs(fitted.dc_gain) + 0j) + (1j * np.pi if fitted.dc_gain < 0.0 else 0.0)
    value = scale + sum((np.log(1.0 - s / z) for z in zeros), np.zeros(s.size, dtype=np.complex128))
    value = value - sum((np.log(1.0 - s / p) for p in poles), np.zeros(s.size, dtype=np.complex128))
    return np.asarray(value - s * (delay_s(chain) if block.name == "G2" else 0.0))
