"""How sure is a number: its value and the ends of its 95 % interval."""

import math
from dataclasses import dataclass

DIGITS, MOST_DIGITS = 6, 16  # significant ones in a JSON answer


@dataclass(frozen=True)
class Interval:
    """A value with its 95 % interval, all in one unit."""

    value: float
    low: float
    high: float

    def to_dict(self, unit: str = "") -> dict[str, object]:
        """Return the form JSON answers use."""
        named, digits = {"unit": unit} if unit else {}, self._digits()
        low, high = number(self.low, digits), number(self.high, digits)
        return {"value": number(self.value, digits), **named, "ci95": [low, high]}

    def _digits(self) -> int:
        """Return how many significant digits show the width of the interval to three digits, six at least."""
        width, largest = self.high - self.low, max(abs(self.low), abs(self.high))
        if not 0.0 < width < math.inf:
            return DIGITS
        return min(max(DIGITS, 3 + math.ceil(math.log10(largest / width))), MOST_DIGITS)


def number(value: float, digits: int = DIGITS) -> float | None:
    """Return a float rounded to ``digits`` significant digits, None when it is not finite: JSON has no infinity."""
    return float(f"{value:.{digits}g}") if math.isfinite(value) else None
