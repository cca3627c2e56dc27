"""How is a plan played on a device so that, whatever happens, the output ends at its safe level?

Safety comes before storage: on every way out the clock is stopped and the output is ramped down before anything else is
done, and each of these steps is guarded by itself. SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP and the button of a live
page are requests to stop (``rig/stopping.py``), answered between two blocks; a second one does not interrupt the ramp.
There is no pause: a rig with memory does not wait, and its output must not stand while nobody looks. Where nothing can
be answered any more, as after SIGKILL, a guardian acts (``rig/guardian.py``).
"""

import logging
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Protocol

from rig.device import Array, Block, Device, Flag
from rig.errors import DeviceError, IncompleteError, RigError, StarvedError
from rig.guardian import post
from rig.plan import Plan
from rig.recorded import Event
from rig.stopping import Asked, StopRequest, nobody, stop_requests

log = logging.getLogger(__name__)
Progress = Callable[[int, int], None]
_TOLD_ONCE = {
    Flag.CLIPPED: ("clipped", "the input reached the end of its range"),
    Flag.RESENT: ("resent", "samples lost on the link were asked for again, and arrived"),
}


class Sink(Protocol):
    """Where samples go: a recording being written."""

    def append(self, start: int, y: Array, further: Array) -> None:
        """Store ``y`` (n,), V, and the ``further`` inputs (inputs - 1, n), as the samples from index ``start`` on."""


@dataclass(frozen=True)
class Outcome:
    """How a run ended. ``samples`` counts those received and stored; ``failure`` is None for a complete run.

    ``lost_at`` is the first sample that was lost where nothing graver happened.
    """

    complete: bool
    reason: str
    samples: int
    events: tuple[Event, ...]
    failure: RigError | None = None
    lost_at: int | None = None


@dataclass
class _Progress:
    """What was received so far and what happened; grows during a run."""

    size: int
    lost: list[tuple[int, int]] = field(default_factory=list)
    position: int = 0
    received: int = 0
    told: Flag = Flag.NONE
    events: list[Event] = field(default_factory=list)

    def note(self, kind: str, text: str, start: int | None = None) -> None:
        """Add an event that reaches from ``start`` to the present position."""
        log.info("%s: %s", kind, text)
        self.events.append(Event(kind, text, self.position if start is None else start, self.position))

    def take(self, block: Block) -> None:
        """Count the samples of ``block`` and note those missing before it."""
        last, self.position = self.position, block.start
        if block.start > last:
            cause = "overrun in the device" if block.flags & Flag.OVERRUN else "lost on the link"
            self.note("lost", f"{block.start - last} samples from {last} on: {cause}", last)
            self.lost.append((last, block.start))
        for flag in _TOLD_ONCE.keys() & set(block.flags & ~self.told):
            self.told |= flag
            self.note(*_TOLD_ONCE[flag])
        self.position, self.received = block.stop, self.received + int(block.y.size)


def run(
    plan: Plan, device: Device, writer: Sink, progress: Progress = lambda done, total: None, asked: Asked = nobody,
) -> Outcome:  # fmt: skip
    """Play ``plan`` on ``device``, append what comes back to ``writer``, leave the output at the plan's safe level.

    ``progress`` is called with (samples received or lost so far, samples in all). ``asked`` is called after every
    block: where it names somebody, the run stops as it does on a signal. Raises RefusedError, or DeviceError where
    there is no guardian, before anything is output. Device and storage failures are told in the outcome; a programming
    error is raised once all is safe.
    """
    guardian = post(device)
    if guardian is not None:
        guardian.ready()
    with stop_requests() as stop:
        blocks = device.stream(plan.u, plan.rate_hz, plan.limits, plan.safe_level_v, plan.ramp_s, len(plan.inputs))
        state = _Progress(plan.u.size)
        ended_by = _guarded(lambda: _approach(plan, device, state)) or _guarded(
            lambda: _play(plan, blocks, writer, progress, state, stop, asked))
        if isinstance(ended_by, RigError):
            state.note("failed", str(ended_by))
        unsafe = _make_safe(plan, device, blocks, state)
        if guardian is not None and not guardian.alive:
            state.note("guardian", "the guardian ended before the run did, and did not watch over all of it")
    if ended_by is not None and not isinstance(ended_by, (RigError, KeyboardInterrupt)):
        raise ended_by
    _account(plan, device, state)
    return _outcome(state, stop, ended_by, unsafe)


def elsewhere(plan: Plan, device: Device) -> float | None:
    """Return the level in V where the output was left, None when that is where ``plan`` begins, or not known."""
    at_v = device.level_v()
    there = at_v is None or abs(at_v - plan.safe_level_v) <= device.capabilities().output_lsb_v
    return None if there else at_v


def _approach(plan: Plan, device: Device, state: _Progress) -> None:
    """Bring the output to the safe level, from which the slopes of the plan were checked."""
    at_v = elsewhere(plan, device)
    if at_v is not None:
        slew = plan.limits.slew_v_per_s
        least_s = 0.0 if slew is None else abs(at_v - plan.safe_level_v) / slew
        device.safe(plan.safe_level_v, max(plan.ramp_s, least_s))
        state.note("approach", f"the output stood at {at_v:.6g} V and was brought to {plan.safe_level_v:g} V first")


def _play(
    plan: Plan, blocks: Iterator[Block], writer: Sink, progress: Progress, state: _Progress, stop: StopRequest,
    asked: Asked,
) -> None:
    """Pass blocks on until the run is over, or a stop is requested, or samples are lost that are to be retried."""
    show = progress
    for block in blocks:
        state.take(block)
        if block.y.size:
            _store(writer, block, state)
        if (trouble := _guarded(lambda: show(state.position, state.size))) is not None:  # noqa: B023
            state.note("display", f"the progress display failed and was left out: {trouble!r}")
            show = _nothing
        if (who := asked()) is not None:  # never sets None: a signal may have come meanwhile
            stop.name = stop.name or who
        if stop.name is not None or (state.lost and plan.retries):
            return


def _store(writer: Sink, block: Block, state: _Progress) -> None:
    """Store a block; raise IncompleteError when the storage fails (h5py tells a full disk as a RuntimeError)."""
    try:
        writer.append(block.start, block.y, block.further)
    except (OSError, RuntimeError) as error:
        state.received -= int(block.y.size)
        raise IncompleteError(f"the recording could not be stored: {error}",
                              value=f"{state.received} of {state.size} samples kept") from error


def _nothing(done: int, total: int) -> None:
    """Show no progress."""


def _make_safe(plan: Plan, device: Device, blocks: Iterator[Block], state: _Progress) -> DeviceError | None:
    """Stop the clock and ramp to the safe level, at once where the ramp fails; return why the output is not safe."""
    halted = _guarded(blocks.close)  # type: ignore[attr-defined]
    if halted is not None:
        state.note("halt", f"the sample clock did not stop cleanly: {halted}")
    trouble = _guarded(lambda: device.safe(plan.safe_level_v, plan.ramp_s))
    if trouble is not None:
        state.note("ramp", f"the ramp to {plan.safe_level_v:g} V failed: {trouble}")
        trouble = _guarded(lambda: device.safe(plan.safe_level_v, 0.0))
    if trouble is None:
        state.note("safe", f"output at {plan.safe_level_v:g} V")
        return None
    state.note("unsafe", f"the device did not confirm {plan.safe_level_v:g} V: {trouble}")
    return DeviceError("the output is not confirmed safe", value=str(trouble),
                       do="switch the rig off by hand; a device with a watchdog goes to its safe level by itself")


def _outcome(state: _Progress, stop: StopRequest, ended_by: BaseException | None, unsafe: DeviceError | None,
             ) -> Outcome:
    """Return the verdict on a run: the gravest of what happened is its reason."""
    failure = unsafe or _failure(state, stop, ended_by)
    first = state.lost[0][0] if state.lost else state.position if isinstance(ended_by, StarvedError) else None
    lost_at = first if failure is not None and failure is not unsafe and _by_loss(stop, ended_by) else None
    reason = f"all {state.size} samples recorded" if failure is None else str(failure)
    return Outcome(failure is None, reason, state.received, tuple(state.events), failure, lost_at)


def _by_loss(stop: StopRequest, ended_by: BaseException | None) -> bool:
    """Return whether a run that did not end well did so for nothing but lost samples."""
    return stop.name is None and (ended_by is None or isinstance(ended_by, StarvedError))


def _account(plan: Plan, device: Device, state: _Progress) -> None:
    """Note which steps lost samples, and how far the output came where it did not come to the end."""
    for step in plan.steps:
        lost = sum(max(0, min(stop, step.stop) - max(start, step.start)) for start, stop in state.lost)
        if lost:
            text = f"{step.label!r}, pass {step.repeat + 1}, lost {lost} of {step.stop - step.start} samples"
            state.events.append(Event("incomplete", text, step.start, step.stop))
    played = device.played()
    if played is not None and played < state.size:
        state.events.append(Event("output", f"at least {played} of {state.size} samples were put out", 0, played))


def _failure(state: _Progress, stop: StopRequest, ended_by: BaseException | None) -> RigError | None:
    """Return what made the run incomplete, None when nothing did."""
    kept = f"{state.received} of {state.size} samples"
    if isinstance(ended_by, RigError):
        return ended_by
    if ended_by is not None or (stop.name and state.position < state.size):
        return IncompleteError(f"stopped by {stop.name or 'SIGINT'}", value=f"{kept} kept")
    if state.received < state.size:
        return IncompleteError("samples were lost", value=kept, do="the gaps are marked in the recording")
    return None


def _guarded(step: Callable[[], object]) -> BaseException | None:
    """Do ``step``; return what it raised instead of raising it."""
    try:
        step()
    except BaseException as error:
        return error
    return None
