"""Are frames found again, whatever the link does to the bytes between them?"""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.framing import MARKER, MAX_PAYLOAD, OVERHEAD, Frame, FrameReader, encode

FRAMES = st.lists(
    st.builds(Frame, st.integers(0, 255), st.integers(0, 2**32 - 1), st.binary(max_size=40) | st.just(MARKER * 7)),
    min_size=1, max_size=5,
)


def pieces(data: bytes, cuts: list[int]) -> list[bytes]:
    at = sorted({0, len(data), *(cut % (len(data) + 1) for cut in cuts)})
    return [data[a:b] for a, b in pairwise(at)]


def read(data: bytes, cuts: list[int] | None = None) -> tuple[list[Frame], FrameReader]:
    reader, found = FrameReader(), []
    for piece in pieces(data, cuts or []):
        found += reader.feed(piece)
    return found, reader


@given(FRAMES, st.lists(st.integers(0, 10**6), max_size=8))
def test_frames_survive_split_reads(frames: list[Frame], cuts: list[int]) -> None:
    found, reader = read(b"".join(map(encode, frames)), cuts)
    assert found == frames
    assert reader.skipped == 0


@given(FRAMES, st.lists(st.binary(max_size=30), min_size=6, max_size=6), st.lists(st.integers(0, 10**6), max_size=8))
def test_garbage_between_frames_is_skipped_and_counted(
    frames: list[Frame], garbage: list[bytes], cuts: list[int],
) -> None:
    data = b"".join(junk + encode(frame) for junk, frame in zip(garbage, frames, strict=False))
    found, reader = read(data, cuts)
    assert found == frames
    assert reader.skipped == sum(len(junk) for junk, _ in zip(garbage, frames, strict=False))


@given(FRAMES, st.data())
def test_lost_bytes_cost_only_the_frame_they_were_in(frames: list[Frame], data: st.DataObject) -> None:
    hit = data.draw(st.integers(0, len(frames) - 1))
    raw = encode(frames[hit])
    first = data.draw(st.integers(0, len(raw) - 1))
    last = data.draw(st.integers(first + 1, len(raw)))
    stream = [encode(frame) for frame in frames]
    stream[hit] = raw[:first] + raw[last:]
    assert read(b"".join(stream))[0] == frames[:hit] + frames[hit + 1:]


@given(FRAMES, st.data())
def test_a_changed_byte_costs_only_the_frame_it_is_in(frames: list[Frame], data: st.DataObject) -> None:
    hit = data.draw(st.integers(0, len(frames) - 1))
    raw = bytearray(encode(frames[hit]))
    raw[data.draw(st.integers(0, len(raw) - 1))] ^= data.draw(st.integers(1, 255))
    stream = [encode(frame) for frame in frames]
    stream[hit] = bytes(raw)
    assert read(b"".join(stream))[0] == frames[:hit] + frames[hit + 1:]


def test_a_frame_inside_the_wreck_of_a_long_one_does_not_wait_for_its_end() -> None:
    long, short = Frame(4, 7, bytes(MAX_PAYLOAD)), Frame(2, 9, b"OK")
    assert read(encode(long)[:300] + encode(short))[0] == [short]


def test_every_single_bit_error_is_seen() -> None:
    raw = encode(Frame(3, 5, b"payload"))
    for bit in range(8 * len(raw)):
        broken = bytearray(raw)
        broken[bit // 8] ^= 1 << bit % 8
        assert FrameReader().feed(bytes(broken)) == []


def test_a_payload_too_long_is_refused() -> None:
    with pytest.raises(ValueError, match="at most 2048"):
        encode(Frame(1, 0, bytes(MAX_PAYLOAD + 1)))


def test_a_frame_is_as_long_as_the_protocol_says() -> None:
    assert len(encode(Frame(1, 0, b"abc"))) == OVERHEAD + 3 == 18


def test_clearing_forgets_half_a_frame() -> None:
    reader, raw = FrameReader(), encode(Frame(1, 2, b"x" * 50))
    assert reader.feed(raw[:30]) == []
    reader.clear()
    assert reader.feed(raw[30:]) == []
    assert reader.feed(raw) == [Frame(1, 2, b"x" * 50)]
