"""How is a number said to an operator: three or four digits, and a unit with the prefix people use?"""

import math

PREFIXES = {-12: "p", -9: "n", -6: "u", -3: "m", 0: "", 3: "k", 6: "M"}
PREFIXED = ("V", "s", "Hz", "V/s", "A")


def spoken(value: float, unit: str, digits: int = 4) -> str:
    """Return ``value`` with its unit, such as ``123 us``; units without customary prefixes keep plain numbers."""
    if not math.isfinite(value):
        return f"{value} {unit}".strip()
    if value == 0.0 or unit not in PREFIXED:
        return f"{value:.{digits}g} {unit}".strip()
    exponent = 3 * math.floor(math.log10(abs(value)) / 3)
    if 1.0 <= abs(value) < 1e4:
        exponent = 0
    exponent = min(max(exponent, -12), 6)
    return f"{value / 10.0**exponent:.{digits}g} {PREFIXES[exponent]}{unit}"


def spoken_with_interval(value: float, low: float, high: float, unit: str) -> str:
    """Return ``value`` and half the width of its 95 % interval, in one unit, such as ``9.98 V +- 12 mV``."""
    return f"{spoken(value, unit)} +- {spoken(0.5 * (high - low), unit, 2)}"


def listed(parts: list[str]) -> str:
    """Return parts joined as in a sentence."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}" if parts else "nothing"
