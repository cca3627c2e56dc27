"""Which waveform of the mains would explain a residual best?"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from identify.chain import local_name
from identify.effects.effect import Effect
from identify.evidence import Evidence
from identify.spectrum import ALIKE, Turning, matched
from identify.trace import Array

RANGE_HZ = 0.5  # from the mains' own frequency: a weak grid, and a DAQ's clock
FINER = 8.0  # steps of the search in one turn that a run's highest line makes less or more


@dataclass(frozen=True)
class Line:
    """One line of a waveform: which multiple of its frequency, and the short names of its size and its angle."""

    order: int
    size: str
    angle: str


class Mains:
    """The lines of a waveform near 50 or 60 Hz, added where ``hum`` sits, as a residual has them.

    What a line makes of the answer is looked at once, at the mains' own frequency: behind the gap it is no line, as
    the gap passes it on one way here, the other way there. Off that frequency it turns as the line does.
    """

    def __init__(self, evidence: Evidence, hum: Effect, waveform: Sequence[Line], mains_hz: float) -> None:
        """Take the residual; nothing is computed yet."""
        self.evidence = evidence
        self.hum = hum
        self.waveform = tuple(waveform)
        self.mains_hz = mains_hz
        self.orders = np.array([line.order for line in waveform])

    @cached_property
    def frequency_hz(self) -> float:
        """Return the frequency near the mains' own at which the lines explain most of the residual, Hz.

        No slope leads there from where the lines would gain or lose a turn in a run: 0.05 Hz off, in 20 s.
        """
        return self.mains_hz + float(np.linspace(-RANGE_HZ, RANGE_HZ, self._told.size)[np.argmax(self._told)])

    @property
    def told(self) -> float:
        """Return how much of chi-squared the lines explain, each in every run, where they explain most."""
        return float(np.max(self._told))

    def values(self) -> dict[str, float]:
        """Return the waveform that explains the residual best, by short names.

        Every run gives a complex amplitude per line; the angle of the first is the run's own phase, and the angles of
        the others against it are averaged over the runs.
        """
        found = {"frequency": self.frequency_hz, "phase": 0.0}
        multiples = self.orders / self.orders[0]
        shape, weights = np.zeros(self.orders.size, dtype=np.complex128), np.zeros(self.orders.size)
        for (run, part), time_s in zip(self.evidence.parts(), self._times_s, strict=True):
            turns = np.exp(2j * np.pi * np.outer(self.orders * (self.frequency_hz - self.mains_hz), time_s))
            turned = self._answers[:, part] * turns
            rows = np.stack([turned.imag, turned.real], axis=1).reshape(-1, time_s.size)
            matrix = rows @ rows.T
            pairs = np.linalg.pinv(matrix, hermitian=True, rcond=ALIKE) @ rows @ self.evidence.residual[part]
            lines = pairs[::2] + 1j * pairs[1::2]
            angle, weight = float(np.angle(lines[0])), np.diag(matrix)[::2]
            found[local_name("phase", run)] = angle / self.orders[0]
            shape += weight * lines * np.exp(-1j * angle * multiples)
            weights += weight
        shape /= np.maximum(weights, 1e-300)
        for number, line in enumerate(self.waveform):
            found[line.size] = float(np.abs(shape[number]))
            if number:
                found[line.angle] = float(np.angle(shape[number]))
        return found

    @cached_property
    def _answers(self) -> Turning:
        """Return what a volt of every line makes of the answer, in units of the noise: cosine + j sine, (lines, n)."""
        return np.array([self._answer(line, 0.5 * np.pi) + 1j * self._answer(line, 0.0) for line in self.waveform])

    def _answer(self, line: Line, turn: float) -> Array:
        """Return the change of the answer per volt of one line, as a sine (turn 0) or a cosine (turn pi / 2)."""
        size = 0.3 * self.evidence.observations[0].noise_v
        angle = turn / (line.order if line.angle == "phase" else 1)
        values = {"frequency": self.mains_hz, line.size: size, line.angle: angle}
        return np.asarray(self.evidence.change(self.hum.put_in(self.evidence.chain, values)) / size)

    @cached_property
    def _times_s(self) -> list[Array]:
        """Return when the samples of every run that count were taken, s from its start."""
        return [np.asarray(np.flatnonzero(o.use) * self.evidence.sample_s) for o in self.evidence.observations]

    @cached_property
    def _told(self) -> Array:
        """Return what the lines explain at frequencies from RANGE_HZ below the mains' own to as much above.

        Lines of which there are fewer than two samples in a turn do not count: they look like others.
        """
        told = np.zeros(2 * int(np.ceil(FINER * RANGE_HZ * self.evidence.longest_s * self.orders.max())) + 1)
        seen = self.orders * (self.mains_hz + RANGE_HZ) < 0.5 / self.evidence.sample_s
        orders, residual, sample_s = self.orders[seen], self.evidence.residual, self.evidence.sample_s
        for (_, part), o in zip(self.evidence.parts(), self.evidence.observations, strict=True):
            lines = self._answers[seen][:, part]
            told += matched(residual[part], lines, orders, o.use, sample_s, RANGE_HZ, told.size)
        return told
