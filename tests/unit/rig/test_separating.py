"""May what separates be longer than what is compared whole, and is it said of what it separates alone?"""

from pathlib import Path

import numpy as np
import pytest

from identify.explain.contenders import Contender
from identify.explain.explanation import Alternative, Finding
from identify.explain.separate import Separation
from identify.trace import Trace
from rig.limits import Limits
from rig.separating import MOST_SAMPLES, Written, _room, with_protocols
from rig.workflow import Runs
from tests.proof.rigs import OP_AMP
from tests.trials import model_of
from tests.unit.identify.page.test_report import explanation


@pytest.mark.parametrize(("samples", "expected_s"), [(10**6, 20.0), (10**8, MOST_SAMPLES / 50_000.0)])
def test_a_protocol_is_as_long_as_the_recordings_or_as_is_compared_whole(samples, expected_s):
    silent = np.broadcast_to(0.0, samples)
    runs = Runs((Trace("run", 50_000.0, silent, silent),), (), model_of(OP_AMP))
    assert _room(runs, Limits(-5.0, 5.0), None).time_s == pytest.approx(expected_s)


def found(name, stage, others=()):
    return Finding(name, stage, "form", 0.6, {}, "", "", tuple(Alternative(*o, 0.3) for o in others), "a cable")


def test_what_separates_is_said_of_the_set_and_of_what_was_located_alone():
    """Readings without a name, found in themselves, enter nowhere else."""
    pole, readings, law = found("extra_pole", "G1", [("dead_time", "G2")]), found("unnamed", "F"), found("unnamed", "F")
    members = Contender("unnamed", "F", 0.6), Contender("unnamed", "sense", 0.4)
    separation = Separation("unnamed", "F", members, (), 2.0, 12.0, (), "2 s of it")
    told = with_protocols(explanation(effects=(pole, readings, law)), [Written(separation, Path("separate.yaml"))])
    assert [f.would_separate for f in told.effects] == ["a cable", "a cable", "separate.yaml: 2 s of it"]
    assert not explanation(effects=(readings, law)).is_open
    assert explanation(effects=(readings, law), entered=members).is_open
    assert explanation(effects=(pole,)).is_open
