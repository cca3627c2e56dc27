"""Is every sample accounted for, whatever was lost and however the run ended?"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.trace import Step
from rig.block import Block, Flag
from rig.errors import DeviceError
from rig.plan import Limits, Plan
from rig.recorded import Entry, Equipment, Recording
from rig.recording import Writer, read
from rig.runner import Outcome, run
from tests.unit.rig.devices import ScriptedDevice

SIZE, RATE_HZ = 600, 1000.0
EDGES = (0, 250, 400, SIZE)
STEPS = tuple(Step(label, "table", a, b) for label, a, b in zip("abc", EDGES[:-1], EDGES[1:], strict=True))
U = np.linspace(-4.0, 4.0, SIZE)
Pieces = list[tuple[int, int]]


def replayed(pieces: Pieces, fails: bool) -> tuple[Recording, Outcome, np.ndarray]:
    """Run a device that loses and then delivers so many samples, piece by piece; return what was delivered, too."""
    device, delivered, left = ScriptedDevice(), np.zeros(SIZE, dtype=bool), list(pieces)

    def deliver(position: int) -> Block:
        if not left:
            if fails:
                raise DeviceError("the cable is off")
            return Block(SIZE, np.empty(0), Flag.LINK_LOSS)
        lost, size = left.pop(0)
        start = min(position + lost, SIZE)
        stop = min(start + size, SIZE)
        delivered[start:stop] = True
        return Block(start, device.u[start:stop], Flag.OVERRUN if lost else Flag.NONE)

    device.read = deliver
    plan = Plan("a run", U, RATE_HZ, STEPS, Limits(-5.0, 5.0))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.h5"
        with Writer(path, plan, Equipment("scripted:"), device.quantise(U)) as writer:
            outcome = run(plan, device, writer)
            writer.finish(outcome.complete, outcome.reason, outcome.events)
        return read(path), outcome, delivered


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.sampled_from([0, 0, 0, 1, 90]), st.integers(1, 200)), max_size=9), st.booleans())
def test_every_sample_is_recorded_lost_or_not_received(pieces: Pieces, fails: bool) -> None:
    recording, outcome, delivered = replayed(pieces, fails)
    here = recording.ledger == Entry.RECORDED
    assert np.array_equal(here, delivered)
    assert np.array_equal(recording.y[here], recording.u[here]), "a sample stands at another's place"
    assert np.isnan(recording.y[~here]).all()
    assert outcome.samples == recording.count(Entry.RECORDED)
    assert sum(recording.count(entry) for entry in Entry) == SIZE
    last = int(np.flatnonzero(delivered).max(initial=-1)) + 1
    assert not (recording.ledger[:last] == Entry.NOT_RECEIVED).any(), "a gap was closed up in silence"
    assert outcome.complete == delivered.all()


@settings(max_examples=15, deadline=None)
@given(st.lists(st.tuples(st.sampled_from([0, 0, 1, 90]), st.integers(1, 200)), max_size=9))
def test_the_steps_told_incomplete_are_those_that_lost_samples(pieces: Pieces) -> None:
    recording, outcome, _ = replayed(pieces, fails=False)
    told = {(event.start, event.stop) for event in outcome.events if event.kind == "incomplete"}
    lost = recording.ledger == Entry.LOST
    assert told == {(step.start, step.stop) for step in STEPS if lost[step.start:step.stop].any()}
