"""How does a number read in the unit an operator would use: 4.2 µs rather than 4.2e-06 s?"""

import math

from identify.interval import Interval

PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"))
PREFIXED = frozenset({"V", "s", "Hz", "V/s", "A", "ohm"})
LOPSIDED = 0.1  # relative difference of the two halves of an interval from which both ends are told


def shown(value: float, unit: str = "", digits: int = 4) -> str:
    """Return ``value`` with its unit, the prefix chosen so that the number is easy to say."""
    if not math.isfinite(value):
        return "none" if math.isinf(value) else "not known"
    factor, prefix = prefix_of(value, unit)
    return f"{float(f'{value / factor:.{digits}g}'):.12g} {prefix}{_plain(unit)}".rstrip()


def shown_interval(interval: Interval, unit: str = "") -> str:
    """Return a value with its 95 % interval: ``9.9803 V ± 1.3 mV``, or both ends where they lie unevenly."""
    below, above = interval.value - interval.low, interval.high - interval.value
    half = 0.5 * (below + above)
    if math.isfinite(interval.low) and interval.low != 0.0 and interval.high == math.inf:
        return f"{shown(interval.value, unit)} (at least {shown(interval.low, unit, 3)})"
    if not (math.isfinite(interval.value) and math.isfinite(half)):
        return f"{shown(interval.value, unit)} (interval not bounded)"
    if half <= 0.0:
        return f"{shown(interval.value, unit, 6)} (held fixed)"
    factor, prefix = prefix_of(interval.value, unit)
    decimals = max(0, 1 - math.floor(math.log10(half / factor)))
    value = f"{interval.value / factor:.{min(decimals, 9)}f} {prefix}{_plain(unit)}".rstrip()
    if abs(above - below) > LOPSIDED * (above + below):
        return f"{value} ({shown(interval.low, unit)} to {shown(interval.high, unit)})"
    return f"{value} ± {shown(half, unit, 2)}"


def prefix_of(value: float, unit: str) -> tuple[float, str]:
    """Return the factor and the SI prefix in which ``value`` is written; 1 for units that take none."""
    size = abs(value)
    if unit not in PREFIXED or size == 0.0 or not math.isfinite(size):
        return 1.0, ""
    return next(((factor, prefix) for factor, prefix in PREFIXES if size >= 0.9999995 * factor), PREFIXES[-1])


def _plain(unit: str) -> str:
    """Return the unit as written after a number: V/V is a bare ratio."""
    return "" if unit == "V/V" else unit
