"""Which waveform of the mains would explain a residual best?"""

from collections.abc import Sequence

import numpy as np

from identify.chain import local_name
from identify.effects.effect import Effect
from identify.evidence import Evidence
from identify.trace import Array

LINES = {"amplitude": "phase", "third": "third_phase", "fifth": "fifth_phase"}


def mains_lines(evidence: Evidence, hum: Effect, mains_hz: float, harmonics: Sequence[int]) -> dict[str, float]:
    """Return the waveform of the mains, added where ``hum`` sits, that explains the residual best, by short names.

    Every run gives a complex amplitude per line; the fundamental's angle is the run's own phase, and the angles of
    the others against it are averaged over the runs.
    """
    columns = [_line(evidence, hum, mains_hz, name, turn) for name in LINES for turn in (0.0, 0.5 * np.pi)]
    found = {"frequency": mains_hz, "phase": 0.0}
    shape, weights = np.zeros(len(harmonics), dtype=np.complex128), np.zeros(len(harmonics))
    for run, part in evidence.parts():
        rows = np.array([column[part] for column in columns])
        matrix = rows @ rows.T
        pairs = np.linalg.pinv(matrix, hermitian=True, rcond=1e-6) @ rows @ evidence.residual[part]
        lines = pairs[::2] + 1j * pairs[1::2]
        phase, weight = float(np.angle(lines[0])), np.diag(matrix)[::2]
        found[local_name("phase", run)] = phase
        shape += weight * lines * np.exp(-1j * phase * np.asarray(harmonics))
        weights += weight
    shape /= np.maximum(weights, 1e-300)
    found |= dict(zip(LINES, np.abs(shape).tolist(), strict=True))
    return found | {"third_phase": float(np.angle(shape[1])), "fifth_phase": float(np.angle(shape[2]))}


def _line(evidence: Evidence, hum: Effect, mains_hz: float, name: str, turn: float) -> Array:
    """Return the change of the answer per volt of one line, as a sine (turn 0) or a cosine (turn pi / 2)."""
    size = 0.3 * evidence.observations[0].noise_v
    values = {"frequency": mains_hz, name: size, LINES[name]: turn}
    return np.asarray(evidence.change(hum.put_in(evidence.chain, values)) / size)
