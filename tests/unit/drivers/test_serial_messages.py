"""Do the messages of the serial DAQ survive the way there and back, and is nonsense refused?"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.emulators.serial_firmware import description
from drivers.emulators.serial_pty import HARDWARE
from drivers.serial_messages import (
    Condition,
    Description,
    Status,
    named,
    pack_codes,
    pack_range,
    unpack_codes,
    unpack_range,
)


@given(st.integers(2, 32), st.data())
def test_codes_of_any_width_come_back(bits: int, data: st.DataObject) -> None:
    top = (1 << (bits - 1)) - 1
    codes = np.array(data.draw(st.lists(st.integers(-top, top))), dtype=np.int32)
    packed = pack_codes(codes, bits)
    assert len(packed) == codes.size * ((bits + 7) // 8)
    assert np.array_equal(unpack_codes(packed, bits), codes)


def test_codes_are_little_endian_twos_complement() -> None:
    assert pack_codes(np.array([1, -2]), 16) == b"\x01\x00\xfe\xff"
    assert pack_codes(np.array([-1, 0x123456]), 24) == b"\xff\xff\xff\x56\x34\x12"


def test_half_a_sample_is_refused() -> None:
    with pytest.raises(ValueError, match="3-byte samples"):
        unpack_codes(b"1234", 24)


@given(st.booleans(), st.integers(0, 15), st.tuples(*[st.integers(0, 2**32 - 1)] * 3))
def test_a_status_comes_back(running: bool, condition: int, numbers: tuple[int, int, int]) -> None:
    status = Status(running, Condition(condition), *numbers)
    assert Status.unpack(status.pack()) == status


def test_a_status_of_another_size_is_refused() -> None:
    with pytest.raises(ValueError, match="13 bytes where 14"):
        Status.unpack(bytes(13))


def test_a_range_comes_back_and_a_reversed_one_is_refused() -> None:
    assert unpack_range(pack_range(3, 9)) == (3, 9)
    with pytest.raises(ValueError, match="no range"):
        unpack_range(pack_range(9, 3))


def test_a_description_comes_back_exactly() -> None:
    told = description(HARDWARE)
    assert Description.read(told.text()) == told
    assert told.capabilities().output_bits == HARDWARE.capabilities.output_bits


def test_a_description_without_a_field_is_refused() -> None:
    text = description(HARDWARE).text().replace("clock_hz", "clock_khz")
    with pytest.raises(ValueError, match="does not tell its clock_hz"):
        Description.read(text)


def test_lines_without_a_name_are_left_out() -> None:
    assert named("OK\na=1\n\nb=x=y") == {"a": "1", "b": "x=y"}
