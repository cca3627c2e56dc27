"""Is everything told in which two recordings differ, and nothing else?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.interval import Interval
from identify.trace import Step
from rig.calibration import Calibration
from rig.differences import Difference, differences, first_apart
from rig.outputs import json_text
from rig.recorded import Entry, Equipment, Origin, Recording, complete_ledger

PLAIN = Recording(
    name="run", rate_hz=1000.0, u=np.arange(8.0), y=np.arange(8.0), ledger=complete_ledger(8),
    origin=Origin(Equipment("serial:/dev/a", "DAQ", "7", "1.0", {"range": "10 V"}), {"h5py": "3.0"}, "abc"),
    protocol_text="spec: 1\ntitle: a\n", rig_text="spec: 1\n", steps=(Step("hold", "hold", 0, 8),),
)  # fmt: skip


def equipped(equipment: Equipment) -> Recording:
    return replace(PLAIN, origin=replace(PLAIN.origin, equipment=equipment))


def told(after: Recording) -> set[tuple[str, str, str, str]]:
    return {(d.aspect, d.what, d.before, d.after) for d in differences(PLAIN, after)}


def test_the_same_settings_differ_in_nothing_whatever_was_read() -> None:
    later = replace(PLAIN, name="later", y=np.ones(8), origin=replace(PLAIN.origin, started="2026-01-01"))
    assert differences(PLAIN, later) == ()


def test_a_sample_of_u_is_found_to_the_last_bit() -> None:
    u = np.arange(8.0)
    u[5] = np.nextafter(5.0, 6.0)
    assert [d.what for d in differences(PLAIN, replace(PLAIN, u=u))] == ["u, first at sample 5"]
    assert first_apart(PLAIN.u, PLAIN.u) is None


OTHER = PLAIN.origin.equipment
CASES = [
    (replace(PLAIN, protocol_text="spec: 1\ntitle: b\n"),
     ("protocol", "protocol", "line 2: title: a", "line 2: title: b")),
    (replace(PLAIN, protocol_text=""), ("protocol", "protocol", "line 1: spec: 1", "none")),
    (replace(PLAIN, protocol_text="spec: 1\n"), ("protocol", "protocol", "line 2: title: a", "ends at line 1")),
    (replace(PLAIN, protocol_text="spec: 1\r\ntitle: a\n"),
     ("protocol", "protocol", "the same lines", "with other line ends")),
    (replace(PLAIN, rate_hz=2000.0), ("protocol", "sample rate", "1000 Hz", "2000 Hz")),
    (replace(PLAIN, intersample="linear"), ("protocol", "u between samples", "held", "linear")),
    (replace(PLAIN, initial="in_motion"), ("protocol", "rig at first", "rest", "in_motion")),
    (equipped(replace(OTHER, serial="8")), ("device", "serial", "7", "8")),
    (equipped(replace(OTHER, settings={"range": "1 V"})), ("device", "range", "10 V", "1 V")),
    (equipped(replace(OTHER, settings={})), ("device", "range", "10 V", "none")),
    (replace(PLAIN, complete=False, reason="stopped"), ("readings", "complete", "yes", "no: stopped")),
    (replace(PLAIN, ledger=np.full(8, Entry.LOST)), ("readings", "samples not recorded", "0", "8")),
    (replace(PLAIN, rig_text="spec: 2\n"), ("rig file", "rig file", "line 1: spec: 1", "line 1: spec: 2")),
    (replace(PLAIN, origin=replace(PLAIN.origin, software={"h5py": "4.0"})), ("program", "h5py", "3.0", "4.0")),
    (replace(PLAIN, origin=replace(PLAIN.origin, git_commit="")), ("program", "git commit", "abc", "none")),
]  # fmt: skip


@pytest.mark.parametrize(("after", "difference"), CASES, ids=[row[1][1] + row[1][3] for row in CASES])
def test_one_thing_that_differs_is_told_alone(after: Recording, difference: tuple[str, str, str, str]) -> None:
    assert told(after) == {difference}


def test_calibrations_are_told_by_their_numbers() -> None:
    tight = Interval(1e-4, 9e-5, 1.1e-4)
    kept = Calibration("DAQ", "7", "1.0", 1000.0, (-10.0, 10.0, -10.0, 10.0), 1.0, "2026-01-01T00:00:00+00:00", tight,
                       tight, tight, tight, tight, tight, None, {})  # fmt: skip
    other = replace(kept, delay=Interval(2e-4, 1.9e-4, 2.1e-4))
    before, after = (equipped(replace(OTHER, calibration=json_text(c.to_dict()))) for c in (kept, other))
    assert differences(before, after) == (Difference("calibration", "delay", "100 µs ± 10 µs", "200 µs ± 10 µs"),)
    assert {d.what for d in differences(PLAIN, before)} == {"made", "delay", "gain", "offset"}
