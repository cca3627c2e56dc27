"""How late is y in all, and where is that lateness written down?

A pure delay moves freely along a chain of time-invariant blocks and a rate-independent F (physics.md 1.1), so only the
sum can be known. Answers put all of it into G2 and none into G1; a model keeps the shares its rig file began with.
"""

import math
from collections.abc import Sequence

import numpy as np

from identify.blocks import LinearBlock
from identify.chain import Chain
from identify.fit import Fit
from identify.interval import Interval
from identify.trace import Trace


def delay_s(chain: Chain) -> float:
    """Return the sum of all dead times of a chain, s."""
    return sum(block.delay_s(chain.of(block, "")) for block in chain.stages if isinstance(block, LinearBlock))


def total_delay(fit: Fit, wider: float = 1.0) -> Interval:
    """Return the sum of all dead times, s; without width when none of them was searched."""
    value, names = delay_s(fit.chain), _searched(fit)
    if len(names) == 1:  # even in its own coordinate, which keeps it positive
        low, high = fit.ci95(names[0], wider)
        rest = value - fit.chain.values[names[0]]
        return Interval(value, rest + low, rest + high)
    half = 1.96 * wider * _sd_of_sum(fit, names)
    return Interval(value, value - half, value + half)


def device_doubt_s(traces: Sequence[Trace]) -> float:
    """Return half the widest interval of the delays that are known to be the devices' own, s; 0 where none is."""
    used = [t.device.late for t in traces if t.device is not None and not t.device.unused]
    return max((0.5 * (late.high - late.low) for late in used), default=0.0)


def _searched(fit: Fit) -> list[str]:
    """Return the delays that were fitted, by name."""
    own = {p.name for block in fit.chain.stages if isinstance(block, LinearBlock) for p in block.delays}
    return [c.name for c in fit.coordinates if c.name in own]


def _sd_of_sum(fit: Fit, names: Sequence[str]) -> float:
    """Return the standard deviation of the sum of fitted values, by linear propagation."""
    slopes = np.array([
        c.slope(float(t)) if c.name in names else 0.0 for c, t in zip(fit.coordinates, fit.theta, strict=True)
    ])  # fmt: skip
    return math.sqrt(max(float(slopes @ fit.covariance @ slopes), 0.0))

