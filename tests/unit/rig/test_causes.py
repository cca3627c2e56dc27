"""Is whatever beside the rig may have made a change suspected, and only that?"""

from types import SimpleNamespace
from typing import TYPE_CHECKING, cast

import numpy as np
import pytest

from identify.compared.device import ByDevice
from rig.causes import causes
from rig.differences import Difference
from rig.recorded import Equipment, Origin, Recording, complete_ledger

if TYPE_CHECKING:
    from identify.compared.comparison import Comparison

RUN = Recording(
    name="run", rate_hz=1000.0, u=np.arange(8.0), y=np.arange(8.0), ledger=complete_ledger(8),
    origin=Origin(Equipment("serial:/dev/a")),
)  # fmt: skip
PLAYED, SET = (Difference(aspect, what, "a", "b") for aspect, what in (("protocol", "steps"), ("device", "range")))
GAIN, RIG = ByDevice(0.6), ByDevice(1e-9)


def found(device: ByDevice | None = RIG, unproven: str = "", stage: str = "", late_s: tuple[float, float] = (0.0, 0.0),
          dead_time: str = "no change seen") -> "Comparison":  # fmt: skip
    """Return what a comparison says, as far as causes hang on it."""
    sides = [SimpleNamespace(observations=(SimpleNamespace(trace=SimpleNamespace(late_s=s)),)) for s in late_s]
    seen = (SimpleNamespace(id="adc_clipping", stage=stage, state="appeared"),) if stage else ()
    moved = (SimpleNamespace(name="G2.dead_time", state=dead_time),)
    return cast("Comparison", SimpleNamespace(
        device=device, unproven=unproven, physics=seen, before=sides[0], after=sides[1], changes=moved,
    ))  # fmt: skip


def states(told: "Comparison", *differ: Difference) -> tuple[str, ...]:
    return tuple(cause.state for cause in causes(told, differ, (RUN, RUN)))


def test_a_change_of_the_rig_alone_leaves_no_suspect() -> None:
    assert [c.aspect for c in causes(found(), (), (RUN, RUN))] == ["protocol", "device", "calibration"]
    assert states(found()) == ("ruled out", "ruled out", "ruled out")


def test_what_was_played_is_suspected_only_where_the_model_lacks_something() -> None:
    assert states(found(), PLAYED)[0] == "ruled out"
    assert states(found(unproven="it lacks something"), PLAYED)[0] == "cannot tell"
    assert states(found(unproven="it lacks something"))[0] == "ruled out"


def test_the_device_is_suspected_where_its_gains_would_do_the_same_or_physics_sits_where_it_is() -> None:
    assert states(found(GAIN))[1] == "cannot tell"
    assert states(found(stage="sense"))[1] == "cannot tell"
    assert states(found(None, stage="F"))[1] == "ruled out"
    assert states(found(None), SET)[1] == "cannot tell"
    assert states(found(RIG), SET)[1] == "ruled out"


def test_an_operator_is_told_what_would_tell() -> None:
    assert "`rig calibrate`" in causes(found(GAIN), (), (RUN, RUN))[1].sentence


@pytest.mark.parametrize(("late_s", "dead_time", "state"), [
    ((1e-4, 1e-4), "changed", "ruled out"), ((1e-4, 2e-4), "changed", "cannot tell"),
    ((1e-4, 2e-4), "no change seen", "ruled out"),
])  # fmt: skip
def test_delays_left_out_are_suspected_where_the_dead_time_moved(
    late_s: tuple[float, float], dead_time: str, state: str
) -> None:
    assert states(found(late_s=late_s, dead_time=dead_time))[2] == state


