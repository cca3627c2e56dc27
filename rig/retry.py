"""What is played again when samples were lost in a run?

A backlash cannot be rewound: the state it had before the step that lost samples is gone. So a retry is a recording of
its own, a new segment. It begins with a preconditioning, which takes the rig through the extremes of all that was
played so far and so leaves the gap where its past no longer matters; then come the step that lost samples, from its
beginning, and all that was to follow it.
"""

from collections import Counter
from dataclasses import replace
from itertools import pairwise
from math import ceil
from pathlib import Path

import numpy as np

from identify.trace import Step, part
from rig.plan import Plan
from rig.signals import extremes, joined
from rig.stimuli import Array

PRECONDITIONING = "preconditioning"
MOST = 99


def again(plan: Plan, lost_at: int | None) -> Plan | None:
    """Return what to play after a run of ``plan`` that lost sample ``lost_at``; None when nothing is to be retried."""
    if lost_at is None or not plan.retries:
        return None
    to_play = tuple(step for step in plan.steps if step.stop > lost_at and step.label != PRECONDITIONING)
    if not to_play:
        return None
    begin = to_play[0].start
    lead = preconditioning(plan, lost_at, float(plan.u[begin : begin + 1][0]))
    steps = _renumbered(to_play, lead.size - begin)
    return replace(
        plan, title=f"{plan.title}, again from {steps[0].label}", u=joined([lead, part(plan.u, begin, plan.u.size)]),
        steps=(Step(PRECONDITIONING, "table", 0, lead.size), *steps), initial="in_motion", retries=plan.retries - 1)


def path_of(run: Path, number: int) -> Path:
    """Return where the retry of this number of the recording ``run`` is kept."""
    return run.with_name(f"{run.stem}.retry{number}{run.suffix}")


def paths_beside(run: Path) -> list[Path]:
    """Return the retries of ``run`` that there are."""
    beside = (path_of(run, number) for number in range(1, MOST + 1))
    return [path for path in beside if path.exists()]


def preconditioning(plan: Plan, until: int, end_v: float) -> Array:
    """Return u, V, that goes from the safe level through the extremes of the samples before ``until`` to ``end_v``.

    The extremes come in the order in which they were met last; every way takes the time of the ramp, longer where the
    slope is limited, and the end is held for as long.
    """
    met = extremes(part(plan.u, 0, max(until, 1)))
    latest_last = sorted([(met.high_at, met.high_v), (met.low_at, met.low_v)])
    levels = [plan.safe_level_v, *(level for _, level in latest_last), end_v]
    least = max(1, ceil(plan.ramp_s * plan.rate_hz))
    ways = [_way(plan, first, to, least) for first, to in pairwise(levels)]
    return np.concatenate([*ways, np.full(least, end_v)])


def _way(plan: Plan, first_v: float, last_v: float, least: int) -> Array:
    """Return samples on a straight line to ``last_v``, at least so many."""
    slew = plan.limits.slew_v_per_s
    count = least if slew is None else max(least, ceil(abs(last_v - first_v) * plan.rate_hz / slew))
    return np.linspace(first_v, last_v, count + 1)[1:]


def _renumbered(steps: tuple[Step, ...], shift: int) -> tuple[Step, ...]:
    """Return the steps shifted by so many samples, the passes of each label counted anew."""
    seen: Counter[str] = Counter()
    moved = []
    for step in steps:
        moved.append(Step(step.label, step.kind, step.start + shift, step.stop + shift, seen[step.label]))
        seen[step.label] += 1
    return tuple(moved)
