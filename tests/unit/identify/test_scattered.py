"""Is a contact that is made elsewhere every time told from noise in front of the gap, and what walks in the gap?"""

from dataclasses import replace
from itertools import accumulate

import numpy as np
import pytest

from identify.chain import signals
from identify.effects import chain_of
from identify.explain import explain
from identify.explain.plain import prepared
from identify.explain.scattered import scattered
from identify.holdout import split
from identify.stage import Place
from identify.wandering import gathered_of
from tests.proof.ask import known_effects
from tests.proof.cases import Concealed
from tests.proof.outside import pushed_about
from tests.proof.physics import borders
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded
from tests.unit.identify.test_wander import steps_of

NOISE_V = 0.004
WALKS = 400  # that give a standard deviation to 4 %
WALK, WAVE = staircase("walk", FIG13_LEVELS_V, 0.03, 4), sine("wave", 4.0, 3.0, 8, 1)
ELSEWHERE = Concealed("scattered_gap", {"sd": 0.01})
IN_FRONT = Concealed("process_noise", {"sd": 0.02, "bandwidth": 100.0})
HOLD, WIDE_HOLD = (Concealed("wandering_hold", {"sd": sd_v}) for sd_v in (0.05, 1.0))
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
    [
        ((), False), ((ELSEWHERE,), True), ((HOLD,), True), ((WIDE_HOLD,), True), ((IN_FRONT,), False),
        ((SLOW,), False), ((READING,), False),
    ],
)  # fmt: skip
def test_contact_made_elsewhere_every_time_is_told_from_noise_in_front_of_it(physics, elsewhere):
    assert scattered(*looked_at(physics)) is elsewhere


def test_nothing_is_scattered_where_nothing_could_be_taken_for_it():
    bench, plain = looked_at((ELSEWHERE,))
    assert not scattered(bench.of_kinds(kind for kind in bench.kinds if not kind.by_chance), plain)


@pytest.mark.parametrize("physics", [ELSEWHERE, WIDE_HOLD])
def test_what_scatters_in_f_is_no_noise_in_front_of_the_gap(physics):
    told = explain(model_of(OP_AMP), runs((physics,)), leave_out=OTHERS)
    assert (told.effects, told.location.stage) == ((), "F")


@pytest.mark.parametrize("sd_v", [0.003, 0.05, 1.0])
@pytest.mark.parametrize("run", [0, 1])
def test_what_holds_w_lets_it_walk_as_many_walks_between_moving_borders_do(sd_v, run):
    chain, o = chain_of(model_of(OP_AMP)), observed(runs(())[run], NOISE_V)
    v, w = (signals(chain, o.trace)[chain.index(place) - 1] for place in (Place.G1, Place.F))
    lower, upper = borders(v, OP_AMP)
    rng, step_v = np.random.default_rng(run), sd_v / np.sqrt(o.trace.rate_hz)
    walks = np.var([pushed_about(lower, upper, step_v * rng.standard_normal(w.size)) for _ in range(WALKS)], axis=0)
    it = gathered_of(chain, o, sd_v)
    steps = zip(np.square(it.keeps), it.gains * o.noise_v**2, strict=True)
    told = np.array(list(accumulate(steps, lambda there, step: step[0] * there + step[1], initial=0.0)))[1:]
    held = (w - lower > 1e-9) & (upper - w > 1e-9)
    assert np.sqrt(told[held].sum() / walks[held].sum()) == pytest.approx(1.0, abs=0.1)
    assert np.quantile(np.sqrt(told[held] / walks[held]), [0.05, 0.95]) == pytest.approx(1.0, abs=0.25)
    assert max(each[~held].sum() / each.sum() for each in (told, walks)) < 0.02  # a border ends it
