"""Is a line that no repeat brings back found at its frequency, and never in noise?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.chain import plain_chain
from identify.explain.anew import LINE, line_anew
from identify.explain.wander import compared
from identify.trace import Step
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V, LINE_HZ = 0.005, 438.2
CHAIN = plain_chain(model_of(OP_AMP))
STIMULI = (staircase("walk", FIG13_LEVELS_V, 0.02), sine("wave", 10.0, 3.0, 2, 6), sine("fast", 40.0, 3.0, 4, 6))


def seen(*physics, seed=0, repeated=True):
    """Return runs that say what was repeated in them, or not."""
    found = []
    for number, stimulus in enumerate(STIMULI):
        run = recorded(OP_AMP, stimulus, physics, NOISE_V, 10 * seed + number)
        steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in stimulus.segments)
        found.append(observed(replace(run, steps=steps if repeated else ()), NOISE_V))
    return found


def humming(place):
    """Return a line free of the stimulus."""
    amplitude = {"G1": 0.03, "sense": 0.004}[place]
    return Concealed(f"hum at {place}", {"frequency": LINE_HZ, "amplitude": amplitude, "third": 0.0, "fifth": 0.0})


@pytest.mark.parametrize("place", ["G1", "sense"])
def test_a_line_free_of_the_stimulus_is_found_at_its_frequency(place):
    hz, chance = line_anew(CHAIN, seen(humming(place)))
    assert hz == pytest.approx(LINE_HZ, abs=2.0)  # a stretch is 0.1 or 0.2 s long
    assert chance < LINE


@pytest.mark.parametrize("physics", [
    (),
    (Concealed("curved_border", {"k2": 0.0, "k3": 0.03}),),
    (Concealed("process_noise", {"sd": 0.03, "bandwidth": 300.0}),),
], ids=["nothing", "what comes back", "noise in front of the gap"])  # fmt: skip
def test_no_line_is_found_in_noise_nor_in_what_comes_back(physics):
    chances = [line_anew(CHAIN, seen(*physics, seed=seed))[1] for seed in range(4)]
    assert min(chances) > LINE


def test_without_repeats_nothing_is_told():
    assert line_anew(CHAIN, seen(humming("G1"), repeated=False)) == (0.0, 1.0)


def test_a_repeat_that_was_cut_is_compared_as_far_as_it_goes():
    whole = seen()[1]
    size = whole.trace.size - 7
    trace = replace(whole.trace, u=whole.trace.u[:size], y=whole.trace.y[:size])
    cut = replace(whole, trace=trace, use=whole.use[:size])
    pairs = [(once, again) for once, again, _ in compared(cut, cut.residual(CHAIN))]
    assert len(pairs) == len(whole.trace.steps) - 1
    once, again = pairs[-1]
    assert again.stop == size
    assert once.stop - once.start == again.stop - again.start
    assert np.all([a.stop - a.start == b.stop - b.start for a, b in pairs])


def test_a_repeat_that_was_cut_off_before_it_began_is_none():
    whole = seen()[1]
    size = whole.trace.steps[-1].start - 7
    trace = replace(whole.trace, u=whole.trace.u[:size], y=whole.trace.y[:size])
    cut = replace(whole, trace=trace, use=whole.use[:size])
    pairs = list(compared(cut, cut.residual(CHAIN)))
    assert len(pairs) == len(whole.trace.steps) - 2
    assert all(again.stop <= size and both.size == again.stop - again.start for _, again, both in pairs)
