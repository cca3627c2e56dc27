"""Is what happened once, for a moment, told where all recordings together leave no more than noise?"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from identify.effects import catalogue, chain_of
from identify.explain import explain
from identify.explain.bench import Bench
from identify.explain.locate import Located, located
from identify.explain.moments import wandering
from identify.explain.wander import PROVEN
from identify.stage import Place
from identify.trace import Step, Trace
from identify.unnamed.timed import Moments
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
WALK, WAVE = staircase("walk", FIG13_LEVELS_V, 0.04, 2), sine("wave", 20.0, 3.0, 40, 2)


def recordings(*physics: Concealed) -> list[Trace]:
    """Return recordings of everything twice, with the steps that say so."""
    steps = [tuple(Step(g.label, g.kind, g.start, g.stop, g.repeat) for g in s.segments) for s in (WALK, WAVE)]
    made = [recorded(OP_AMP, s, physics, NOISE_V, i, 3.0 * i, 8) for i, s in enumerate((WALK, WAVE))]
    return [replace(trace, steps=played) for trace, played in zip(made, steps, strict=True)]


def bench_of(traces: Sequence[Trace]) -> Bench:
    """Return the bench of recordings."""
    return Bench(chain_of(model_of(OP_AMP)), tuple(observed(trace, NOISE_V, 1) for trace in traces), (), ())


def found(traces: Sequence[Trace]) -> Located:
    """Return what is located, of a mismatch that is no more than noise on the whole."""
    bench = bench_of(traces)
    plain = bench.fitted(bench.plain, ())
    assert plain.chi2 - plain.count < PROVEN * np.sqrt(2.0 * plain.count)
    return located(bench, plain)


def touched(trace: Trace, *at: int) -> Trace:
    """Return a recording whose readings were off by six times the noise for twelve of them, from each of some on."""
    y = np.array(trace.y)
    for first in at:
        y[first : first + 12] += 6.0 * NOISE_V
    return replace(trace, y=y)


def test_what_happened_once_is_told_where_and_may_have_come_in_anywhere_behind_g1() -> None:
    walk, wave = recordings()
    told = found([walk, touched(wave, 6200)])
    assert told.significant
    assert (told.best.place, told.best.form) == (Place.SENSE, Moments.form)
    there = [k for k, a in zip(told.best.knots, weights(told), strict=True) if a]
    assert there
    assert there == pytest.approx([wave.start_s + 6206.0 / wave.rate_hz] * len(there), abs=1.2e-3)
    assert Place.F in told.alternatives()


def test_an_operator_is_told_that_it_happened_at_single_moments_and_when() -> None:
    walk, wave = recordings()
    other = recorded(OP_AMP, sine("other", 12.5, 3.0, 2, 1), (), NOISE_V, 9, 9.0, 8)
    told = explain(model_of(OP_AMP), [walk, touched(wave, 6200)], [other]).to_dict()
    assert told["verdict"] == "unexplained"
    assert "differ from the simulation at single moments, by" in told["sentence"]
    (where,) = told["location"]["where"]
    assert where["axis"] == "clock time"
    assert where["from"] <= wave.start_s + 6212.0 / wave.rate_hz
    assert where["to"] >= wave.start_s + 6200.0 / wave.rate_hz
    assert where["to"] - where["from"] < 0.05


def weights(told: Located) -> list[float]:
    """Return the weights of the best correction."""
    values = told.fitted[0][1].fit.chain.values
    return [values[p.name] for p in told.best.parameters()]


def test_what_every_repeat_has_is_no_moment() -> None:
    walk, wave = recordings()
    told = found([walk, touched(wave, 6200, 6200 + wave.size // 2)])
    assert Moments.form not in [correction.form for correction, _ in told.fitted]


def test_what_has_no_repeat_beside_it_may_be_the_stimulus() -> None:
    walk, wave = recordings()
    assert not found([walk, replace(touched(wave, 6200), steps=())]).significant


def test_beside_what_acts_by_chance_a_moment_may_be_of_its_making() -> None:
    walk, wave = recordings()
    bench, noise = bench_of([walk, touched(wave, 6200)]), catalogue()["process_noise"](Place.G1, "white")
    shaken = noise.put_in(bench.plain, {"sd": 1e-9})
    told = [list(wandering(bench.evidence(bench.fitted(chain, (), 0)).fine)) for chain in (bench.plain, shaken)]
    assert [len(each) for each in told] == [1, 0]


def test_so_many_moments_that_none_is_where_f_rests_are_of_f() -> None:
    told = found(recordings(Concealed("lost_contact", {"rate": 6.0, "length": 1e-3})))
    assert told.significant
    assert (told.best.place, told.best.form) == (Place.F, Moments.form)
