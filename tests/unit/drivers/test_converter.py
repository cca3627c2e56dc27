"""Do codes and voltages correspond as the device contract says?"""

import numpy as np
import pytest

from drivers.converter import Converter, adc, dac
from rig.device import Capabilities
from rig.errors import RefusedError

CAN = Capabilities(output_low_v=-10.0, output_high_v=10.0, input_low_v=0.0, input_high_v=5.0, min_rate_hz=1.0,
                   max_rate_hz=1000.0, output_bits=16, input_bits=10)


def test_zero_and_both_ends_are_exact() -> None:
    converter = dac(CAN)
    assert converter.volts(np.array([0, converter.top, -converter.top])).tolist() == [0.0, 10.0, -10.0]


def test_codes_and_voltages_are_inverse() -> None:
    for converter in (dac(CAN), adc(CAN)):
        codes = np.arange(-converter.top, converter.top + 1, dtype=np.int32)
        assert np.array_equal(converter.codes(converter.volts(codes)), codes)


def test_the_step_is_the_one_the_contract_tells() -> None:
    assert dac(CAN).lsb_v == CAN.output_lsb_v == 20.0 / 65534
    assert adc(CAN).lsb_v == CAN.input_lsb_v == 5.0 / 1022


def test_beyond_the_range_the_end_is_read_and_known_as_such() -> None:
    converter = Converter(0.0, 5.0, 10, saturates=True)
    codes = converter.codes(np.array([-1.0, 2.5, 7.0]))
    assert converter.volts(codes) == pytest.approx([0.0, 2.5, 5.0])
    assert converter.clipped(codes)
    assert not converter.clipped(codes[1:2])
    assert not converter.clipped(codes[:0])


@pytest.mark.parametrize("beyond", [5.1, -0.1, float("nan"), float("inf")])
def test_a_dac_is_never_silently_given_another_level_than_was_asked_for(beyond: float) -> None:
    converter = Converter(0.0, 5.0, 10, saturates=False)
    with pytest.raises(RefusedError, match=r"out of the converter's range: .*allowed: 0 to 5 V"):
        converter.codes(np.array([1.0, beyond]))
    assert converter.codes(np.array([0.0, 5.0])).tolist() == [-converter.top, converter.top]
