"""Is a law that jumps or bends found at its levels and at its place, where a smooth map is not it?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.chain import simulate
from identify.effects import chain_of
from identify.explain.bench import Bench
from identify.explain.corners import again, slid
from identify.explain.free_form import slid_on, with_corners
from identify.explain.locate import DISGUISE, LIKELY, Located, doubted, located
from identify.explain.prove import proven
from identify.explain.shape import shape_of
from identify.explain.side_by_side import fitted_from
from identify.explain.suspect import suspect
from identify.stage import Place
from identify.trace import Step
from identify.unnamed.maps import BrokenMap, OuterMap
from identify.unnamed.past import Swiftness
from identify.unnamed.timed import Moments
from tests.proof.cases import Concealed
from tests.proof.integrator import read_when
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, Stimulus, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
STEADY = replace(OP_AMP, noise_v=NOISE_V)
WALK, WAVE = staircase("walk", FIG13_LEVELS_V, 0.02), sine("wave", 20.0, 3.0, 3, 1)
TWICE, AGAIN = staircase("walk", FIG13_LEVELS_V, 0.04, 2), sine("wave", 20.0, 3.0, 6, 2)
FAST = sine("fast", 60.0, 9.0, 6, 1)
DEAD = Concealed("crossover", {"dead": 0.6})


def bench(*physics: Concealed, runs: tuple[Stimulus, ...] = (WALK, WAVE)) -> Bench:
    """Return short recordings of the op-amp rig with physics concealed in it, their steps as played."""
    bare = [recorded(OP_AMP, s, physics, NOISE_V, i, 3.0 * i, 8) for i, s in enumerate(runs)]
    steps = [tuple(Step(g.label, g.kind, g.start, g.stop, g.repeat) for g in s.segments) for s in runs]
    traces = [replace(trace, steps=played) for trace, played in zip(bare, steps, strict=True)]
    return Bench(chain_of(model_of(OP_AMP)), tuple(observed(trace, NOISE_V, 1) for trace in traces), (), ())


def found(there: Bench) -> Located:
    return located(there, there.fitted(there.plain, ()))


def added(told: Located, level: float) -> float:
    """Return what the best law adds at a level, V."""
    values = told.fitted[0][1].fit.chain.values
    weights = np.array([values[p.name] for p in told.best.parameters()])
    return float(weights @ told.best.shapes(np.array([level]))[:, 0])


def test_a_missing_code_is_one_jump_at_its_level_in_the_reading():
    there = bench(Concealed("missing_code", {"step": 0.2, "level": 3.3}), runs=(WALK,))
    told = found(there)
    assert (told.best.place, told.best.form) == (Place.SENSE, BrokenMap.form)
    rise = added(told, 3.35) - added(told, 3.25)
    assert rise == pytest.approx(0.2, abs=0.02)  # a jump, or a steep ramp that no reading tells from it
    assert abs(added(told, 3.25) - added(told, 0.0)) < 0.03
    assert told.share > 0.99
    assert told.places[Place.SENSE] + told.places[Place.G2] > 0.99  # G2 rounds a jump in front of it, not one behind
    assert told.places[Place.SENSE] == pytest.approx(1.0 / (1.0 + DISGUISE), abs=0.01)  # of the same data the likelier


def test_a_dead_middle_of_w_is_found_at_f_and_proven_on_another_run():
    """A class-B stage without bias: w loses what lies between its corners."""
    there = bench(DEAD)
    told = found(there)
    assert (told.best.place, told.best.form) == (Place.F, BrokenMap.form)
    low, high = told.best.knots[0], told.best.knots[-1]
    assert high - low == pytest.approx(1.2, abs=0.15)  # less by what jumps at its ends make
    lost = added(told, low - 0.01) - added(told, high + 0.01)  # by a ramp, or a jump that no reading tells from it
    assert lost == pytest.approx(1.2, abs=0.1)  # where the middle is hangs on where the borders are said to cross
    other = recorded(OP_AMP, sine("other", 12.5, 3.0, 2, 1), (DEAD,), NOISE_V, 9, 9.0, 8)
    proof = proven(there, told, [observed(other, NOISE_V, 1)])
    assert proof is not None
    assert proof.held_out_v < 1.3 * NOISE_V
    drawn = shape_of(proof.correction, proof.hypothesis.fit, there.observations)
    assert drawn is not None
    assert drawn.axis == "level of w"
    middle = (drawn.at > low + 0.1) & (drawn.at < high - 0.1)
    slope = np.polyfit(drawn.at[middle], drawn.curves[0][middle], 1)[0]
    assert slope == pytest.approx(-1.0, abs=0.15)  # nothing of w passes there
    assert np.all(drawn.halves[0] < 0.2)


def test_a_jump_beside_a_bend_is_how_far_its_corner_is_off():
    """A rail above, a rail below and a code that is off: what no line comes to is no corner that is off."""
    law = OuterMap(Place.F, (-2.0, 0.5, 3.0))
    weights = dict(zip([p.name for p in law.parameters()], (0.1, 0.4, 0.2, -1.0, -1e-3, -1.0), strict=True))
    there = slid(law, weights)
    assert there is not None
    moved, joined = there
    assert moved.knots == pytest.approx((-2.1, 0.5, 3.2))
    assert [*joined.values()] == pytest.approx([0.0, 0.4, 0.0, -1.0, -1e-3, -1.0])
    level = np.linspace(-4.0, 5.0, 91)
    before, after = (one.shapes(level).T @ [*w.values()] for one, w in ((law, weights), (moved, joined)))
    apart = (np.abs(level + 2.05) > 0.06) & (np.abs(level - 3.1) > 0.11)  # all but what lies between old and new
    assert np.allclose(before[apart], after[apart])
    assert slid(moved, joined) is None


def test_corners_that_are_off_slide_to_the_rails_while_all_other_values_follow():
    there = bench(Concealed("saturation", {"upper": 9.0, "lower": -9.0}))
    off = OuterMap(Place.F, (-9.6, 9.5))
    begun = there.fitted(off.put_in(there.plain, dict.fromkeys(("unnamed.bend1", "unnamed.bend2"), -1.0)), ())
    law, found = slid_on(there, there.fitted(there.plain, ()), off, begun)
    assert begun.misfit > 1.0
    assert found.misfit < 0.02
    assert law.knots == pytest.approx((-9.0, 9.0), abs=0.01)


def test_corners_that_act_on_the_wrong_side_of_zero_are_turned():
    """To first order either side will do: the plain values make up for a straight line, but far from it they do not."""
    there = bench(Concealed("saturation", {"upper": 9.0, "lower": -9.0}))
    base, inwards = there.fitted(there.plain, ()), BrokenMap(Place.F, (-9.0, 9.0))
    begun = fitted_from(there, base, suspect(there.evidence(base), inwards))
    law, found = with_corners(there, base, inwards, begun)
    assert begun.misfit > 0.1
    assert found.misfit < 0.02
    assert type(law) is OuterMap


def test_a_law_of_v_is_less_likely_than_one_of_w_that_explains_as_much():
    """A border passes each level of w at one of v: corners there do the same, and nobody builds a filter with them."""
    there = bench(DEAD)
    evidence = there.evidence(there.fitted(there.plain, ()))
    at_f, at_g1 = (again(evidence, BrokenMap(place, (0.5,))) for place in (Place.F, Place.G1))
    each = at_f.looks / len(at_f.correction.knots)
    assert each > 0.0
    assert at_g1.looks - each * len(at_g1.correction.knots) > 3.0  # a log of odds


def test_a_delay_that_grows_with_the_level_enters_at_g1():
    told = found(bench(Concealed("level_dependent_delay", {"k": 1e-4}), runs=(WALK, WAVE, FAST)))
    assert next(iter(told.places)) == Place.G1
    assert told.places[Place.G1] > 0.9
    assert told.best.form == Swiftness.form


def test_what_leaves_something_has_the_others_fitted_though_it_might_be_noise(monkeypatch):
    """What is known of the noise's size would let it be all, but other corrections still find something in it."""
    runs = (WALK, WAVE, FAST)
    there = replace(bench(Concealed("level_dependent_delay", {"k": 1e-4}), runs=runs), noise_known=1.0)
    first = found(there)
    assert first.fitted[0][1].misfit < 1.0
    assert Swiftness.form not in {law.form for law, _ in first.fitted}
    told = doubted(there, first)
    assert (told.best.form, told.best.place, told.doubt) == (Swiftness.form, Place.G1, 0.0)
    assert told.places[Place.G1] > 0.9
    assert {law.form for law, _ in first.fitted} < {law.form for law, _ in told.fitted}
    monkeypatch.setattr("identify.explain.locate.steady", lambda *fit: False)  # as of lines that are not in all runs
    assert doubted(there, first).fitted == first.fitted


def test_dynamics_over_the_level_read_the_signal_when_they_say():
    """Against the bench's own reading at other times, interpolated by a cubic."""
    trace = recorded(OP_AMP, WAVE, fine=4)
    late = Swiftness(Place.G2, (-20.0, 0.0, 20.0))
    plain = chain_of(model_of(OP_AMP))
    answer = simulate(plain, trace)
    values = {p.name: -2.3e-3 for p in late.parameters()}
    time_s = np.arange(answer.size) / trace.rate_hz
    shifted = read_when(answer, time_s - 2.3e-3, 1.0 / trace.rate_hz)
    settled = slice(200, None)
    assert np.abs(simulate(late.put_in(plain, values), trace) - shifted)[settled].max() < 2e-3


@pytest.mark.parametrize("rate", [3.0, 9.0])
def test_a_contact_that_opens_now_and_then_is_told_as_moments_at_f(rate):
    """What it does is gone between the moments: drifts and maps see next to nothing of it."""
    there = bench(Concealed("lost_contact", {"rate": rate, "length": 4e-3}), runs=(TWICE, AGAIN))
    told = found(there)
    assert told.significant
    assert (told.best.place, told.best.form) == (Place.F, Moments.form)
    likely = [place for place, odds in told.places.items() if odds > LIKELY]
    assert likely == [Place.F, Place.G1, Place.SOURCE]  # what opens in front of F leaves w as it is, too
    assert told.places[Place.F] > 0.6
