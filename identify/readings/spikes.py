"""Which single readings were thrown off: how often, and how far?

A spike is one reading far from those beside it, at a moment of its own: not at a jump of the stimulus, not at the same
place of every repeat, not where the model fails for many readings in a row, and not the more often the faster the
readings move: those are the tail of a scatter in time. How many readings of noise alone would lie so far out is known,
so the number beyond a threshold is a Poisson test; several thresholds are paid for.
"""

from collections.abc import Sequence
from typing import ClassVar, final

import numpy as np
from scipy.stats import norm

from identify.effects.effect import Confusion
from identify.interval import Interval
from identify.readings.blemish import Blemish
from identify.readings.outliers import FAR_ABOVE, SCATTER, FarOut, Outliers, contradicted, poisson_rate
from identify.stage import Parameter
from identify.trace import Array, Mask

ALONE = 1.0  # sd that spikes may be smaller than the threshold: else they are the tail of something else
OFTEN = 0.1  # of all readings, that spikes are at most, those beneath the threshold too: a reading has others beside it
LEANT = 0.076  # sd by which a Gaussian reading far off draws the median of the 17 it is among along, by simulation


@final
class Spikes(Blemish):
    """Single readings thrown off by about the same size, upwards or downwards."""

    id = "spikes"
    title = "spikes"
    equation = "y' = y + s size at moments of a Poisson process of the rate, s = +1 or -1"
    sentence = (
        "Single readings are thrown off: {}. Something switches nearby, or a digit is lost on the line; look for a "
        "relay, a loose contact, a cable without a shield. They are left out of the fit."
    )
    axis = "clock time"
    fingerprint = "isolated outliers"
    declared: ClassVar = (Parameter("spikes.rate", "1/s", "log"), Parameter("spikes.size", "V", "log"))
    confused_with: ClassVar = (
        Confusion("coloured_noise", "a longer recording: spikes last one reading each, and the next is as good as any"),
    )


def spikes(seen: FarOut | None, proof: Sequence[Outliers]) -> tuple[tuple[Spikes, ...], float]:
    """Return the spikes among readings that lie far out, and the threshold in sd from which one is left out.

    That is infinite where there are none. ``seen`` are of the training recordings; nothing is reported where the
    held-out ones show far fewer than they should.
    """
    if seen is None or seen.by_motion:
        return (), float("inf")
    kept = _above_tail(seen.sizes_v / seen.sd_v, seen.threshold)
    sizes, noise = (each[kept] / seen.sd_v for each in (seen.sizes_v, seen.noise_v))
    seen_of, size, size_sd = _fitted(sizes, noise, seen.threshold)
    if size < seen.threshold - ALONE or seen_of > OFTEN * seen.count:
        return (), float("inf")
    expected = sizes.size / seen.count
    if contradicted(proof, seen.threshold, expected):
        return (), float("inf")
    sd_v = seen.sd_v
    values = {
        "rate": poisson_rate(sizes.size, seen_of / sizes.size / seen.span_s),
        "size": Interval(sd_v * size, sd_v * (size - 1.96 * size_sd), sd_v * (size + 1.96 * size_sd)),
    }
    return (Spikes(values, seen.p_value, seen.where(sizes.size, proof)),), seen.threshold


def _above_tail(sizes: Array, threshold: float) -> Mask:
    """Return which sizes, in sd, are none that the tail of the noise adds to spikes which stand far above it."""
    typical = float(np.median(sizes))
    return np.asarray(sizes > (0.5 * typical if typical > FAR_ABOVE * threshold else 0.0))


def _beneath(size: Array, noise: Array, threshold: float) -> Array:
    """Return by how many sd the noise must raise spikes of a size for them to lie beyond a threshold, noise added."""
    return np.asarray((threshold + LEANT - size / noise) / SCATTER)


def _fitted(sizes: Array, noise: Array, threshold: float) -> tuple[float, float, float]:
    """Return how many spikes there are in all, their size and its standard error, in sd of the noise.

    Maximum likelihood for one size in Gaussian ``noise``, of each where it lies, of which only what lies beyond the
    threshold is seen; where sizes scatter more than that, their rms.
    """
    sizes = sizes + LEANT * noise
    weights = 1.0 / np.square(noise)
    scatter = float(np.std((sizes - np.average(sizes, weights=weights)) / noise))
    if sizes.size > 2 and scatter > 2.0:
        size = float(np.sqrt(np.mean(np.square(sizes))))
        return float(sizes.size), size, float(np.std(np.square(sizes))) / (2.0 * size * np.sqrt(sizes.size))
    grid = np.linspace(max(threshold - 3.0, 0.5), float(np.max(sizes)) + 1.0, 2000)
    levels, count = np.unique(np.round(noise, 3), return_counts=True)
    squares = np.sum(weights) * np.square(grid) - 2.0 * grid * np.sum(weights * sizes)
    seen = sum(n * norm.logsf(_beneath(grid, level, threshold)) for level, n in zip(levels, count, strict=True))
    likelihood = -0.5 * squares / SCATTER**2 - seen
    size = float(grid[np.argmax(likelihood)])
    inside = grid[likelihood > np.max(likelihood) - 0.5]
    sd = max(0.5 * float(np.ptp(inside)), SCATTER / float(np.sqrt(np.sum(weights))))
    return float(np.sum(1.0 / norm.sf(_beneath(np.asarray(size), noise, threshold)))), size, sd
