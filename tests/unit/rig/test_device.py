"""Does the device contract keep its checks, deadlines and order, whatever a driver does?"""

import numpy as np
import pytest

from rig.device import Block, Device, Flag, Identity
from rig.errors import DeviceError, RefusedError
from rig.plan import Limits
from tests.unit.rig.devices import ScriptedDevice, following

LIMITS = Limits(-5.0, 5.0, None)


@pytest.fixture
def device() -> ScriptedDevice:
    return ScriptedDevice()


def test_the_public_methods_cannot_be_overridden() -> None:
    public = ("identity", "capabilities", "achievable_rate", "quantise", "check", "stream", "safe", "level_v", "close")
    assert all(getattr(getattr(Device, name), "__final__", False) for name in public)


def test_nothing_is_begun_before_the_first_block_is_asked_for(device: ScriptedDevice) -> None:
    blocks = device.stream(np.zeros(300), 1000.0, LIMITS, 1.0, 0.2)
    assert "begin 1 V 0.2 s" not in device.diary
    next(blocks)
    assert "begin 1 V 0.2 s" in device.diary


def test_what_is_played_is_what_was_quantised(device: ScriptedDevice) -> None:
    u = np.linspace(-4.0, 4.0, 300)
    played = np.concatenate([block.y for block in device.stream(u, 1000.0, LIMITS)])
    assert np.array_equal(played, device.quantise(u))
    assert not np.array_equal(played, u)


def test_a_level_rounded_further_over_the_limit_is_refused(device: ScriptedDevice) -> None:
    lsb_v = device.capabilities().output_lsb_v
    limits = Limits(-5.0, 1000.2 * lsb_v, None)
    assert device.check(np.array([1000.4 * lsb_v]), 1000.0, limits)[0] == pytest.approx(1000 * lsb_v)
    with pytest.raises(RefusedError, match="at sample 0"):
        device.check(np.array([1000.65 * lsb_v]), 1000.0, limits)


def test_a_rate_between_two_of_the_clocks_is_refused_with_the_nearest(device: ScriptedDevice) -> None:
    with pytest.raises(RefusedError, match=r"30000\.0 Hz.*30303\.03.* Hz is the nearest"):
        device.stream(np.zeros(10), 30_000.0, LIMITS)


def test_a_run_beyond_the_memory_is_refused(device: ScriptedDevice) -> None:
    with pytest.raises(RefusedError, match="10001 samples; allowed: at most 10000"):
        device.stream(np.zeros(10_001), 1000.0, LIMITS)


def test_the_clock_is_stopped_however_the_run_ends(device: ScriptedDevice) -> None:
    list(device.stream(np.zeros(300), 1000.0, LIMITS))
    assert device.diary[-1] == "halt"
    blocks = device.stream(np.zeros(300), 1000.0, LIMITS)
    next(blocks)
    blocks.close()  # type: ignore[attr-defined]
    assert device.diary.count("halt") == 2


def test_a_driver_that_cannot_begin_is_halted(device: ScriptedDevice) -> None:
    def fail() -> None:
        raise DeviceError("no answer")

    device.begin = fail
    with pytest.raises(DeviceError, match="no answer"):
        next(device.stream(np.zeros(300), 1000.0, LIMITS))
    assert device.diary[-1] == "halt"


def test_the_first_failure_is_told_not_the_one_it_causes(device: ScriptedDevice) -> None:
    def fail(what: str) -> None:
        raise DeviceError(what)

    device.read = lambda position: fail("first")  # type: ignore[func-returns-value]
    device.halt = lambda: fail("second")
    with pytest.raises(DeviceError, match="first"):
        next(device.stream(np.zeros(300), 1000.0, LIMITS))


def test_a_clock_that_does_not_stop_is_told_when_nothing_else_failed(device: ScriptedDevice) -> None:
    def fail() -> None:
        raise DeviceError("still running")

    device.halt = fail
    with pytest.raises(DeviceError, match="still running"):
        list(device.stream(np.zeros(300), 1000.0, LIMITS))


def test_a_silent_device_is_given_up_after_the_deadline(
    device: ScriptedDevice, monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("rig.device.STALL_S", 0.05)
    device.read = lambda position: following(device.u, position) if position < 200 else None
    blocks = []
    with pytest.raises(DeviceError, match="fell silent: 200 of 300 samples"):
        blocks.extend(device.stream(np.zeros(300), 1000.0, LIMITS))
    assert any(block.y.size == 0 and block.start == 200 for block in blocks)


@pytest.mark.parametrize("wrong", [Block(50, np.zeros(100)), Block(250, np.zeros(100))], ids=["back", "beyond"])
def test_samples_out_of_order_are_refused(device: ScriptedDevice, wrong: Block) -> None:
    device.read = lambda position: following(device.u, position) if position < 100 else wrong
    with pytest.raises(DeviceError, match="out of order"):
        list(device.stream(np.zeros(300), 1000.0, LIMITS))


def test_inputs_that_together_are_too_fast_are_refused(device: ScriptedDevice) -> None:
    device.check(np.zeros(3), 50_000.0, LIMITS, inputs=3)
    with pytest.raises(RefusedError, match=r"2 x 100000 Hz; allowed: 150000 Hz over all inputs"):
        device.check(np.zeros(3), 100_000.0, LIMITS, inputs=2)
    device.check(np.zeros(3), 100_000.0, LIMITS)


def test_readings_of_other_inputs_than_were_asked_for_are_refused(device: ScriptedDevice) -> None:
    with pytest.raises(DeviceError, match="other inputs than were asked for: 1 inputs; allowed: 2"):
        list(device.stream(np.zeros(300), 1000.0, LIMITS, inputs=2))
    device.read = lambda position: Block(position, np.zeros(100), further=np.ones((1, 100)))
    assert all((block.further == 1).all() for block in device.stream(np.zeros(300), 1000.0, LIMITS, inputs=2))


def test_readings_of_different_instants_are_no_block() -> None:
    with pytest.raises(ValueError, match="beside"):
        Block(0, np.zeros(100), further=np.zeros((1, 99)))


def test_the_identity_is_asked_once_a_connection(device: ScriptedDevice) -> None:
    assert device.identity() == device.identity() == Identity("scripted", "0", "1")
    device.capabilities()
    assert device.diary == ["identity"]


def test_leaving_the_context_closes_once_and_leaves_the_output(device: ScriptedDevice) -> None:
    with device:
        device.close()
    assert device.diary == ["close"]


def test_flags_are_told_apart() -> None:
    assert {flag.value for flag in Flag if flag} == {1, 2, 4, 8}
