"""Does a recording play as the device that made it, and only what it knows?"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.replay import ReplayDevice
from rig import session
from rig.device import Block, Flag
from rig.errors import FileError, RefusedError, UsageError
from rig.plan import Limits
from rig.recorded import Entry, Equipment, Origin, Recording, complete_ledger
from rig.recording import read, write
from tests.flow.console import protocol

LIMITS = Limits(-10.0, 10.0, None)
ASIDE = "drivers.replay:ReplayDevice:"  # its address wherever the package was installed before the driver was there


def recording(name: str = "table", size: int = 9000, model: str = "") -> Recording:
    """Return a recording that tells nothing of the ranges of its device, as an imported one."""
    u = np.sin(np.arange(size) * 0.01)
    origin = Origin(Equipment("imported", model), started="x", finished="y")
    return Recording(name, 1000.0, u, 2.0 * u, complete_ledger(size), origin)


def blocks(device: ReplayDevice, kept: Recording) -> list[Block]:
    return list(device.stream(kept.u[:], kept.rate_hz, LIMITS))


def test_a_protocol_played_on_its_own_recording_gives_it_again(tmp_path: Path) -> None:
    path = protocol(tmp_path)
    first = session.record(path, None, tmp_path / "first.h5", lambda done, total: None)
    again = session.record(path, f"{ASIDE}{tmp_path / 'first.h5'}", tmp_path / "again.h5", lambda done, total: None)
    assert again.outcome.complete
    assert np.array_equal(again.recording.y, first.recording.y)
    assert np.array_equal(again.recording.u, first.recording.u)
    assert again.recording.origin.equipment.model == "replay of loopback"


def test_another_protocol_is_refused_before_any_output_and_told_how_far_it_agrees(tmp_path: Path) -> None:
    session.record(protocol(tmp_path), None, tmp_path / "first.h5", lambda done, total: None)
    other = protocol(tmp_path, ("amplitude: 5 V", "amplitude: 4 V"), name="other.yaml")
    same = next(step.start for step in read(tmp_path / "first.h5").steps if step.kind == "sine")
    with pytest.raises(RefusedError, match=r"these samples were not recorded: (\d+) of \d+ samples") as refused:
        session.check(other, f"{ASIDE}{tmp_path / 'first.h5'}")
    assert abs(int(str(refused.value.value).split()[0]) - same) <= 1  # both sines begin at 0 V
    assert not (tmp_path / "other.h5").exists()


def test_the_beginning_of_a_recording_is_one_too() -> None:
    kept = recording()
    read_back = np.concatenate([block.y for block in ReplayDevice([kept]).stream(kept.u[:5000], 1000.0, LIMITS)])
    assert np.array_equal(read_back, kept.y[:5000])


def test_gaps_stay_gaps_and_a_lost_tail_stays_lost() -> None:
    kept = recording()
    ledger, y = kept.ledger.copy(), kept.y[:].copy()
    ledger[100:200], ledger[8000:] = Entry.LOST, Entry.NOT_RECEIVED
    y[ledger != Entry.RECORDED] = np.nan
    played = blocks(ReplayDevice([kept]), kept)
    assert all(block.flags == Flag.NONE for block in played)
    gappy = blocks(ReplayDevice([replace(kept, y=y, ledger=ledger)]), kept)
    seen = np.full(9000, np.nan)
    for block in gappy:
        seen[block.start:block.stop] = block.y
    assert np.array_equal(seen, y, equal_nan=True)
    assert [(block.start, block.flags) for block in gappy if block.flags] == [
        (200, Flag.LINK_LOSS), (9000, Flag.LINK_LOSS)]


def test_several_recordings_answer_as_one_device() -> None:
    one = recording()
    two = replace(one, u=np.zeros(50), y=np.ones(50), ledger=complete_ledger(50), rate_hz=500.0)
    device = ReplayDevice([one, two])
    assert device.achievable_rate(600.0) == 500.0
    assert np.array_equal(blocks(device, two)[0].y, np.ones(50))
    with pytest.raises(RefusedError, match="1 of 9000 samples"):
        device.check(one.u[:], 500.0, LIMITS)


def test_what_is_no_recording_of_one_device_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="different devices"):
        ReplayDevice([recording("a", model="A"), recording("b", model="B")])
    with pytest.raises(UsageError, match=r"as in replay:RUN\.h5"):
        ReplayDevice.connect("")
    with pytest.raises(FileError, match="no such recording"):
        ReplayDevice.connect(str(tmp_path / "none.h5"))
    with pytest.raises(FileError, match="no recording in this folder"):
        ReplayDevice.connect(str(tmp_path))
    write(tmp_path / "one.h5", recording())
    assert ReplayDevice.connect(str(tmp_path)).identity().model == "replay of unknown device"
