"""Is an answer that explained everything kept where a second look at the readings explains less?"""

import sys
from dataclasses import replace

import pytest

from identify.effects import catalogue
from identify.explain import explain
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, recorded

WAY = sys.modules[explain.__module__]  # the package has the function under its name
RAILS = (Concealed("saturation", {"upper": 9.0, "lower": -9.0}),)
RUNS = (staircase("walk", FIG13_LEVELS_V, 0.015, 2),)
EVERYTHING = tuple(catalogue())


@pytest.mark.parametrize("left_out", [EVERYTHING, ("hum",)])
def test_a_second_look_is_believed_unless_it_sees_less(left_out, monkeypatch):
    train = [recorded(OP_AMP, run, RAILS, 0.01, i, 2.0 * i, 8) for i, run in enumerate(RUNS)]
    test = [recorded(OP_AMP, sine("other", 12.5, 3.0, 2, 1), RAILS, 0.01, 9, 9.0, 8)]
    once, looks = WAY._looked_again, []

    def twice(readings, kept, data, look):
        looks.append(look.leave_out)
        reading, again = once(readings, kept, data, look)
        return (reading, replace(look, leave_out=left_out)) if not look.leave_out else (reading, again)

    monkeypatch.setattr(WAY, "_looked_again", twice)
    told = explain(model_of(OP_AMP), train, test)
    assert looks == [(), left_out]
    assert (told.verdict, [finding.id for finding in told.effects]) == ("explained", ["saturation"])
