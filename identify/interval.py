"""How sure is a number: its value and the ends of its 95 % interval."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Interval:
    """A value with its 95 % interval, all in one unit."""

    value: float
    low: float
    high: float

    def to_dict(self, unit: str = "") -> dict[str, object]:
        """Return the form JSON answers use."""
        named = {"unit": unit} if unit else {}
        return {"value": number(self.value), **named, "ci95": [number(self.low), number(self.high)]}


def number(value: float, digits: int = 6) -> float | None:
    """Return a float rounded to ``digits`` significant digits, None when it is not finite: JSON has no infinity."""
    return float(f"{value:.{digits}g}") if math.isfinite(value) else None
