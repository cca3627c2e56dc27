"""Do the emulator and the firmware speak the same protocol, frame by frame, also with a host that makes mistakes?"""

import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from drivers.framing import MARKER, Frame, encode
from drivers.serial_messages import Condition, Description, Kind, pack_codes, unpack_range
from tests.rigs import GAIN
from tests.wire.emulated import Emulated, emulated
from tests.wire.simavr.bench import UNO, Board, on_simavr
from tests.wire.simavr.built import missing
from tests.wire.talk import Talk

SPEED = 4.0
FIFO = UNO.output_fifo


def emulator() -> AbstractContextManager[Emulated]:
    return emulated(GAIN, speed=SPEED, **{field.name: getattr(UNO, field.name) for field in fields(UNO)})


def firmware() -> AbstractContextManager[Board]:
    return on_simavr(GAIN, speed=SPEED, patience_s=0.0)  # here the host is slow on purpose


NEEDS_SIMAVR = pytest.mark.skipif(bool(missing()), reason=missing())


@pytest.fixture(scope="module", params=[emulator, pytest.param(firmware, marks=NEEDS_SIMAVR)],
                ids=["emulator", "firmware"])
def device(request: pytest.FixtureRequest) -> Iterator[Any]:
    make: Callable[[], AbstractContextManager[Any]] = request.param
    with make() as there:
        yield there


@pytest.fixture
def talk(device: Any) -> Iterator[Talk]:
    with Talk.at(device.path) as talk:
        yield talk


def test_it_has_put_nothing_out_yet_and_says_what_it_can(device: Any, talk: Talk) -> None:
    assert talk.level() == (None, "idle")
    assert device.look().level_v is None
    told = Description.read(talk.ask("CAP?").removeprefix("OK\n"))
    assert told.capabilities().output_bits == UNO.capabilities.output_bits
    assert (told.output_fifo, told.input_fifo, told.history) == (UNO.output_fifo, UNO.input_fifo, UNO.history)
    assert (told.clock_hz, told.watchdog_s) == (UNO.clock_hz, UNO.watchdog_s)
    can = UNO.capabilities
    assert (told.output_low_v, told.output_high_v) == (can.output_low_v, can.output_high_v)
    assert (told.input_low_v, told.input_high_v, told.input_bits) == (can.input_low_v, can.input_high_v, can.input_bits)
    assert told.inputs == can.inputs
    assert (told.min_rate_hz, told.max_rate_hz) == (can.min_rate_hz, can.max_rate_hz)


@pytest.mark.parametrize("command", [
    "", "BOOM", "ARM", "ARM 10", "ARM x 4000 0 100 1", "ARM 10 0 0 100 1", "ARM 10 4000 0.0 100 1",
    "ARM 10 4000 2048 100 1", "ARM -1 4000 0 100 1", "ARM 10 4000 0 100", "ARM 10 4000 0 100 0", "ARM 10 4000 0 100 2",
    "ARM 10 4000 0 100 1 really", "SAFE", "SAFE up 1", "SAFE -2048 0", "SAFE 0 -1", "SAFE 0 60001", "SAFE 0 0.5",
    "SAFE 0 0 0", "GO", "GO 1", "HALT 1", "LEVEL? 1", "ID? 1", "CAP? 1", "ID? " + "x" * 100,
])
def test_what_cannot_be_done_is_refused_and_changes_nothing(device: Any, talk: Talk, command: str) -> None:
    before = device.look().level_v
    assert talk.ask(command).startswith("ERROR ")
    assert talk.level()[1] == "idle"
    assert device.look().level_v == before


def test_a_command_repeated_under_its_number_is_done_once(talk: Talk) -> None:
    talk.arm(10)
    assert talk.ask("GO", 7) == "OK\n"
    assert talk.ask("GO", 7) == "OK\n"
    assert talk.ask("GO", 8).startswith("ERROR ")
    assert talk.ask("GO", 8).startswith("ERROR ")


@pytest.mark.parametrize("nonsense", [
    b"\n*** boot ***", MARKER, MARKER * 9, encode(Frame(Kind.COMMAND, 1, b"SAFE 2000 0"))[:-1] + b"\x00",
    encode(Frame(Kind.COMMAND, 1, b"SAFE 2000 0"))[:9] + b"\x00\x00SAFE 2000 0",
    encode(Frame(Kind.OUTPUT, 0, b"\0" * 99))[:40],
    MARKER + bytes(range(40)), encode(Frame(77, 1, b"?")), encode(Frame(Kind.REPLY, 1, b"OK")),
    encode(Frame(Kind.AGAIN, 0, b"short")), encode(Frame(Kind.AGAIN, 9, b"\xff" * 4 + b"\0" * 4)),
    encode(Frame(Kind.OUTPUT, 0, b"\0\0")), encode(Frame(77, 1, MARKER * 30)),
], ids=range(13))
def test_what_makes_no_sense_is_left_unanswered(device: Any, talk: Talk, nonsense: bytes) -> None:
    before = device.look().level_v
    talk.say(nonsense)
    for _ in range(60):  # the rest of a frame cut short is waited for, but not for ever
        talk.listen()
    assert not talk.heard
    assert talk.ask("ID?").startswith("OK\n")
    assert device.look().level_v == before


def test_frames_are_found_behind_nonsense(talk: Talk) -> None:
    talk.say(b"\xa5\x5a\x01 no header\xa5" + encode(Frame(Kind.COMMAND, 5, b"ID?")))
    assert talk.until(lambda: bool(talk.heard))
    assert (talk.heard[0].kind, talk.heard[0].number) == (Kind.REPLY, 5)


def test_a_run_is_read_and_put_out_sample_by_sample(device: Any, talk: Talk) -> None:
    codes = np.arange(1, 301, dtype=np.int32)
    talk.arm(300)
    talk.put(codes)
    assert talk.until(lambda: talk.accepted == 300)
    assert not talk.samples()
    assert talk.ask("GO") == "OK\n"
    assert talk.until(lambda: len(talk.samples()) == 300)
    ours, theirs = 10.0 / 2047, 12.5 / 511
    expected = np.rint(3.0 * np.concatenate([[0], codes[:-1]]) * ours / theirs)
    assert [talk.samples()[k] for k in range(300)] == expected.tolist()
    assert talk.conditions == Condition.FINE
    assert device.look().level_v == pytest.approx(300 * ours)
    assert talk.level() == (300, "running")


def test_output_samples_that_do_not_follow_are_told_and_not_taken(talk: Talk) -> None:
    codes = np.full(100, 5, dtype=np.int32)
    talk.arm(1000)
    talk.put(codes)
    assert talk.until(lambda: talk.accepted == 100)
    talk.put(codes[:48], start=148)
    assert talk.until(lambda: Condition.GAP in talk.conditions)
    talk.heard.clear()
    talk.put(codes[:50], start=80)  # thirty of these are new
    assert talk.until(lambda: talk.accepted == 130)
    talk.put(codes[:50], start=20)
    for _ in range(40):
        talk.listen()
    assert talk.accepted == 130
    assert talk.conditions == Condition.FINE


def test_output_samples_that_do_not_fit_are_not_taken(talk: Talk) -> None:
    codes = np.full(FIFO, 5, dtype=np.int32)
    talk.arm(1000)
    talk.put(codes)
    assert talk.until(lambda: talk.accepted == FIFO)
    talk.put(codes[:1], start=FIFO)
    assert talk.until(lambda: Condition.GAP in talk.conditions)
    assert talk.accepted == FIFO


def test_samples_damaged_on_the_way_are_not_taken(talk: Talk) -> None:
    talk.arm(1000)
    for at in range(12, 40, 3):
        damaged = bytearray(encode(Frame(Kind.OUTPUT, 0, pack_codes(np.full(16, 5, dtype=np.int32), 12))))
        damaged[at % len(damaged)] ^= 0x10
        talk.say(bytes(damaged))
    for _ in range(40):
        talk.listen()
    assert talk.statuses
    assert talk.accepted == 0


def test_input_samples_are_sent_again_and_what_is_not_kept_is_told_as_lost(talk: Talk) -> None:
    talk.arm(380)
    talk.put(np.arange(380, dtype=np.int32))
    assert talk.until(lambda: talk.accepted == 380)
    talk.ask("GO")
    assert talk.until(lambda: len(talk.samples()) == 380)
    talk.again(300, 370)
    assert talk.until(lambda: len(talk.samples(Kind.RESENT)) == 70)
    assert {k: talk.samples()[k] for k in range(300, 370)} == talk.samples(Kind.RESENT)
    talk.again(0, 20)
    assert talk.until(lambda: any(frame.kind == Kind.LOST for frame in talk.heard))
    assert [unpack_range(frame.payload) for frame in talk.heard if frame.kind == Kind.LOST] == [(0, 20)]
    assert len(talk.samples(Kind.RESENT)) == 70


def test_a_run_that_finds_no_sample_to_put_out_ramps_to_the_safe_level(device: Any, talk: Talk) -> None:
    talk.arm(1000, safe="-200 100")
    talk.put(np.full(100, 1500, dtype=np.int32))
    talk.ask("GO")
    assert talk.until(lambda: Condition.UNDERRUN in talk.conditions)
    assert talk.statuses[-1].played == 100
    assert not talk.statuses[-1].running
    assert talk.settles() == -200
    assert device.look().level_v == pytest.approx(-200 * 10.0 / 2047)


def test_a_host_that_falls_silent_in_a_run_makes_it_safe(device: Any, talk: Talk) -> None:
    talk.arm(10, safe="-300 100")
    talk.put(np.full(10, 1500, dtype=np.int32))
    talk.ask("GO")
    assert talk.until(lambda: Condition.WATCHDOG in talk.conditions)
    assert len(talk.samples()) == 10
    assert talk.settles() == -300
    assert device.look().level_v == pytest.approx(-300 * 10.0 / 2047)


def test_a_host_that_only_says_that_it_is_there_keeps_the_watchdog_quiet(talk: Talk) -> None:
    talk.arm(10, safe="-300 100")
    talk.put(np.full(10, 1500, dtype=np.int32))
    talk.ask("GO")
    for _ in range(160):
        talk.listen()
        talk.alive()
    assert talk.level() == (1500, "running")
    assert talk.conditions == Condition.FINE


def test_a_level_held_in_silence_is_made_safe_too(device: Any, talk: Talk) -> None:
    talk.ask("SAFE 0 0")
    talk.arm(1000, safe="0 0")
    talk.put(np.full(200, 1000, dtype=np.int32))
    talk.ask("GO")
    assert talk.until(lambda: bool(talk.samples()))
    talk.ask("HALT")
    assert talk.level() == (1000, "idle")
    assert talk.until(lambda: device.look().level_v == 0.0)


def test_a_ramp_passes_the_levels_between(talk: Talk) -> None:
    """Those of its middle in a second: a computer that was too busy to look in a quarter of that looks at another."""
    for _ in range(5):
        levels, unseen_s = _ramped(talk)
        if unseen_s < 0.25 or any(500 < level < 1500 for level in levels):
            break
    assert any(500 < level < 1500 for level in levels)


def _ramped(talk: Talk) -> tuple[list[int], float]:
    """Return the levels seen on a ramp from 0 to 2000, and the longest time without a look; it goes as it should."""
    talk.ask("SAFE 0 0")
    assert talk.settles() == 0
    began_s, levels = time.monotonic(), [0]
    looks_s = [began_s]
    talk.ask(f"SAFE 2000 {2000 * SPEED:.0f}")  # two seconds, as fast as devices go here
    while (now := talk.level())[1] == "ramping":
        assert now[0] is not None
        assert now[0] < 20 + 1.1e3 * (time.monotonic() - began_s)  # a board goes in steps, by a clock of its own
        levels.append(now[0])
        looks_s.append(time.monotonic())
    assert talk.level() == (2000, "idle")
    assert (np.diff(levels) >= 0).all()
    return levels, float(np.diff([*looks_s, time.monotonic()]).max())
