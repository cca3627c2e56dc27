"""Is a contact that is made elsewhere every time told from noise in front of the gap?"""

from dataclasses import replace

import pytest

from identify.explain import explain
from identify.explain.explain import prepared
from identify.explain.scattered import scattered
from identify.holdout import split
from tests.proof.ask import known_effects
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, recorded
from tests.unit.identify.test_wander import steps_of

NOISE_V = 0.004
WALK, WAVE = staircase("walk", FIG13_LEVELS_V, 0.03, 4), sine("wave", 4.0, 3.0, 8, 1)
ELSEWHERE = Concealed("scattered_gap", {"sd": 0.01})
IN_FRONT = Concealed("process_noise", {"sd": 0.02, "bandwidth": 100.0})
SLOW = Concealed("process_noise", {"sd": 0.01, "bandwidth": 15.0})
READING = Concealed("coloured_noise", {"sd": 0.01, "slope": 1.8})
OTHERS = sorted(known_effects() - {"process_noise", "curved_border"})


def runs(physics, seed=0):
    """Return two recordings of a rig, their repeats marked."""
    made = [(recorded(OP_AMP, run, physics, NOISE_V, seed + i, 5.0 * i, 8), run) for i, run in enumerate((WALK, WAVE))]
    return [replace(trace, steps=steps_of(run.segments)) for trace, run in made]


def looked_at(physics):
    """Return the bench and the plain fit of recordings."""
    model = model_of(OP_AMP)
    return prepared(model, split(model, runs(physics), []), OTHERS)


@pytest.mark.parametrize(
    ("physics", "elsewhere"),
    [((), False), ((ELSEWHERE,), True), ((IN_FRONT,), False), ((SLOW,), False), ((READING,), False)],
)
def test_contact_made_elsewhere_every_time_is_told_from_noise_in_front_of_it(physics, elsewhere):
    assert scattered(*looked_at(physics)) is elsewhere


def test_nothing_is_scattered_where_nothing_could_be_taken_for_it():
    bench, plain = looked_at((ELSEWHERE,))
    assert not scattered(bench.of_kinds(kind for kind in bench.kinds if not kind.by_chance), plain)


def test_a_scattered_contact_is_no_noise_in_front_of_the_gap():
    told = explain(model_of(OP_AMP), runs((ELSEWHERE,)), leave_out=OTHERS)
    assert (told.effects, told.location.stage) == ((), "F")
