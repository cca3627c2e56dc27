"""Which cables do the tests look at? Followed from change to change in time, which shares nothing with the taps."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.calibration import Pass

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Wire:
    """A cable and the converters at its ends; times in s, levels in V. ``skew`` is by how much the delay grows, s/s."""

    delay_s: float = 0.0
    constant_s: float = 0.0
    gain: float = 1.0
    offset_v: float = 0.0
    noise_v: float = 1e-3
    step_v: float = 0.0
    skew: float = 0.0
    second_s: float = 0.0

    def passed(self, rate_hz: float, size: int, seed: int) -> Pass:
        """Return one run of random levels over the cable."""
        random = np.random.default_rng(seed)
        u = np.repeat(random.uniform(-5.0, 5.0, size), random.integers(1, 6, size))[:size]
        y = self.offset_v + self.gain * self._arrived(u, rate_hz) + self.noise_v * random.standard_normal(size)
        return Pass(u, np.rint(y / self.step_v) * self.step_v if self.step_v else y, rate_hz)

    def passes(self, rate_hz: float = 10_000.0, count: int = 8, size: int = 2000, seed: int = 0) -> list[Pass]:
        return [self.passed(rate_hz, size, 1000 * seed + index) for index in range(count)]

    def _arrived(self, u: Array, rate_hz: float) -> Array:
        """Return what has arrived at every reading: each level is approached from where the last had led."""
        reads = np.arange(u.size) / rate_hz
        arrives = reads + self.delay_s + self.skew * reads
        state, second, y, at, level, last = 0.0, 0.0, np.zeros(u.size), 0, 0.0, -1.0
        for k, t in enumerate(reads):
            while at < u.size and arrives[at] < t:
                state, second = self._moved(state, second, level, arrives[at] - last)
                last, level, at = arrives[at], float(u[at]), at + 1
            state, second = self._moved(state, second, level, t - last)
            last, y[k] = t, second if self.second_s else state
        return y

    def _moved(self, state: float, second: float, level: float, span_s: float) -> tuple[float, float]:
        """Return both capacitors' voltages after ``span_s`` at one level, the second fed by the first."""
        if not self.constant_s:
            return level, level
        one = np.exp(-span_s / self.constant_s)
        if not self.second_s:
            return level + (state - level) * one, second
        two = np.exp(-span_s / self.second_s)
        share = self.constant_s / (self.constant_s - self.second_s)
        return level + (state - level) * one, level + (second - level) * two + share * (state - level) * (one - two)
