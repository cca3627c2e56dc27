"""How are a stretch, a list and a correction said in a sentence?"""

from collections.abc import Sequence

from identify.explain.explanation import Finding, Range
from identify.explain.locate import Located
from identify.natural_units import shown

OPEN = 0.1  # probability of another name from which the verdict in one sentence leaves it open


def stretch_told(part: Range) -> str:
    """Return a stretch of a coordinate in words."""
    return f"{shown(part.low, part.unit, 3)} to {shown(part.high, part.unit, 3)} ({100 * part.share:.0f} % of it)"


def called(finding: Finding) -> str:
    """Return the name of a finding with its stage, and what it may as well be."""
    others = [f"{o.id} at {o.stage}" for o in finding.could_also_be if o.probability > OPEN]
    return " or ".join([f"{finding.id} at {finding.stage}", *others])


def listed(parts: Sequence[str]) -> str:
    """Return parts joined as in a sentence."""
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}" if parts else "nothing"


def described(beyond: Located) -> str:
    """Return what the best correction says."""
    best, share = beyond.best, 100 * min(beyond.share, 1.0)
    return f"{best.kind} at {best.place.label} along {best.axis} accounts for {share:.0f} % of the misfit"
