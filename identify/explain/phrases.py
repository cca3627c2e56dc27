"""How are a stretch, a list, a correction and the probe that finds a stage said in a sentence?"""

from collections.abc import Sequence

from identify.explain.explanation import Finding, Range
from identify.explain.locate import Located
from identify.natural_units import shown

OPEN = 0.1  # probability of another name from which the verdict in one sentence leaves it open
TAP = {  # what shows whether a mismatch enters at a stage, whatever is played
    "source": "put a probe on u where it enters G1 and compare it with what was commanded",
    "G1": "put a probe on v, behind G1: it tells whether the mismatch is there before F",
    "F": "put probes on v and w, before and behind F",
    "G2": "put a probe on w, behind F: if it follows the model, the mismatch is made behind it",
    "sense": "feed the DAQ's input from a calibrated source in place of the circuit",
}


def probe(stage: str, other: str) -> str:
    """Return the probe that tells two stages apart: at the end of the signal path that is one of them, else between.
    """
    return next(TAP[each] for each in ("source", "sense", "F", "G1") if each in (stage, other))


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
    best, at = beyond.best, beyond.place.label
    at += "" if best.place is beyond.place else f" (as if at {best.place.label}, where it has not come in)"
    whole = beyond.leaves_noise and beyond.fitted[0][1] is beyond.nearest
    share = "all" if whole else f"{100 * min(beyond.share, 1.0):.0f} %"
    but = " but what may be noise" if whole else ""
    return f"{best.kind} at {at} along {best.axis} accounts for {share} of the misfit{but}"
