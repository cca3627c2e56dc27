"""Does the output end safe, and what was recorded stay kept, on every way out of a run?"""

import os
import signal
import threading
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from identify.trace import Step
from rig.device import Array, Block, Flag
from rig.errors import DeviceError, IncompleteError, RefusedError, RigError, StarvedError
from rig.plan import Limits, Plan
from rig.runner import Outcome, run
from tests.unit.rig.devices import ScriptedDevice, following, skipping

SIZE = 1000


class Kept:
    """A sink that keeps what it is given."""

    def __init__(self, fails_at: int | None = None, failure: Exception | None = None) -> None:
        self.y = np.full(SIZE, np.nan)
        self._fails_at, self._failure = fails_at, failure

    def append(self, start: int, y: Array, further: Array) -> None:
        if self._failure is not None and start == self._fails_at:
            raise self._failure
        self.y[start:start + y.size] = y


@pytest.fixture
def device() -> ScriptedDevice:
    return ScriptedDevice()


def plan(peak_v: float = 4.0) -> Plan:
    return Plan("a ramp", np.linspace(0.0, peak_v, SIZE), 1000.0, (Step("all", "table", 0, SIZE),),
                Limits(-5.0, 5.0, None), 1.0, 0.2)


def failing(device: ScriptedDevice, at: int, error: BaseException) -> None:
    """Make ``device`` raise ``error`` in place of the samples from ``at`` on."""

    def read(position: int) -> Block:
        if position >= at:
            raise error
        return following(device.u, position)

    device.read = read


def made_safe(device: ScriptedDevice) -> bool:
    """Return whether the clock was stopped and then the ramp was made, and nothing happened after it."""
    return device.diary[-2:] == ["halt", "safe 1 V 0.2 s"] and device.level == 1.0


def kinds(outcome: Outcome) -> list[str]:
    return [event.kind for event in outcome.events]


def test_a_whole_run_is_recorded_and_ends_safe(device: ScriptedDevice) -> None:
    kept, seen = Kept(), []
    outcome = run(plan(), device, kept, lambda done, total: seen.append((done, total)))
    assert outcome == Outcome(True, "all 1000 samples recorded", SIZE, outcome.events, None)
    assert kinds(outcome) == ["safe"]
    assert np.array_equal(kept.y, device.quantise(plan().u))
    assert seen == [(done, SIZE) for done in range(100, SIZE + 1, 100)]
    assert device.diary[:2] == ["identity", "begin 1 V 0.2 s"]
    assert made_safe(device)


def test_a_refused_plan_touches_nothing(device: ScriptedDevice) -> None:
    with pytest.raises(RefusedError):
        run(plan(6.0), device, Kept())
    assert device.diary == ["identity"]


@pytest.mark.parametrize("flag", [Flag.OVERRUN, Flag.LINK_LOSS])
def test_lost_samples_make_the_run_incomplete_and_are_told_with_their_cause(
    device: ScriptedDevice, flag: Flag,
) -> None:
    device.read = skipping(device, range(300, 450), flag)
    kept = Kept()
    outcome = run(plan(), device, kept)
    lost = outcome.events[0]
    assert (lost.kind, lost.start, lost.stop) == ("lost", 300, 450)
    assert ("overrun in the device" if flag is Flag.OVERRUN else "lost on the link") in lost.text
    assert isinstance(outcome.failure, IncompleteError)
    assert outcome.samples == 850 == np.isfinite(kept.y).sum()
    assert np.isnan(kept.y[300:450]).all()
    assert made_safe(device)


def test_steps_that_lost_samples_are_told_and_the_run_goes_on(device: ScriptedDevice) -> None:
    device.read = skipping(device, range(300, 450), Flag.OVERRUN)
    steps = (Step("a", "sine", 0, 400), Step("a", "sine", 400, 800, 1), Step("b", "table", 800, SIZE))
    outcome = run(replace(plan(), steps=steps), device, Kept())
    told = [event for event in outcome.events if event.kind == "incomplete"]
    assert [(event.start, event.stop) for event in told] == [(0, 400), (400, 800)]
    assert [event.text for event in told] == [
        "'a', pass 1, lost 100 of 400 samples", "'a', pass 2, lost 50 of 400 samples"]
    assert (outcome.samples, outcome.lost_at) == (850, 300)


def test_a_run_that_may_be_retried_ends_where_samples_are_lost(device: ScriptedDevice) -> None:
    device.read = skipping(device, range(300, 450), Flag.OVERRUN)
    outcome = run(replace(plan(), retries=1), device, Kept())
    assert outcome.lost_at == 300
    assert outcome.samples == 400
    assert isinstance(outcome.failure, IncompleteError)
    assert made_safe(device)


def test_a_device_that_ran_dry_may_be_retried_and_any_other_failure_not(device: ScriptedDevice) -> None:
    failing(device, 400, StarvedError("out of samples"))
    assert run(plan(), device, Kept()).lost_at == 400
    failing(device, 400, DeviceError("the cable is off"))
    assert run(plan(), device, Kept()).lost_at is None


def test_a_stop_is_not_retried_though_samples_were_lost(device: ScriptedDevice) -> None:
    device.read = skipping(device, range(300, 450), Flag.OVERRUN)
    outcome = run(plan(), device, Kept(), stopping(lambda: os.kill(os.getpid(), signal.SIGINT), 550))
    assert "stopped by SIGINT" in outcome.reason
    assert outcome.lost_at is None


def test_an_output_left_elsewhere_is_brought_to_the_safe_level_first(device: ScriptedDevice) -> None:
    device.level = -3.0
    outcome = run(replace(plan(), limits=Limits(-5.0, 5.0, 8.0)), device, Kept())
    assert outcome.complete
    assert device.diary[:3] == ["identity", "safe 1 V 0.5 s", "begin 1 V 0.2 s"], "steeper than the limit, or too late"
    assert kinds(outcome) == ["approach", "safe"]
    assert "stood at -3 V" in outcome.events[0].text


def test_where_the_safe_level_cannot_be_reached_nothing_is_played(device: ScriptedDevice) -> None:
    def ramp(ramp_s: float) -> None:
        if "begin" not in " ".join(device.diary) and device.diary.count("safe 1 V 0.2 s") == 1:
            raise DeviceError("stuck")

    device.level, device.ramp = -3.0, ramp
    outcome = run(plan(), device, Kept())
    assert outcome.reason == "stuck"
    assert not any("begin" in line for line in device.diary)
    assert device.level == 1.0


def test_how_far_the_output_came_is_told_where_it_did_not_come_to_the_end(device: ScriptedDevice) -> None:
    device.put_out = 412
    failing(device, 400, DeviceError("the cable is off"))
    told = [event for event in run(plan(), device, Kept()).events if event.kind == "output"]
    assert [(event.start, event.stop, event.text) for event in told] == [
        (0, 412, "at least 412 of 1000 samples were put out")]


def test_a_lost_end_is_counted(device: ScriptedDevice) -> None:
    device.read = lambda position: following(device.u, position) if position < 900 else Block(SIZE, np.empty(0))
    outcome = run(plan(), device, Kept())
    assert (outcome.samples, outcome.complete) == (900, False)
    assert (outcome.events[0].start, outcome.events[0].stop) == (900, SIZE)


@pytest.mark.parametrize(("flag", "kind"), [(Flag.CLIPPED, "clipped"), (Flag.RESENT, "resent")])
def test_what_happens_to_many_blocks_is_told_once(device: ScriptedDevice, flag: Flag, kind: str) -> None:
    device.read = lambda position: Block(position, device.u[position:position + 100], flag)
    outcome = run(plan(), device, Kept())
    assert outcome.complete
    assert kinds(outcome) == [kind, "safe"]


def test_a_device_failure_is_told_and_the_output_made_safe(device: ScriptedDevice) -> None:
    failing(device, 400, DeviceError("the cable is off"))
    outcome = run(plan(), device, Kept())
    assert isinstance(outcome.failure, DeviceError)
    assert outcome.reason == "the cable is off"
    assert outcome.samples == 400
    assert made_safe(device)


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), RuntimeError("Can't write data")])
def test_a_full_disk_does_not_keep_the_output_from_being_made_safe(device: ScriptedDevice, error: Exception) -> None:
    outcome = run(plan(), device, Kept(400, error))
    assert isinstance(outcome.failure, IncompleteError)
    assert "could not be stored" in outcome.reason
    assert "400 of 1000 samples kept" in outcome.reason
    assert outcome.samples == 400
    assert made_safe(device)


def test_a_programming_error_is_raised_once_all_is_safe(device: ScriptedDevice) -> None:
    with pytest.raises(ZeroDivisionError):
        run(plan(), device, Kept(400, ZeroDivisionError()))
    assert made_safe(device)


def test_a_display_that_fails_is_left_out(device: ScriptedDevice) -> None:
    shown = []

    def show(done: int, total: int) -> None:
        shown.append(done)
        raise ValueError("no terminal")

    outcome = run(plan(), device, Kept(), show)
    assert outcome.complete
    assert shown == [100]
    assert kinds(outcome) == ["display", "safe"]


def stopping(act: Callable[[], None], at: int) -> Callable[[int, int], None]:
    def show(done: int, total: int) -> None:
        if done == at:
            act()

    return show


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP])
def test_a_stop_signal_ends_the_run_between_two_blocks(device: ScriptedDevice, number: signal.Signals) -> None:
    before = signal.getsignal(number)
    outcome = run(plan(), device, Kept(), stopping(lambda: os.kill(os.getpid(), number), 300))
    assert isinstance(outcome.failure, IncompleteError)
    assert outcome.reason == f"stopped by {number.name}: 300 of 1000 samples kept"
    assert outcome.samples == 300
    assert made_safe(device)
    assert signal.getsignal(number) is before


def test_a_second_signal_does_not_interrupt_the_ramp(device: ScriptedDevice) -> None:
    device.ramp = lambda ramp_s: os.kill(os.getpid(), signal.SIGINT)
    outcome = run(plan(), device, Kept(), stopping(lambda: os.kill(os.getpid(), signal.SIGINT), 300))
    assert "stopped by SIGINT" in outcome.reason
    assert made_safe(device)


def test_a_signal_after_the_last_sample_leaves_the_run_complete(device: ScriptedDevice) -> None:
    assert run(plan(), device, Kept(), stopping(lambda: os.kill(os.getpid(), signal.SIGINT), SIZE)).complete


def test_a_run_in_a_thread_leaves_the_signals_alone(device: ScriptedDevice) -> None:
    outcomes: list[Outcome] = []
    thread = threading.Thread(target=lambda: outcomes.append(run(plan(), device, Kept())))
    thread.start()
    thread.join()
    assert outcomes[0].complete


def test_a_ramp_that_fails_is_followed_by_a_jump(device: ScriptedDevice) -> None:
    def ramp(ramp_s: float) -> None:
        if ramp_s:
            raise DeviceError("no ramps today")

    device.ramp = ramp
    outcome = run(plan(), device, Kept())
    assert outcome.complete
    assert device.level == 1.0
    assert device.diary[-2:] == ["safe 1 V 0.2 s", "safe 1 V 0 s"]
    assert kinds(outcome) == ["ramp", "safe"]


def test_an_output_not_confirmed_safe_is_the_gravest_reason(device: ScriptedDevice) -> None:
    def ramp(ramp_s: float) -> None:
        raise DeviceError("no answer")

    failing(device, 400, RigError("something else"))
    device.ramp = ramp
    outcome = run(plan(), device, Kept())
    assert isinstance(outcome.failure, DeviceError)
    assert "not confirmed safe: no answer; switch the rig off by hand" in outcome.reason
    assert kinds(outcome) == ["failed", "ramp", "unsafe"]
    assert outcome.events[0].text == "something else", "what began it is kept too"


def test_a_clock_that_does_not_stop_does_not_keep_the_ramp_away(device: ScriptedDevice) -> None:
    def halt() -> None:
        raise DeviceError("deaf")

    device.halt = halt
    outcome = run(plan(), device, Kept(), stopping(lambda: os.kill(os.getpid(), signal.SIGINT), 300))
    assert kinds(outcome) == ["halt", "safe"]
    assert made_safe(device)
