"""What should the operator do next?"""

from identify.explain.confirm import UNFINISHED
from identify.explain.explanation import Explanation, Finding
from identify.explain.phrases import TAP
from identify.unnamed.correction import UNNAMED

CLOSER = {  # the experiment that shows more of what acts along a coordinate
    "level of u": "play the same with a cable from the DAQ's output to its input: what stays is in source or sense",
    "level of v": "record a staircase of fine steps over the levels named above, up and down, at the slowest rate",
    "level of w": "record a staircase of fine steps over the levels named above, up and down, at the slowest rate",
    "level of x": "record a staircase of fine steps over the levels named above, up and down, at the slowest rate",
    "level of y": "record a staircase of fine steps over the readings named above, and one with the source attenuated",
    "branch": "record nested minor loops: turning points inside one another show which branch differs",
    "time on a plateau": "record one staircase with short and one with long holds",
    "clock time": "play the first run once more after a pause: what drifts shows as a difference of the two",
    "frequency": "record sines of two amplitudes at three frequencies in the band named above",
    "mains lines": "record with the source silent: what is still there does not come from the stimulus",
}
SPEED = "record triangles of one height at two speeds: what follows the rate scales with the speed"


def next_steps(told: Explanation) -> list[str]:
    """Return what to do, the most useful first."""
    if told.verdict == "consistent" and told.remaining.over_noise > UNFINISHED:
        return ["Fit the held-out runs, too, or others that move as far and as fast: the model is not sure there."]
    if told.verdict == "consistent":
        return ["Nothing: use the model below. A protocol that reaches other levels and speeds would try it further."]
    steps = [step for finding in told.effects for step in _about(finding)]
    if told.verdict != "explained" and told.location is not None:
        steps += _closer(told.remaining.stage or told.location.stage, _axes(told))
    if told.verdict == "unexplained" and told.location is None:
        steps.append("Fit runs that reach what the held-out runs show, or hold out others.")
    return list(dict.fromkeys([*steps, "Save the model below: rig simulate plays it, and rig explain starts from it."]))


def _about(finding: Finding) -> list[str]:
    """Return the experiment that would settle which name a finding has, or where what has none enters."""
    if finding.could_also_be and finding.would_separate:
        rivals = " from ".join(name.replace("_", " ") for name in (finding.id, finding.could_also_be[0].id))
        return [f"To tell {rivals}: {finding.would_separate}."]
    if finding.id == UNNAMED and finding.would_separate:
        return [f"To tell where it enters: {finding.would_separate}."]
    return []


def _closer(stage: str, axes: list[str]) -> list[str]:
    """Return what shows more of a mismatch at a stage along coordinates."""
    ways = [SPEED if axis.startswith("rate") else CLOSER[axis] for axis in axes if axis in CLOSER or "rate" in axis]
    return [f"{way[0].upper()}{way[1:]}." for way in [*ways[:1], TAP[stage]]]


def _axes(told: Explanation) -> list[str]:
    """Return the coordinates along which something is still to be explained."""
    unnamed = [f.shape.axis for f in told.effects if f.shape is not None]
    ranges = [part.axis for part in told.location.where] if told.location else []
    return list(dict.fromkeys([*unnamed, *ranges]))
