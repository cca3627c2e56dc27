"""Is an answer that explained everything kept where a second look at the readings explains less?"""

import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest

from identify.effects import catalogue, chain_of
from identify.explain import explain
from identify.explain.bench import Bench
from identify.explain.hidden import hides_blemishes
from identify.explain.locate import located
from identify.explain.readings import Look, _looked, read
from identify.explain.warrant import Warranted
from identify.interval import Interval
from identify.readings import blemishes
from identify.readings.mend import Mended
from identify.readings.missing_samples import MissingSamples
from identify.stage import Place
from identify.unnamed.timed import OffsetOverClock
from tests.proof.ask import known_effects, parted
from tests.proof.bench import record
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.proof.trial import Key, drawn
from tests.trials import model_of, observed, recorded

WAY = sys.modules[explain.__module__]  # the package has the function under its name
RAILS = (Concealed("saturation", {"upper": 9.0, "lower": -9.0}),)
RUNS = (staircase("walk", FIG13_LEVELS_V, 0.015, 2),)
LIMITS = {"saturation", "soft_saturation", "diode_clamp", "process_noise", *blemishes()}  # rails, and what is near them
OTHERS = tuple(sorted(known_effects() - LIMITS))


def test_a_second_look_is_believed_unless_it_sees_less(monkeypatch):
    left_out = tuple(catalogue())
    train = [recorded(OP_AMP, run, RAILS, 0.01, i, 2.0 * i, 8) for i, run in enumerate(RUNS)]
    test = [recorded(OP_AMP, sine("other", 12.5, 3.0, 2, 1), RAILS, 0.01, 9, 9.0, 8)]
    once, looks = WAY._looked_again, []

    def twice(readings, bench, kept, data, look):
        looks.append(look.leave_out)
        reading, again = once(readings, bench, kept, data, look)
        return (reading, replace(look, leave_out=left_out)) if look.leave_out == OTHERS else (reading, again)

    monkeypatch.setattr(WAY, "_looked_again", twice)
    told = explain(model_of(OP_AMP), train, test, leave_out=OTHERS)
    assert looks == [OTHERS, left_out]
    assert (told.verdict, [finding.id for finding in told.effects]) == ("explained", ["saturation"])


def test_what_was_taken_for_chance_and_is_not_is_looked_for_without_it(monkeypatch):
    """What a slow gain leaves of one repeat for the next differs like chance; beside that no law was asked for it."""
    train = [recorded(OP_AMP, run, RAILS, 0.01, i, 2.0 * i, 8) for i, run in enumerate(RUNS)]
    noise, search, earn, looks = catalogue()["process_noise"](Place.G1), WAY._found, WAY.warranted, []

    def found(readings, note, look):
        looks.append(look.leave_out)
        if look.leave_out != OTHERS:
            return search(readings, note, look)
        return readings.bench, replace(readings.plain, effects=(noise,)), []

    def without(bench, plain, final, rounds):
        return earn(bench, plain, final if noise not in final.effects else plain, rounds)

    monkeypatch.setattr(WAY, "_found", found)
    monkeypatch.setattr(WAY, "warranted", without)
    told = explain(model_of(OP_AMP), train, leave_out=OTHERS)
    assert looks == [OTHERS, (*OTHERS, "process_noise")]
    assert [finding.id for finding in told.effects] == ["saturation"]


def test_a_loss_that_a_lag_hides_is_asked_first_and_all_the_rest_once(monkeypatch):
    """It makes repeats differ, as noise in front of the gap would; that was tried first, for two minutes."""
    case, searched = drawn(Key(62, "pair", "pair", 4), known_effects()), []
    search = WAY._found
    monkeypatch.setattr(WAY, "_found", lambda *asked: searched.append(1) or search(*asked))
    train, test = parted(record(case))
    tried = {"dead_time", "extra_pole", "rate_dependent_gap", "slew_limit", "process_noise", *blemishes()}
    told = explain(model_of(case.nominal), train[:3], test[1:], leave_out=sorted(known_effects() - tried))
    assert (told.verdict, {finding.id for finding in told.effects}) == ("explained", {"dead_time", "missing_samples"})
    assert searched == [1]


@pytest.mark.parametrize(("besides", "all_of_it"), [((), True), ((Concealed("offset_drift", {"rate": 0.3}),), False)])
def test_spikes_that_rails_hid_are_taken_out_before_the_rails_are_doubted(besides, all_of_it):
    """Only if nothing else is left then: what is unexplained looks like spikes, too."""
    law = replace(catalogue()["saturation"](Place.F), form="both")
    concealed = (*RAILS, Concealed("spikes", {"rate": 20.0, "size": 0.4}), *besides)
    traces = [recorded(OP_AMP, run, concealed, 0.01, i, 2.0 * i, 8) for i, run in enumerate((*RUNS, *RUNS))]
    model = model_of(OP_AMP)
    readings = read(model, traces[:1], traces[1:], lambda data: WAY.prepared(model, data), Look())
    bench = readings.bench
    named = bench.fitted(bench.with_effects((law,), {"saturation.upper": 9.0, "saturation.lower": -9.0}), (law,))
    assert hides_blemishes(readings, bench, named, ()) == all_of_it
    assert not hides_blemishes(readings, bench, named, ("spikes",))
    assert not hides_blemishes(readings, bench, readings.plain, ())
    if all_of_it:
        told = explain(model, traces[:1], traces[1:], leave_out=OTHERS)
        assert (told.verdict, [f.id for f in told.effects]) == ("explained", ["saturation", "spikes"])


def test_blemishes_are_looked_for_beside_what_is_unnamed_but_not_beside_what_goes_with_the_clock():
    """Lines that nobody named look like coloured noise; a drift of free form would be that noise."""
    rippled = (Concealed("reference_ripple", {"share": 0.03, "frequency": 93.9}),)
    trace = recorded(OP_AMP, RUNS[0], rippled, 0.01, 1, 0.0, 8)
    bench = Bench(chain_of(model_of(OP_AMP)), (observed(trace, 0.01, 1),), (), ())
    plain = bench.fitted(bench.plain, ())
    kept = Warranted(plain, located(bench, plain))
    beside = kept.beyond.fitted[0][1]
    assert beside.misfit < 0.02 < plain.misfit
    there = SimpleNamespace(traces=(), hold_out=()), bench
    data = SimpleNamespace(test=(), noise=SimpleNamespace(rms_v=0.01))
    assert WAY._best_told(*there, kept, data, Look()) is beside.fit.chain
    drifting = replace(kept.beyond, fitted=((OffsetOverClock(Place.SENSE, (0.0, 1.0)), beside),))
    assert WAY._best_told(*there, replace(kept, beyond=drifting), data, Look()) is plain.fit.chain


@pytest.mark.parametrize(("counts", "times"), [((4.0, 4.0, 4.0), 1), ((4.0, 5.0, 5.0), 2)])
def test_looks_end_with_a_loss_that_was_found_before_whatever_chance_it_is_given(counts, times, monkeypatch):
    """Each look gives it another probability, as the model has moved; put back, the readings are the same."""
    losses = iter(
        MissingSamples({"count": Interval(count, count, count)}, 1e-9 / (1 + i), "run walk")
        for i, count in enumerate(counts)
    )

    def looked(chain, train, test, noise_v, leave_out, rough=False):
        return Mended(train, test, (next(losses),) if rough else ())

    fitted = []
    monkeypatch.setattr("identify.explain.readings.mended", looked)
    close, rough = _looked(None, Mended((), (), ()), 0.01, (), fitted.append)
    assert (close.found, rough.found[0].values["count"].value) == ((), counts[times])
    assert len(fitted) == times
