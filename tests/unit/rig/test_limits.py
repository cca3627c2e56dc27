"""Is the narrowest of the limits of protocol and rig file the one that counts, and named where it refuses?"""

from pathlib import Path

import pytest

from rig.errors import FileError, MisfitError, RefusedError
from rig.limits import Limits
from rig.plan import plan
from rig.protocol import Protocol, parse_protocol
from tests.rigs import GAIN

PROTOCOL = """
spec: 1
title: a step
question: How far may it go?
rig: rig.yaml
limits: {limits}
acquisition: {{rate: 1 kHz}}
ramp: 1 s
steps:
  - table: {{times: [0 s, 0.1 s], levels: [0 V, {level} V], between: linear}}
"""


def protocol(folder: Path, rig_limits: str, limits: str = "{level: 10 V}", level: float = 5.0) -> Protocol:
    (folder / "rig.yaml").write_text(f"{GAIN}limits: {rig_limits}\n" if rig_limits else GAIN)
    return parse_protocol(PROTOCOL.format(limits=limits, level=level), str(folder / "protocol.yaml"))


@pytest.mark.parametrize(("rig_limits", "both"), [
    ("", Limits(-10.0, 10.0, 100.0)), ("{level: 6 V}", Limits(-6.0, 6.0, 100.0)),
    ("{low: 0 V, high: 20 V}", Limits(0.0, 10.0, 100.0)), ("{level: 20 V, slew: 60 V/s}", Limits(-10.0, 10.0, 60.0)),
    ("{level: 20 V, slew: 200 V/s}", Limits(-10.0, 10.0, 100.0)),
])
def test_the_narrower_counts_on_each_side(tmp_path: Path, rig_limits: str, both: Limits) -> None:
    found = protocol(tmp_path, rig_limits, "{level: 10 V, slew: 100 V/s}").limits
    assert found == both
    assert bool(found.narrowed_by) == (both != Limits(-10.0, 10.0, 100.0))


def test_a_level_beyond_the_rigs_limit_is_refused_and_the_rig_named(tmp_path: Path) -> None:
    assert plan(protocol(tmp_path, "{level: 5.1 V}")).peak_v == pytest.approx(4.95)
    with pytest.raises(RefusedError, match=r"allowed: -4.9 to 4.9 V \(narrowed by the rig file rig.yaml\)"):
        plan(protocol(tmp_path, "{level: 4.9 V}"))


def test_a_slope_beyond_the_rigs_limit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RefusedError, match=r"too steep: .*at most 40 V/s \(narrowed by the rig file"):
        plan(protocol(tmp_path, "{level: 10 V, slew: 40 V/s}"))


def test_limits_with_nothing_in_common_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match=r"limits.*no common level: -1 to 1 V; allowed: 2 to 3 V in the rig file"):
        protocol(tmp_path, "{low: 2 V, high: 3 V}", "{level: 1 V}")


def test_limits_within_nothing_are_themselves() -> None:
    own = Limits(-1.0, 2.0, 3.0)
    assert own.within(None, "nobody") is own
    assert own.within(Limits(-5.0, 5.0), "a wide rig") is own
    with pytest.raises(MisfitError):
        own.within(Limits(3.0, 4.0), "another rig")
