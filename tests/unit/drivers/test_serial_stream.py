"""Does every sample arrive, or is known to be lost, when frames vanish in both directions?

Host and firmware are joined by a link that loses whole frames, in time that is only counted.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.emulators.bench import Bench
from drivers.emulators.device_model import DeviceModel, Hardware
from drivers.emulators.serial_firmware import SerialFirmware
from drivers.emulators.serial_pty import HARDWARE
from drivers.framing import Frame, FrameReader, encode
from drivers.serial_messages import Condition, Kind, Status, pack_codes, unpack_codes, unpack_range
from drivers.serial_stream import LINK_LOSS, OVERRUN, REPEAT_S, REQUESTS, Incoming, Outgoing
from rig.device import Flag
from rig.rigfile import parse_rig
from tests.rigs import GAIN


def codes(start: int, stop: int) -> np.ndarray:
    return np.arange(start, stop, dtype=np.int32)


def incoming(total: int, *parts: tuple[int, int]) -> Incoming:
    found = Incoming(total)
    for start, stop in parts:
        found.add(start, codes(start, stop))
    return found


def asked(frames: list[Frame]) -> list[tuple[int, int]]:
    return [unpack_range(frame.payload) for frame in frames]


def test_samples_are_handed_on_in_order_and_once() -> None:
    found = incoming(20, (0, 5), (10, 15))
    taken = found.take()
    assert taken is not None
    assert (taken[0], taken[1][:, 0].tolist(), taken[2]) == (0, [0, 1, 2, 3, 4], Flag.NONE)
    assert found.take() is None
    found.add(3, codes(3, 12))
    taken = found.take()
    assert taken is not None
    assert (taken[0], taken[1][:, 0].tolist()) == (5, list(range(5, 15)))


def test_what_arrives_twice_is_new_once() -> None:
    found = Incoming(10)
    assert found.add(0, codes(0, 4)) == 4
    assert found.add(2, codes(2, 6)) == 2
    assert found.add(0, codes(0, 6)) == 0


def test_every_gap_is_asked_for_at_once_and_again_later() -> None:
    found = incoming(100, (0, 10), (20, 30), (40, 50))
    found.sent(60)
    gaps = [(10, 20), (30, 40), (50, 60)]
    assert asked(found.wanted(0.0)) == gaps
    assert asked(found.wanted(0.5 * REPEAT_S)) == []
    assert asked(found.wanted(1.1 * REPEAT_S)) == gaps
    found.add(10, codes(10, 15))
    assert asked(found.wanted(1.2 * REPEAT_S)) == [], "the rest of the answer is still on its way"


def test_a_sample_asked_for_in_vain_is_given_up() -> None:
    found = incoming(30, (0, 10), (20, 30))
    times = [k * 1.1 * REPEAT_S for k in range(REQUESTS + 1)]
    assert [len(found.wanted(now_s)) for now_s in times] == [1] * REQUESTS + [0]
    assert found.take() is not None
    taken = found.take()
    assert taken is not None
    assert (taken[0], taken[2]) == (20, Flag.LINK_LOSS)
    assert found.settled


def test_the_cause_of_a_loss_is_told_with_the_samples_after_it() -> None:
    found = incoming(30, (20, 25))
    found.lost(0, 10, OVERRUN)
    assert found.take() is None
    found.lost(10, 20, LINK_LOSS)
    taken = found.take()
    assert taken is not None
    assert (taken[0], taken[1].size, taken[2]) == (20, 5, Flag.OVERRUN | Flag.LINK_LOSS)


def test_a_lost_end_is_an_empty_block_at_the_end() -> None:
    found = incoming(30, (0, 20))
    found.lost(20, 30, OVERRUN)
    assert found.take() is not None
    taken = found.take()
    assert taken is not None
    assert (taken[0], taken[1].size, taken[2]) == (30, 0, Flag.OVERRUN)
    assert found.take() is None


def test_samples_of_another_run_are_refused() -> None:
    found = Incoming(10)
    with pytest.raises(ValueError, match="not of this run"):
        found.add(8, codes(8, 12))
    with pytest.raises(ValueError, match="not of this run"):
        found.lost(8, 12, OVERRUN)


def status(accepted: int, played: int = 0, condition: Condition = Condition.FINE) -> Status:
    return Status(True, condition, accepted, played, 0)


def reach(frames: list[Frame]) -> int:
    """Return where ``frames`` of 16-bit samples end; they must follow each other."""
    for one, other in pairwise(frames):
        assert one.number + len(one.payload) // 2 == other.number
    return frames[-1].number + len(frames[-1].payload) // 2 if frames else -1


def test_the_fifo_is_filled_and_not_more() -> None:
    out = Outgoing(codes(0, 5000), 16, fifo=1000, window=10_000)
    assert reach(out.due()) == 1000
    assert out.due() == []
    assert not out.filled
    out.heard(status(1000), 0.0)
    assert out.filled
    out.heard(status(1000, 300), 0.1)
    assert reach(out.due()) in range(1000 + 300 - 127, 1301)


def test_no_more_than_the_window_is_under_way() -> None:
    out = Outgoing(codes(0, 5000), 16, fifo=1024, window=512)
    assert reach(out.due()) == 512
    out.heard(status(256), 0.0)
    assert reach(out.due()) == 768


def test_a_gap_is_sent_again_from_where_it_began() -> None:
    out = Outgoing(codes(0, 900), 16, fifo=4000, window=4000)
    assert reach(out.due()) == 900
    out.heard(status(256, condition=Condition.GAP), 0.0)
    out.heard(status(256, condition=Condition.GAP), 0.01)
    again = out.due()
    assert again[0].number == 256
    assert reach(again) == 900


def test_word_of_one_gap_by_every_frame_behind_it_is_answered_once() -> None:
    out = Outgoing(codes(0, 4000), 16, fifo=8000, window=8000)
    gap = status(512, condition=Condition.GAP)
    out.due()
    out.heard(gap, 0.0)
    sent = []
    for now_s in (0.01, 0.02, 0.03):
        out.heard(gap, now_s)
        sent.append(sum(len(frame.payload) for frame in out.due()))
    assert sent == [2 * (4000 - 512), 0, 0]
    out.heard(gap, 0.05)
    assert out.due()[0].number == 512, "the answer was lost itself"


def test_a_device_that_lags_is_not_drowned_in_repetitions() -> None:
    out = Outgoing(codes(0, 4000), 16, fifo=8000, window=8000)
    repeats = []
    for tick in range(200):
        out.heard(status(0), tick * 0.01)
        if out.due():
            repeats.append(tick * 0.01)
    assert repeats == pytest.approx([0.0, 0.16, 0.32, 0.63, 1.24, 1.85], abs=0.02)


def test_silence_about_what_was_sent_makes_it_be_sent_again() -> None:
    out = Outgoing(codes(0, 900), 16, fifo=4000, window=4000)
    out.heard(status(0), 0.0)
    out.due()
    out.heard(status(0), 0.5 * REPEAT_S)
    assert out.due() == []
    out.heard(status(0), 1.5 * REPEAT_S)
    assert reach(out.due()) == 900


@pytest.mark.parametrize("impossible", [status(901), status(2**32 - 1, 2**32 - 1), status(100, 200)])
def test_a_status_that_cannot_be_changes_nothing(impossible: Status) -> None:
    out = Outgoing(codes(0, 2000), 16, fifo=900, window=4000)
    assert reach(out.due()) == 900
    with pytest.raises(ValueError, match="accepted of 900 samples sent"):
        out.heard(impossible, 0.0)
    assert not out.filled
    assert out.due() == []


def test_the_end_is_sent_even_when_it_is_short() -> None:
    out = Outgoing(codes(0, 1010), 16, fifo=1000, window=4000)
    out.due()
    out.heard(status(1000, 10), 0.1)
    assert reach(out.due()) == 1010


def joined(total: int, losses: Callable[[], bool], rate_hz: float = 2000.0) -> tuple[np.ndarray, np.ndarray, Flag]:
    """Play ``total`` samples over a link where ``losses()`` tells for every frame whether it vanishes."""
    hardware = Hardware(HARDWARE.identity, HARDWARE.capabilities, 1024, 1024, 8192, HARDWARE.clock_hz, 2.0)
    model = DeviceModel(hardware, Bench(parse_rig(GAIN, "test"), hardware.capabilities))
    firmware, reader, now_s = SerialFirmware(model), FrameReader(), 0.0
    u = (codes(0, total) * 7) % 3000
    out, back, flags, y = Outgoing(u, 16, 1024, 1024), Incoming(total), Flag.NONE, np.full(total, -1, dtype=np.int32)

    def tell(*frames: Frame) -> None:
        for frame in frames:
            if not losses():
                firmware.receive(encode(frame), now_s)

    def step() -> None:
        tell(*out.due(), *back.wanted(now_s), Frame(Kind.ALIVE, 0))
        firmware.advance(now_s)
        while sent := firmware.transmit(now_s):
            for frame in reader.feed(sent):
                if losses():
                    continue
                if frame.kind in (Kind.INPUT, Kind.RESENT):
                    back.add(frame.number, unpack_codes(frame.payload, 24))
                elif frame.kind == Kind.LOST:
                    back.lost(*unpack_range(frame.payload), OVERRUN)
                elif frame.kind == Kind.STATUS:
                    heard = Status.unpack(frame.payload)
                    out.heard(heard, now_s)
                    back.sent(heard.sent)

    firmware.receive(encode(Frame(Kind.COMMAND, 1, f"ARM {total} {round(48e6 / rate_hz)} 0 100 1".encode())), 0.0)
    while not out.filled:
        now_s += 0.005
        step()
    firmware.receive(encode(Frame(Kind.COMMAND, 2, b"GO")), now_s)
    end, position = now_s + total / rate_hz + 10, 0
    while position < total and now_s < end:
        now_s += 0.005
        step()
        if (taken := back.take()) is not None:
            y[taken[0]:taken[0] + taken[1].size] = taken[1][:, 0]
            flags, position = flags | taken[2], taken[0] + taken[1].size
    volts = model.bench.dac.volts(np.concatenate([[0], u[:-1]])) * 3.0
    return y, model.bench.adc.codes(volts), flags


@settings(max_examples=15, deadline=None)
@given(st.integers(1, 4000), st.integers(0, 2**32 - 1), st.floats(0.0, 0.2))
def test_every_sample_arrives_though_frames_vanish(total: int, seed: int, share: float) -> None:
    random = np.random.default_rng(seed)
    y, expected, flags = joined(total, lambda: bool(random.random() < share))
    assert np.array_equal(y, expected)
    assert flags == Flag.NONE


def test_frames_of_codes_hold_what_they_say() -> None:
    frame = Outgoing(codes(5, 10), 16, 100, 100).due()[0]
    assert frame == Frame(Kind.OUTPUT, 0, pack_codes(codes(5, 10), 16))
