"""May what separates be longer than what is compared whole, and is it said of what it separates alone?"""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from identify.explain.contenders import Contender
from identify.explain.explanation import Alternative, Finding
from identify.explain.separate import Separation
from identify.trace import Trace
from rig import followup
from rig.followup import Round, _unasked
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


MEMBERS = Contender("unnamed", "F", 0.6), Contender("unnamed", "sense", 0.4)
PLACES = Separation("unnamed", "F", MEMBERS, (), 2.0, 12.0, (), "2 s of it")


def test_where_something_enters_is_asked_once_and_its_name_as_often_as_it_is_open():
    places, names = (Written(s, Path("separate.yaml")) for s in (PLACES, replace(PLACES, id="extra_pole")))
    assert _unasked((places, names), []) == (places, names)
    assert _unasked((places, names), [Round((names,), ())]) == (places, names)
    assert _unasked((places, names), [Round((places,), ())]) == (names,)


@pytest.mark.parametrize(("name", "rounds"), [("unnamed", 1), ("extra_pole", 2)])
def test_what_stays_open_is_played_for_once_if_it_is_of_places_and_again_if_not(monkeypatch, name, rounds):
    told, left = explanation(), (Written(replace(PLACES, id=name), Path("separate.yaml")),)
    answers = {
        "workflow.load": SimpleNamespace(traces=(), rig=None), "session.at_rig": "device",
        "workflow.explain_runs": told, "workflow.revised": told, "_written": left, "_recorded": (Path("separate.h5"),),
    }  # fmt: skip
    for what, answer in answers.items():
        monkeypatch.setattr(f"rig.followup.{what}", lambda *_, answer=answer: answer)
    followed = followup.explain(followup.Asked(("run.h5",), None, (), Path(), "device"), lambda sentence, share: None)
    assert [each.written for each in followed.rounds] == [left] * rounds
    assert followed.open == left


def test_what_separates_is_said_of_the_set_and_of_what_was_located_alone():
    """Readings without a name, found in themselves, enter nowhere else."""
    pole, readings, law = found("extra_pole", "G1", [("dead_time", "G2")]), found("unnamed", "F"), found("unnamed", "F")
    told = with_protocols(explanation(effects=(pole, readings, law)), [Written(PLACES, Path("separate.yaml"))])
    assert [f.would_separate for f in told.effects] == ["a cable", "a cable", "separate.yaml: 2 s of it"]
    assert not explanation(effects=(readings, law)).is_open
    assert explanation(effects=(readings, law), entered=MEMBERS).is_open
    assert explanation(effects=(pole,)).is_open
