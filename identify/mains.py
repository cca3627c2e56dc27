"""Which waveform of the mains would explain a residual best?"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from identify.chain import local_name
from identify.effects.effect import Effect
from identify.evidence import Evidence
from identify.trace import Array

RANGE_HZ = 0.5  # from the mains' own frequency: a weak grid, and a DAQ's clock
BESIDE_HZ = 10.0  # from a line: what is as strong there is no line
BY_CHANCE = 1e-3  # probability at which noise would stand out so
FINER = 8.0  # steps of the search in one turn that a run's highest line makes less or more


@dataclass(frozen=True)
class Line:
    """One line of a waveform: which multiple of its frequency, and the short names of its size and its angle."""

    order: int
    size: str
    angle: str


def frequency_near(evidence: Evidence, mains_hz: float, waveform: Sequence[Line]) -> float:
    """Return the frequency near the mains' own at which the lines of a waveform explain most of the residual, Hz.

    No slope leads there from where the lines would gain or lose a turn in a run: 0.05 Hz off, in 20 s.
    """
    longest_s = max(o.trace.size for o in evidence.observations) * evidence.sample_s
    orders = np.array([line.order for line in waveform])
    half = int(np.ceil(FINER * RANGE_HZ * longest_s * orders.max()))
    tried = mains_hz + RANGE_HZ * np.arange(-half, half + 1) / max(half, 1)
    told = sum((spectrum.at(np.outer(orders, tried)).sum(0) for spectrum in evidence.spectra), np.zeros(tried.size))
    return float(tried[np.argmax(told)])


def stands_out(evidence: Evidence, frequency_hz: float, waveform: Sequence[Line], freedom: int) -> bool:
    """Return whether lines at a frequency stand out of what the residual has beside them.

    Noise that hangs together, as what the gap makes of noise in front of it, has as much there as at the mains.
    ``freedom`` is how many numbers noise alone could use.
    """
    told = 0.0
    for spectrum in evidence.spectra:
        for line in waveform:
            at_hz = line.order * frequency_hz
            there, beside = spectrum.at(np.array([at_hz]))[0], spectrum.median(at_hz - BESIDE_HZ, at_hz + BESIDE_HZ)
            told += there * chi2.median(2) / beside if beside > 0.0 else 0.0
    return bool(chi2.sf(told, freedom) < BY_CHANCE)


def mains_lines(evidence: Evidence, hum: Effect, frequency_hz: float, waveform: Sequence[Line]) -> dict[str, float]:
    """Return the waveform of the mains, added where ``hum`` sits, that explains the residual best, by short names.

    Every run gives a complex amplitude per line; the angle of the first is the run's own phase, and the angles of
    the others against it are averaged over the runs.
    """
    columns = [_line(evidence, hum, frequency_hz, line, turn) for line in waveform for turn in (0.0, 0.5 * np.pi)]
    found = {"frequency": frequency_hz, "phase": 0.0}
    multiples = np.array([line.order / waveform[0].order for line in waveform])
    shape, weights = np.zeros(len(waveform), dtype=np.complex128), np.zeros(len(waveform))
    for run, part in evidence.parts():
        rows = np.array([column[part] for column in columns])
        matrix = rows @ rows.T
        pairs = np.linalg.pinv(matrix, hermitian=True, rcond=1e-6) @ rows @ evidence.residual[part]
        lines = pairs[::2] + 1j * pairs[1::2]
        angle, weight = float(np.angle(lines[0])), np.diag(matrix)[::2]
        found[local_name("phase", run)] = angle / waveform[0].order
        shape += weight * lines * np.exp(-1j * angle * multiples)
        weights += weight
    shape /= np.maximum(weights, 1e-300)
    for number, line in enumerate(waveform):
        found[line.size] = float(np.abs(shape[number]))
        if number:
            found[line.angle] = float(np.angle(shape[number]))
    return found


def _line(evidence: Evidence, hum: Effect, frequency_hz: float, line: Line, turn: float) -> Array:
    """Return the change of the answer per volt of one line, as a sine (turn 0) or a cosine (turn pi / 2)."""
    size = 0.3 * evidence.observations[0].noise_v
    angle = turn / (line.order if line.angle == "phase" else 1)
    values = {"frequency": frequency_hz, line.size: size, line.angle: angle}
    return np.asarray(evidence.change(hum.put_in(evidence.chain, values)) / size)
