"""At which frequency does a line go on that no repeat of a stimulus brings back, and may chance have made it?

What hangs on the stimulus makes lines, too, but falls out of what repeats differ by. What wanders makes none: of noise
the height of a periodogram over what it is around there is drawn from an exponential distribution of mean 1.
"""

from collections.abc import Iterator, Sequence
from math import log

import numpy as np
from scipy.fft import next_fast_len, rfft
from scipy.ndimage import median_filter
from scipy.stats import gamma

from identify.chain import Chain
from identify.explain.wander import compared, whitened
from identify.observe import Observation
from identify.trace import Array, Mask

PADDED = 8  # zeros to as many times the length: a peak is at one of the frequencies
AROUND = 61  # frequencies over which the height is compared
ENDS = 8  # frequencies at either end that are no line: a drift, and what alternates
ENOUGH = 64  # readings that count in both, at least
TALL = 20.0  # height from which one repeat tells no more: no single one decides
LINE = 1e-3  # probability of chance, below which there is a line
NO_CHANCE = 1e-6  # the same, below which chance has not made it


def line_anew(chain: Chain, observations: Sequence[Observation]) -> tuple[float, float]:
    """Return the frequency, Hz, at which what repeats differ by stands out most, and how likely chance alone made it.

    All repeats are asked together. (0, 1) where nothing was repeated that a chain answers alike.
    """
    found = [height for o in observations for height in _of_repeats(chain, o)]
    if not found:
        return 0.0, 1.0
    turns, each = asked_together(found)
    at = int(np.argmax(np.sum(np.log1p(each), axis=0)))
    total = float(np.sum(np.minimum(each[:, at], TALL)))
    chance = float(gamma.sf(total, len(found))) * 2 * turns.size / PADDED
    return float(turns[at]) * observations[0].trace.rate_hz, min(chance, 1.0)


def asked_together(found: Sequence[Array]) -> tuple[Array, Array]:
    """Return frequencies in turns a sample, and there the heights of periodograms of any lengths, shape (all, m)."""
    turns = np.linspace(0.0, 0.5, max(height.size for height in found))
    return turns, np.array([np.interp(turns, np.linspace(0.0, 0.5, height.size), height) for height in found])


def goes_on(chain: Chain, observations: Sequence[Observation]) -> bool:
    """Return whether repeats differ by a line that chance has not made."""
    return line_anew(chain, observations)[1] < NO_CHANCE


def _of_repeats(chain: Chain, observation: Observation) -> Iterator[Array]:
    """Yield the heights of what two repeats of a run differ by, each repeat in one pair, shape (frequencies,)."""
    residual = observation.residual(chain)
    white, taken = whitened(observation, residual), set[int]()
    for once, again, both in compared(observation, residual):
        if once.start not in taken and np.count_nonzero(both) > ENOUGH:
            taken.add(again.start)
            yield heights(white[once] - white[again], both)


def periodogram(signal: Array, use: Mask) -> Array:
    """Return the square of what counts of a signal turns at every frequency, per reading, shape (frequencies,)."""
    size = PADDED * next_fast_len(signal.size, real=True)
    return np.asarray(np.square(np.abs(rfft(np.where(use, signal, 0.0) * np.hanning(signal.size), size))) / signal.size)


def heights(signal: Array, use: Mask) -> Array:
    """Return the periodogram of what counts of a signal over what it is around, shape (frequencies,)."""
    return standing_out(periodogram(signal, use))


def standing_out(power: Array) -> Array:
    """Return a periodogram over what it is around at every frequency, shape (frequencies,); zero at either end."""
    around = median_filter(power[::PADDED], AROUND, mode="mirror") / log(2.0)
    height = power / np.maximum(np.interp(np.arange(power.size), PADDED * np.arange(around.size), around), 1e-300)
    height[: ENDS * PADDED] = 0.0
    height[-ENDS * PADDED :] = 0.0
    return height
