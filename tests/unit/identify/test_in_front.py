"""Is a line in front of the gap found where it is, though few readings show it?"""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify.chain import plain_chain, simulate
from identify.effects import chain_of
from identify.evidence import Evidence
from identify.explain import beside, free_form
from identify.explain.bench import Bench
from identify.explain.corrections import corrections
from identify.explain.free_form import in_step, slid_on, with_overtones
from identify.explain.frequencies import LINES
from identify.explain.hypothesis import Hypothesis
from identify.explain.in_front import asked_of_v, lines_in_front
from identify.explain.plain import prepared
from identify.explain.side_by_side import fitted_from
from identify.explain.sought import distinct
from identify.explain.suspect import Suspect, contenders, overlooked, suspect, with_alike
from identify.fit import fit
from identify.holdout import split
from identify.stage import Place
from identify.unnamed.correction import Correction
from identify.unnamed.lines import Line, Wave
from identify.unnamed.maps import LevelMap
from tests.proof.ask import parted
from tests.proof.bench import record
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.proof.trial import Key, drawn
from tests.trials import model_of, observed, recorded

NOISE_V, LINE_HZ = 0.01, 577.3
CHAIN = plain_chain(model_of(OP_AMP))
STIMULI = (
    sine("a", 12.5, 4.0, 12, 2), sine("b", 8.0, 3.4, 12, 2), sine("c", 5.0, 3.0, 8, 2),
    staircase("walk", FIG13_LEVELS_V, 0.03, 2), sine("idle", 20.0, 0.5, 4, 1),
)  # fmt: skip


def seen(*physics):
    """Return what is read of runs, the last of which never moves w."""
    return [observed(recorded(OP_AMP, s, physics, NOISE_V, i, 3.0 * i), NOISE_V) for i, s in enumerate(STIMULI)]


def test_a_line_of_the_source_stands_out_in_what_v_is_asked_for_and_not_in_what_is_read():
    runs = seen(Concealed("source_line", {"amplitude": 0.15, "frequency": LINE_HZ}))
    assert lines_in_front(CHAIN, runs, 1)[0] == pytest.approx(LINE_HZ, abs=1.0)
    evidence = Evidence(fit(CHAIN, runs, iterations=0), tuple(runs))
    assert evidence.strongest_line_hz != pytest.approx(LINE_HZ, abs=5.0)


def test_images_of_a_line_do_not_take_the_place_of_the_line():
    """Turns that come evenly show the line at other frequencies, too; where less is around them they stand out more."""
    line, frequency_hz = drawn(Key(140, "outside", "source_line", 0)), 359.66
    train, test = parted(record(line))
    model = model_of(line.nominal)
    bench, plain = prepared(model, split(model, train, test))
    hz = lines_in_front(plain.fit.chain, bench.observations, LINES)
    assert min(abs(one - frequency_hz) for one in hz) < 0.5
    assert abs(hz[0] - frequency_hz) > 100.0


@pytest.mark.parametrize(("amplitude_v", "hz"), [(1.0, 577.3), (2.0, 814.8), (0.5, 1300.0)])
def test_a_quick_line_that_shakes_the_borders_apart_is_told_by_how_readings_change_while_w_moves(amplitude_v, hz):
    """What v is asked for tells of any quick line alike: there it stands out nowhere."""
    runs = seen(Concealed("source_line", {"amplitude": amplitude_v, "frequency": hz}))
    *asked, changing = lines_in_front(CHAIN, runs, LINES)
    assert changing == pytest.approx(hz, abs=0.5)
    assert min(abs(one - hz) for one in asked) > 5.0


def test_frequencies_are_apart_and_as_many_as_are_asked_for_and_one_more():
    found = lines_in_front(CHAIN, seen(), 3)
    assert len(found) == 3 + 1
    assert min(np.diff(np.sort(found))) > 0.5
    assert lines_in_front(CHAIN, seen()[-1:], 3) == ()


def test_what_v_is_asked_for_is_how_a_change_of_v_would_move_the_misfit():
    """Against the misfit of v moved by a pulse: where contact ends, that is all that follows until the next."""
    (run, *_) = seen()
    moved = replace(run, trace=replace(run.trace, y=simulate(CHAIN, run.trace) + 0.05))
    asked = asked_of_v(CHAIN, moved)
    slopes = []
    for hz in (7.0, 31.0, 90.0):  # a line adds to v at every instant what its sine is there
        line = Line(Place.G1, (hz,))
        size = 1e-4
        there = line.put_in(CHAIN, {f"unnamed.sine1[{run.trace.name}]": size})
        change = (moved.residual(CHAIN) - moved.residual(there)) / size
        time_s = np.arange(asked.size) / run.trace.rate_hz
        told = 8.0 * float(asked @ np.sin(2.0 * np.pi * hz * time_s)) / NOISE_V
        slopes.append((told, float(change[run.use] @ moved.residual(CHAIN)[run.use]) / NOISE_V**2))
    told, true = np.transpose(slopes)
    assert told == pytest.approx(true, rel=0.05)


def test_a_line_in_front_of_the_gap_is_tried_wherever_it_is_likely():
    runs = seen(Concealed("source_line", {"amplitude": 0.15, "frequency": LINE_HZ}))
    evidence = Evidence(fit(CHAIN, runs, iterations=0), tuple(runs))
    lines = [c.knots for c in corrections(evidence) if (c.form, c.place) == (Line.form, Place.G1)]
    assert {(hz,) for hz in lines_in_front(CHAIN, runs, LINES)} < set(lines)


def begun(physics: Concealed, hz: float) -> tuple[Bench, Hypothesis, Correction, Hypothesis]:
    """Return a bench, its plain fit, a line at a frequency and its fit, slid as far as slopes lead."""
    bench = Bench(chain_of(model_of(OP_AMP)), tuple(seen(physics)), (), ())
    plain = bench.fitted(bench.plain, ())
    line = suspect(bench.evidence(plain), Line(Place.G1, (hz,)))
    return bench, plain, *slid_on(bench, plain, line.correction, fitted_from(bench, plain, line))


def test_a_line_that_is_out_of_step_by_the_end_of_a_run_is_found_in_step():
    """So large that it shakes the borders apart: no slope leads to its frequency from half a turn off."""
    longest_s, hz = max(o.trace.size / o.trace.rate_hz for o in seen()), 577.3
    physics = Concealed("source_line", {"amplitude": 1.0, "frequency": hz})
    bench, plain, off, fitted = begun(physics, hz + 0.5 / longest_s)
    assert abs(off.knots[0] - hz) * longest_s > 0.2
    law, better = in_step(bench, plain, off, fitted)
    assert abs(law.knots[0] - hz) * longest_s < 0.1
    assert better.misfit < 0.5 * fitted.misfit
    read = Line(Place.SENSE, off.knots)
    assert in_step(bench, plain, read, fitted) == (read, fitted)  # nothing bends that


def test_a_line_that_is_a_third_of_a_wave_has_its_overtones():
    bench, plain, line, fitted = begun(Concealed("sawtooth", {"size": 0.02, "frequency": 109.5}), 109.5)
    assert 0.3 < (plain.chi2 - fitted.chi2) / plain.proven < 0.5
    law, better = with_overtones(bench, plain, line, fitted)
    assert isinstance(law, Wave)
    assert better.misfit < 0.5 * fitted.misfit


def test_a_line_at_other_frequencies_goes_along_if_it_promises_nearly_as_much(monkeypatch):
    def promising(correction, gain):
        return Suspect(correction, np.ones(1), np.array([gain]), {})

    lines = ((50.0, 100.0), (77.0, 90.0), (9.0, 30.0))
    line, near, far = (promising(Line(Place.G1, (hz,)), gain) for hz, gain in lines)
    read = promising(Line(Place.SENSE, (50.0,)), 95.0)
    level = promising(LevelMap(Place.F, (0.0, 1.0, 2.0, 3.0)), 99.0)
    ranked = [line, level, read, near, far]
    assert with_alike(ranked, [line, level]) == [line, level, near]
    assert with_alike(ranked, [level]) == [level]
    second = promising(LevelMap(Place.G1, (0.0, 1.0, 2.0, 3.0)), 99.5)  # of the best place
    assert [s for s in contenders([line, second, *ranked[1:]], 1.0) if s in (second, near, far)] == [second, near]
    large = [promising(s.correction, 100.0 * s.gain) for s in ranked]
    assert [s.correction.knots for s in overlooked(large, large[1:3])] == [line.correction.knots, near.correction.knots]
    monkeypatch.setattr(beside, "finer", lambda evidence, found, noise: found)
    monkeypatch.setattr(free_form, "fitted_from", lambda bench, base, found: found)
    for name in ("slid_on", "in_step", "between_runs", "with_overtones"):
        monkeypatch.setattr(free_form, name, lambda bench, base, law, fitted: (law, fitted))
    longest = SimpleNamespace(longest_s=2.0)
    bench = SimpleNamespace(evidence=lambda base: longest, remembered=lambda question, base: question(None, base))
    assert list(beside._fitted(bench, None, ranked)) == [(s.correction, s) for s in (line, level, near)]
    same = promising(Line(Place.G1, (50.2,)), 98.0)  # the next bin of one peak
    assert list(beside._fitted(bench, None, [*ranked, same])) == [(s.correction, s) for s in (line, level, near)]


def test_of_those_that_came_to_one_frequency_the_best_is_kept():
    def promising(correction, gain):
        return Suspect(correction, np.ones(1), np.array([gain]), {})

    evidence = SimpleNamespace(longest_s=10.0)
    at = {hz: promising(Line(Place.G1, (hz,)), gain) for hz, gain in ((50.0, 90.0), (50.03, 100.0), (50.1, 80.0))}
    read, level = promising(Line(Place.SENSE, (50.0,)), 70.0), promising(LevelMap(Place.F, (0.0, 1.0, 2.0, 3.0)), 99.0)
    assert distinct(evidence, [level, *at.values(), read, level]) == [level, at[50.03], at[50.1], read, level]


def test_a_line_that_is_not_at_its_frequency_yet_may_be_behind():
    """Half of what runs resolve beside it, it promises some 40 % of what it will."""
    def promising(correction, gain):
        return Suspect(correction, np.ones(1), np.array([gain]), {})

    best = promising(LevelMap(Place.F, (0.0, 1.0, 2.0, 3.0)), 1000.0)
    for gain, asked in ((400.0, True), (200.0, False)):
        line, gap = promising(Line(Place.G1, (50.0,)), gain), promising(LevelMap(Place.SENSE, (0.0, 1.0)), gain)
        assert (line in contenders([best, line, gap], 1.0)) is asked
        assert gap not in contenders([best, line, gap], 1.0)
