"""What does noise in front of a gap do to the level on the average? Many benches, each with noise of its own.

``python -m tests.proof.ratchet`` prints, for several sizes and bandwidths of noise, how far the mean of w is from w of
a rig without noise, and how far single rigs scatter about it, both in the noise's own standard deviations.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.signal import lfilter

from tests.proof.integrator import Array, play
from tests.proof.stimuli import FIG13_LEVELS_V, RATE_HZ

HALF_GAP_V = 1.25
FINE = 16  # sub-steps of a sample


@dataclass(frozen=True)
class Noise:
    """Normal noise of ``sd_v``: behind a first-order low-pass of ``bandwidth_hz``, or white up to there."""

    sd_v: float
    bandwidth_hz: float
    low_passed: bool

    def drawn(self, rng: np.random.Generator, steps: int, step_s: float) -> Array:
        """Return the noise at every step of a grid."""
        if not self.low_passed:
            lines = np.fft.rfft(rng.normal(0.0, 1.0, steps))
            kept = np.fft.rfftfreq(steps, step_s) <= self.bandwidth_hz
            return self.sd_v * np.fft.irfft(lines * kept, steps) / np.sqrt(np.mean(kept))
        keep = np.exp(-2.0 * np.pi * self.bandwidth_hz * step_s)
        shocks = rng.normal(0.0, self.sd_v, steps)
        shocks[1:] *= np.sqrt(1.0 - keep * keep)
        return lfilter([1.0], [1.0, -keep], shocks)


@dataclass(frozen=True)
class Ratcheted:
    """v at the samples, the mean of w over many benches of slope 1, its scatter, and w without noise, V, shape (N,)."""

    v: Array
    mean: Array
    scatter: Array
    ideal: Array


def ratcheted(v: Array, noise: Noise, benches: int, seed: int = 0) -> Ratcheted:
    """Return what noise makes of w while v, straight between samples, is played to many benches."""
    rng = np.random.default_rng(seed)
    fine = np.interp(np.arange(v.size * FINE) / FINE, np.arange(v.size), v)
    levels = np.empty((benches, v.size))
    for level in levels:
        shaken = fine + noise.drawn(rng, fine.size, 1.0 / (RATE_HZ * FINE))
        level[:] = play(shaken - HALF_GAP_V, shaken + HALF_GAP_V, 0.0, 1.0, 0.0)[::FINE]
    ideal = play(v - HALF_GAP_V, v + HALF_GAP_V, 0.0, 1.0, 0.0)
    return Ratcheted(v, levels.mean(axis=0), levels.std(axis=0), ideal)


def stairs(dwell_s: float = 0.05, rounding_s: float = 0.005) -> Array:
    """Return v of the staircase of Fig. 13, its steps rounded by a pole."""
    keep = np.exp(-1.0 / (RATE_HZ * rounding_s))
    return lfilter([1.0 - keep], [1.0, -keep], np.repeat(np.asarray(FIG13_LEVELS_V), round(dwell_s * RATE_HZ)))


def waves(frequency_hz: float = 31.25, periods: int = 6, peak_v: float = 2.0) -> Array:
    """Return v of a sine."""
    return peak_v * np.sin(2.0 * np.pi * frequency_hz * np.arange(round(periods * RATE_HZ / frequency_hz)) / RATE_HZ)


def shrunk_v(sd_v: float, advance_v: float, values: int = 40_000) -> float:
    """Return by how much noise shrinks the half-gap while v rises by ``advance_v`` from one value of it to the next."""
    v = advance_v * np.arange(values)
    shaken = v + np.random.default_rng(1).normal(0.0, sd_v, values)
    w = play(shaken - HALF_GAP_V, shaken + HALF_GAP_V, 0.0, 1.0, 0.0)
    return float(np.mean((w - v)[values // 10 :])) + HALF_GAP_V


def main() -> None:
    """Print the table."""
    print("| v | noise | sd [mV] | bandwidth [Hz] | shift of the mean [sd] | scatter [sd] |\n|---|---|---|---|---|---|")
    for (name, v), low_passed in product((("stairs", stairs()), ("sine", waves())), (True, False)):
        for sd_v, bandwidth_hz in product((0.01, 0.05), (100.0, 1000.0, 10_000.0)):
            found = ratcheted(v, Noise(sd_v, bandwidth_hz, low_passed), 50)
            shift, scatter = (np.sqrt(np.mean(a**2)) / sd_v for a in (found.mean - found.ideal, found.scatter))
            kind = "low-passed" if low_passed else "white"
            print(f"| {name} | {kind} | {1e3 * sd_v:g} | {bandwidth_hz:g} | {shift:.2f} | {scatter:.2f} |")


if __name__ == "__main__":
    main()
