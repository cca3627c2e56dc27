"""Are capabilities that no device has refused before anything is made of them?"""

from dataclasses import replace
from typing import Any

import pytest

from rig.capabilities import Capabilities
from rig.plausible import impossible

CAN = Capabilities(output_low_v=-10.0, output_high_v=10.0, input_low_v=-20.0, input_high_v=20.0, min_rate_hz=1.0,
                   max_rate_hz=1e6, output_bits=16, input_bits=24, buffer_samples=None, max_samples=None)


def test_what_devices_have_is_possible() -> None:
    assert impossible(CAN) is None
    assert impossible(replace(CAN, output_low_v=0.0, buffer_samples=1, max_samples=16_384, output_bits=32)) is None


@pytest.mark.parametrize(("change", "named"), [
    ({"output_bits": 64}, "output_bits = 64; allowed: 2 to 32"), ({"input_bits": 1}, "input_bits"),
    ({"output_high_v": -11.0}, "output_low_v"), ({"input_low_v": float("nan")}, "input_low_v"),
    ({"input_high_v": float("inf")}, "input_high_v"), ({"min_rate_hz": 0.0}, "min_rate_hz"),
    ({"max_rate_hz": 0.5}, "max_rate_hz"), ({"max_rate_hz": float("nan")}, "max_rate_hz"),
    ({"buffer_samples": 0}, "buffer_samples"), ({"max_samples": 1 << 60}, "max_samples"),
])
def test_what_no_device_has_is_named(change: dict[str, Any], named: str) -> None:
    assert named in str(impossible(replace(CAN, **change)))
