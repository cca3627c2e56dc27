"""How is a protocol told in plain words before it is played: what it takes, and how sure its answer would be?"""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from identify.natural_units import shown
from rig.narration import span, untold
from rig.tabular import Line, Table
from rig.units import show

if TYPE_CHECKING:
    from identify.planning.information import Expected, Information
    from rig.design import Designed, Row
    from rig.foresight import Foresight
    from rig.newprotocol import New
    from rig.session import Checked

MOST_SHARES = 3
LEAST_SHARE = 0.05


def checked(found: "Checked") -> Iterator[str]:
    """Tell what would be played, and what it takes."""
    plan, can = found.plan, found.capabilities
    yield f"{plan.title}: accepted, nothing was output"
    yield f"  question  {plan.question}"
    yield f"  device    {found.address} ({found.identity})"
    yield f"  samples   {plan.u.size} at {show(plan.rate_hz, 'Hz')}, {span(plan.duration_s)}, steps: {len(plan.steps)}"
    low_v, high_v = plan.range_v
    yield f"  levels    {low_v:.6g} to {show(high_v, 'V')}, peak {show(plan.peak_v, 'V')}"
    yield f"            limits {plan.limits.low_v:g} to {plan.limits.high_v:g} V, {_room(found)}"
    yield f"  slew      {show(plan.slew_v_per_s, 'V/s')}{_slew_limit(plan.limits.slew_v_per_s)}"
    yield f"  safe end  {show(plan.safe_level_v, 'V')} in {span(plan.ramp_s)}"
    yield f"  needs     {_size(plan.memory_bytes)} of memory, {_size(plan.disk_bytes)} of disk"
    if can.buffer_samples is not None:
        yield f"  buffer    {can.buffer_samples} samples in the device, {span(can.buffer_samples / plan.rate_hz)}"
    for note in plan.notes:
        yield f"  note      {note}"


def foreseen(told: "Foresight") -> Iterator[Line]:
    """Tell how sure the answer would be, which step it would come from, and what to change."""
    if told.information is None:
        yield f"  expected  cannot be told: {told.why_not}"
    else:
        noise = f"noise {shown(told.noise_v, 'V', 3)} ({told.noise_from})"
        yield f"  expected  95 % intervals where the rig is as its file says, {noise}:"
        yield expected(told.information)
    for advice in told.advice:
        yield f"  {'remark' if advice.remark else 'advice'}    {advice.sentence}"
    yield from untold("what its sines leave to the orders in the rig file", told.untold)


def written(done: "New", told: "Foresight") -> Iterator[str]:
    """Tell which protocol was written, what it takes, and what to change in it."""
    plan = done.checked.plan
    yield f"{done.path}: {plan.title}"
    yield f"  question  {plan.question}"
    yield f"  takes     {span(plan.duration_s)} at {show(plan.rate_hz, 'Hz')}, peak {show(plan.peak_v, 'V')}"
    yield from (f"  step      {label}" for label in dict.fromkeys(step.label for step in plan.steps))
    for advice in told.advice:
        yield f"  {'remark' if advice.remark else 'advice'}    {advice.sentence}"
    yield f"  next: `rig check {done.path}`, `rig run {done.path}`"


def expected(told: "Information") -> Table:
    """Return every quantity with its expected interval and the steps it is told by, largest share first."""
    return Table(("", "", "95 %", "told by"), tuple(_expected_row(one) for one in told.expected()), 4)


def _expected_row(one: "Expected") -> tuple[str, ...]:
    q = one.quantity
    if not one.told:
        return (q.name, shown(q.value, q.unit), "", "not told by this protocol")
    shares = sorted(one.shares.items(), key=lambda item: -item[1])[:MOST_SHARES]
    told_by = ", ".join(f"{100.0 * share:.0f} % {label}" for label, share in shares if share >= LEAST_SHARE)
    return (q.name, shown(q.value, q.unit), f"± {shown(1.96 * one.sd, q.unit, 2)}", told_by)


def designed(done: "Designed") -> Iterator[Line]:
    """Tell what was written, how sure it makes the answer, and how that compares with the paper's protocol."""
    steps = len({step.label for step in done.plan.steps})
    yield f"{done.path}: {steps} steps in {span(done.plan.duration_s)} at {show(done.plan.rate_hz, 'Hz')}"
    yield f"  expected 95 % intervals, noise {shown(done.told.noise_v, 'V', 3)} ({done.told.noise_from}):"
    yield Table(("", "", "this", "Fig. 13", "narrower", "30 % off"), tuple(_designed_row(row) for row in done.rows), 4)
    yield f"  Fig. 13: {done.paper}"
    yield ("  30 % off: how much wider, relative to its value, an interval gets at worst if gap, slopes and time "
           f"constants are; {done.moving} of {steps} steps or more then still move F")
    yield f"  next: `rig check {done.path}`, `rig run {done.path}`"


def _designed_row(row: "Row") -> tuple[str, ...]:
    """Return one quantity: its interval in this protocol and in the paper's, and how much wider it gets at worst."""
    q = row.designed.quantity
    ends = (f"± {shown(1.96 * e.sd, q.unit, 2)}" if e.told else "not told" for e in (row.designed, row.paper))
    ratio = f"{row.paper.sd / row.designed.sd:.3g} x" if row.designed.told and row.paper.told else "-"
    return (q.name, shown(q.value, q.unit), *ends, ratio, f"{row.worst:.3g} x")


def _size(count: int) -> str:
    return f"{count / 1e6:.1f} MB" if count >= 1e5 else f"{count / 1e3:.1f} kB"


def _room(found: "Checked") -> str:
    """Return how much of the device's range the plan uses."""
    can = found.capabilities
    return f"device {can.output_low_v:g} to {can.output_high_v:g} V in steps of {shown(can.output_lsb_v, 'V', 3)}"


def _slew_limit(limit_v_per_s: float | None) -> str:
    return "" if limit_v_per_s is None else f", limit {show(limit_v_per_s, 'V/s')}"
