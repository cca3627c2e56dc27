"""Is the Fig. 13 staircase, played by the firmware in simavr, identified and explained like the loopback?"""

from pathlib import Path

import pytest

from identify.model import Backlash
from rig import session
from rig.rigfile import read_rig
from tests.benchmarks.firmware_staircase import RIG, answer, firmware
from tests.wire.simavr.bench import UNO
from tests.wire.simavr.built import missing

STANDARD_ERRORS = 4.0


@pytest.mark.skipif(bool(missing()), reason=missing())
def test_the_firmware_tells_the_rails_its_own_steps_and_the_borders(tmp_path: Path) -> None:
    with firmware() as address:
        got = answer("firmware", address, 1000.0, tmp_path)
    told = got.told.to_dict()
    found = {effect["id"]: effect for effect in told["effects"]}  # type: ignore[attr-defined]
    assert told["verdict"] == "explained"
    assert set(found) == {"saturation", "adc_quantisation"}
    assert found["saturation"]["stage"] == "F"
    rails = found["saturation"]["parameters"]
    for name, level_v in (("upper", 10.0), ("lower", -10.0)):
        _holds(rails[name]["value"], rails[name]["ci95"], level_v)
    step = found["adc_quantisation"]["parameters"]["LSB"]
    _holds(step["value"], step["ci95"], UNO.capabilities.input_lsb_v)
    held = told["fit"]["held_out"]  # type: ignore[index, call-overload]
    assert held["after"] <= 1.1 * held["noise"] < 0.1 * held["before"]
    backlash = got.found.to_dict()["backlash"]
    truth = read_rig(session.shipped(RIG)).model.f
    assert isinstance(truth, Backlash)
    for name, value in (("S_L", truth.s_l), ("D_L", truth.d_l_v), ("S_U", truth.s_u), ("D_U", truth.d_u_v)):
        _holds(backlash[name]["value"], backlash[name]["ci95"], value)  # type: ignore[index, call-overload]


def _holds(value: float, ci95: list[float], truth: float) -> None:
    """Hold an estimate to the truth, by its own standard error."""
    assert value == pytest.approx(truth, abs=STANDARD_ERRORS * (ci95[1] - ci95[0]) / (2 * 1.96))
