"""Which poles can a sample rate show, and which lie beyond it?

After an edge a pole leaves y off its end by exp(-t/tau); per log tau that moves a reading by (t/tau) exp(-t/tau). With
white noise the readings at T, 2T ... tell sum_k (kx)^2 exp(-2kx), x = T/tau, where ever faster ones would tell 1/(4x):
the ratio is the share of what an edge tells of the pole at a given number of readings a second.
"""

from collections.abc import Iterator
from math import exp, floor, log10, pi

import numpy as np

from identify.model import Model, Rational
from identify.natural_units import shown

SAMPLES = 100  # readings to a period of the fastest corner that matters
WIDE = 100.0  # corners further than this above the slowest are seen as delays only
LOST = 0.1  # share of a pole's information from which more samples are worth it


def share_kept(pole: complex, rate_hz: float) -> float:
    """Return the share of what an edge tells of a pole (rad/s) that readings at ``rate_hz`` keep."""
    x = abs(pole) / rate_hz
    if x > 300.0:
        return 0.0
    q = exp(-2.0 * x)
    return min(4.0 * x**3 * q * (1.0 + q) / (1.0 - q) ** 3, 1.0)


def sampling_advice(name: str, block: Rational, rate_hz: float) -> Iterator[str]:
    """Yield a sentence on every pole of a block of which the sample rate shows little or nothing."""
    for pole in sorted({complex(p.real, abs(p.imag)) for p in np.roots(block.den)}, key=abs):
        at_hz, lost = abs(pole) / (2.0 * pi), 1.0 - share_kept(pole, rate_hz)
        where = f"{name}: the pole at {shown(at_hz, 'Hz', 3)}"
        if at_hz > 0.5 * rate_hz:
            delay = shown(1.0 / abs(pole), "s", 2)
            yield (
                f"{where} lies above half the sample rate of {shown(rate_hz, 'Hz', 3)}: only the delay of {delay} that "
                "it makes is seen, and it need not be known better"
            )
        elif lost > LOST:
            yield (
                f"{where} loses {100.0 * lost:.0f} % of what an edge tells of it between samples at "
                f"{shown(rate_hz, 'Hz', 3)}; sample at {shown(abs(pole), 'Hz', 2)} or faster"
            )


def usual_rate_hz(model: Model, most_hz: float) -> float:
    """Return a rate that shows the corners that matter well: 1, 2 or 5 times a power of ten, at most ``most_hz``."""
    corners = np.abs(np.concatenate([np.roots(block.den) for block in (model.g1, model.g2)])) / (2.0 * pi)
    if not corners.size:
        return min(1000.0, most_hz)
    wanted = SAMPLES * float(np.max(corners[corners <= WIDE * np.min(corners)]))
    return one_two_five(min(2.4 * wanted, most_hz))


def one_two_five(value: float) -> float:
    """Return the largest of 1, 2, 5 times a power of ten that is at most ``value``."""
    power = floor(log10(value) + 1e-9)
    return max(float(f"{m}e{power}") for m in (1, 2, 5) if float(f"{m}e{power}") <= value * (1.0 + 1e-9))
