"""Is the op-amp backlash circuit as drawn? An example: one file for the mock, an emulator, the firmware, the hardware.

``pytest tests/hardware`` plays on the loopback; ``--rig-device emulated:serial`` on an emulated board on a real port;
``--rig-device serial:/dev/ttyACM0`` on the board itself.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from identify.joint import identify
from rig.device import Device
from rig.recorded import Recording
from rig.rigfile import parse_rig

PROTOCOL = Path(__file__).with_name("gap.yaml")
DRAWN_V, TOLERANCE_V = 2.5, 0.05


def test_the_gap_is_as_wide_as_drawn(rig_record: Callable[[str | Path], Recording]) -> None:
    recording = rig_record(PROTOCOL)
    found = identify(parse_rig(recording.rig_text, "the rig").model, [recording.trace()])
    gap_v = found.own_scale["D_L"].value - found.own_scale["D_U"].value
    assert abs(gap_v - DRAWN_V) < TOLERANCE_V


def test_the_device_reaches_the_levels_of_the_protocol(rig_device: Device) -> None:
    can = rig_device.capabilities()
    assert can.output_low_v <= -5.0
    assert can.output_high_v >= 5.0
    assert np.abs(rig_device.quantise(np.array([-5.0, 5.0])) - [-5.0, 5.0]).max() <= can.output_lsb_v


@pytest.mark.rig_hardware
def test_the_board_says_who_it_is(rig_device: Device) -> None:
    """On hardware only: an emulator has no serial number worth a line in a test report."""
    assert rig_device.identity().serial not in ("", "?")
