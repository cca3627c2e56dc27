"""Is a step that lost samples on a real port played again in a segment of its own, or reported, as it was asked?"""

from pathlib import Path

import numpy as np
import pytest

from drivers.emulators.faults import Fault, Faults, What
from rig import session, workflow
from rig.errors import FileError, IncompleteError
from rig.recording import Entry, read
from tests.rigs import GAIN
from tests.wire.emulated import emulated

PROTOCOL = """
spec: 1
title: two sines
question: Is what was lost played again?
rig: rig.yaml
limits: {level: 6 V}
acquisition: {rate: 4 kHz}
safe_level: 1 V
on_overrun: retry 2
steps:
  - {label: slow, sine: {frequency: 8 Hz, amplitude: 5 V, periods: 4}}
  - {label: fast, repeats: 2, sine: {frequency: 16 Hz, amplitude: 4 V, periods: 4}}
"""
SLOW, FAST = 2000, 1000
MUTE = Fault(What.MUTE, at_sample=2100, seconds=0.18)
"""Longer than a FIFO of 512 samples lasts, over before the pass is."""


def record(folder: Path, address: str, text: str = PROTOCOL, overwrite: bool = False) -> session.Recorded:
    (folder / "rig.yaml").write_text(GAIN)
    (folder / "protocol.yaml").write_text(text)
    out = folder / "run.h5"
    return session.record(folder / "protocol.yaml", address, out, lambda done, total: None, overwrite)


def test_what_the_device_could_not_hold_is_played_again_with_a_preconditioning(tmp_path: Path) -> None:
    with emulated(GAIN, faults=Faults((MUTE,)), input_fifo=512) as bench:
        done = record(tmp_path, bench.address)
        assert bench.look().level_v == pytest.approx(1.0, abs=1e-3)
    assert done.outcome.complete
    assert [path.name for path in done.paths] == ["run.h5", "run.retry1.h5"]
    first, second = map(read, done.paths)
    assert (first.complete, first.initial, second.complete, second.initial) == (False, "rest", True, "in_motion")
    assert [(event.start, event.stop) for event in first.events if event.kind == "incomplete"] == [(SLOW, SLOW + FAST)]
    assert [step.label for step in second.steps] == ["preconditioning", "fast", "fast"]
    lead = second.steps[1].start
    assert np.array_equal(second.u[lead:], first.u[SLOW:])
    for recording, before_v in ((first, 0.0), (second, 1.0)):
        here = recording.ledger == Entry.RECORDED
        answer = 3.0 * np.concatenate([[before_v], recording.u[:-1]])
        assert np.abs(recording.y - answer)[here][1:].max() < 1e-5
        assert sum(recording.count(entry) for entry in Entry) == recording.u.size
        assert np.isnan(recording.y[~here]).all()
    assert first.count(Entry.LOST) > 50
    assert [trace.from_rest for trace in workflow.load(done.paths).traces] == [True, False]


def test_where_the_protocol_says_so_the_loss_is_reported_and_the_run_goes_on(tmp_path: Path) -> None:
    with emulated(GAIN, faults=Faults((MUTE,)), input_fifo=512) as bench:
        done = record(tmp_path, bench.address, PROTOCOL.replace("retry 2", "report"))
    assert isinstance(done.outcome.failure, IncompleteError)
    assert [path.name for path in done.paths] == ["run.h5"]
    recording = read(done.paths[0])
    assert recording.ledger[-1] == Entry.RECORDED
    assert recording.count(Entry.NOT_RECEIVED) == 0
    assert recording.count(Entry.LOST) == recording.u.size - done.outcome.samples > 50


def test_retries_that_lose_samples_too_end_incomplete_with_all_kept(tmp_path: Path) -> None:
    always = Fault(What.MUTE, to="GO", times=99, seconds=0.3)
    with emulated(GAIN, faults=Faults((always,)), input_fifo=256) as bench:
        done = record(tmp_path, bench.address, PROTOCOL.replace("retry 2", "retry 1"))
    assert isinstance(done.outcome.failure, IncompleteError)
    assert [read(path).complete for path in done.paths] == [False, False]
    assert all(read(path).count(Entry.RECORDED) > 100 for path in done.paths)


def test_retries_of_an_earlier_run_are_not_mixed_with_this_ones(tmp_path: Path) -> None:
    (tmp_path / "run.retry1.h5").touch()
    with pytest.raises(FileError, match="retry of another run"):
        record(tmp_path, "loopback:")
    done = record(tmp_path, "loopback:", overwrite=True)
    assert [path.name for path in done.paths] == ["run.h5"]
    assert not (tmp_path / "run.retry1.h5").exists()
