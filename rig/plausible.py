"""Which capabilities can a device not have, whatever it says?

A description that is damaged, or that firmware gets wrong, must not reach arithmetic or allocation.
"""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rig.capabilities import Capabilities

MOST_V, MOST_HZ, MOST_SAMPLES = 1e4, 1e10, 1 << 48
MOST_INPUTS = 64
BITS = (2, 32)


def impossible(can: "Capabilities") -> str | None:
    """Return what is impossible about ``can``, in words, with what is allowed; None when nothing is."""
    return next(_impossibilities(can), None)


def _impossibilities(can: "Capabilities") -> Iterator[str]:
    """Yield a sentence for each thing that cannot be."""
    for end in ("output", "input"):
        low, high = getattr(can, f"{end}_low_v"), getattr(can, f"{end}_high_v")
        if not -MOST_V <= low < high <= MOST_V:
            yield (f"{end}_low_v = {low:g} V, {end}_high_v = {high:g} V; "
                   f"allowed: low below high, within -{MOST_V:g} to {MOST_V:g} V")
        bits = getattr(can, f"{end}_bits")
        if not BITS[0] <= bits <= BITS[1]:
            yield f"{end}_bits = {bits}; allowed: {BITS[0]} to {BITS[1]}"
    if not 0 < can.min_rate_hz <= can.max_rate_hz <= MOST_HZ:
        yield (f"min_rate_hz = {can.min_rate_hz:g} Hz, max_rate_hz = {can.max_rate_hz:g} Hz; "
               f"allowed: above 0 Hz, the lowest first, up to {MOST_HZ:g} Hz")
    for name, count in (("buffer_samples", can.buffer_samples), ("max_samples", can.max_samples)):
        if count is not None and not 1 <= count <= MOST_SAMPLES:
            yield f"{name} = {count}; allowed: 1 to {MOST_SAMPLES}"
    if not 1 <= can.inputs <= MOST_INPUTS:
        yield f"inputs = {can.inputs}; allowed: 1 to {MOST_INPUTS}"
    if can.max_total_rate_hz is not None and not can.min_rate_hz <= can.max_total_rate_hz <= MOST_HZ * MOST_INPUTS:
        yield (f"max_total_rate_hz = {can.max_total_rate_hz:g} Hz; "
               f"allowed: {can.min_rate_hz:g} to {MOST_HZ * MOST_INPUTS:g} Hz")


def is_positive(value: float) -> bool:
    """Return whether ``value`` is a finite number above 0."""
    return math.isfinite(value) and value > 0
