"""Do excerpts stand for a recording: is the rig in them as it was, and is what they show what the whole shows?"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from identify.chain import simulate
from identify.effects import catalogue, chain_of
from identify.excerpts import excerpts
from identify.excerpts.cells import Cells
from identify.excerpts.excerpts import excerpts_of, kept_back
from identify.excerpts.history import before
from identify.excerpts.windows import CELLS, Choice
from identify.explain import explain
from identify.explain.everywhere import everywhere
from identify.model import Backlash, Model, Physics, Rational
from identify.trace import Array, Step, Trace

GAP = Backlash(8.0, 1.25, 8.0, -1.25)
RIG = Model("a gap", Rational((1.0,), (2e-3, 1.0)), GAP, Rational((1.0,), (1e-3, 1.0)), noise_v=0.01)
LONG = 60_000


def wandering(samples: int, seed: int) -> Array:
    """Return levels that last 100 to 2000 samples, large at first, ever smaller later: old extremes are remembered."""
    random = np.random.default_rng(seed)
    dwells = random.integers(100, 2000, samples // 100)
    begins = np.cumsum(dwells) - dwells
    levels = random.uniform(-1.0, 1.0, dwells.size) * np.interp(begins, [0, samples], [8.0, 0.5])
    return np.repeat(levels, dwells)[:samples]


def played(u: Array, model: Model = RIG, steps: tuple[Step, ...] = ()) -> Trace:
    trace = Trace("long", 1000.0, u, np.zeros(u.size), start_s=5.0, steps=steps)
    noise = 0.01 * np.random.default_rng(1).standard_normal(u.size)
    return replace(trace, y=simulate(chain_of(model), trace, 32) + noise)


@pytest.fixture
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(excerpts, "LONGEST", LONG // 2)
    monkeypatch.setattr(excerpts, "TAKEN", LONG // 5)


@pytest.mark.usefixtures("_short")
@pytest.mark.parametrize("seed", range(6))
def test_the_rig_is_in_an_excerpt_as_it_was_in_the_run(seed):
    trace = played(wandering(LONG, seed))
    whole = simulate(chain_of(RIG), trace)
    found = excerpts_of(RIG, [trace], [])
    assert found is not None
    assert len(found.training) > 3
    assert len(found.proof) > 0
    for excerpt in (*found.training, *found.proof):
        use = np.ones(excerpt.size, dtype=bool) if excerpt.valid is None else excerpt.valid
        first = round((excerpt.start_s - trace.start_s) * trace.rate_hz)
        at = first + np.flatnonzero(use)
        assert np.abs(simulate(chain_of(RIG), excerpt)[use] - whole[at]).max() < 1e-3 * RIG.noise_v
        assert np.array_equal(excerpt.y[use], trace.y[at])
        assert np.array_equal(excerpt.u[use], trace.u[at])


@pytest.mark.usefixtures("_short")
def test_without_the_extremes_of_the_past_it_would_not_be():
    trace = played(wandering(LONG, 0))
    whole = simulate(chain_of(RIG), trace)
    start = LONG - 5000
    late = replace(trace, u=trace.u[start - 200 :], y=trace.y[start - 200 :])
    assert np.abs(simulate(chain_of(RIG), late)[200:] - whole[start:]).max() > RIG.noise_v


@pytest.mark.usefixtures("_short")
def test_what_is_kept_back_lies_in_no_excerpt_to_fit():
    half = LONG // 2
    steps = (Step("a", "table", 0, half), Step("a", "table", half, LONG, repeat=1))
    trace = played(np.tile(wandering(half, 3), 2), steps=steps)
    assert kept_back(trace) == [(half, LONG)]
    found = excerpts_of(RIG, [trace], [])
    assert found is not None
    assert found.how == "excerpts of the last repeat of every repeated step"
    ends = [excerpt.start_s - 5.0 + excerpt.size / 1000.0 for excerpt in found.training]
    assert max(ends) <= half / 1000.0
    assert all(step.repeat == 1 for excerpt in found.proof for step in excerpt.steps)
    assert all(step.repeat == 0 and step.stop == e.size for e in found.training for step in e.steps)


@pytest.mark.usefixtures("_short")
def test_runs_named_for_the_proof_are_cut_too_and_nothing_else_is_kept_back():
    one, other = played(wandering(LONG, 4)), replace(played(wandering(LONG, 5)), name="other")
    found = excerpts_of(RIG, [one], [other])
    assert found is not None
    assert {e.name.split(" at ")[0] for e in found.training} == {"long"}
    assert {e.name.split(" at ")[0] for e in found.proof} == {"other"}
    assert max(e.start_s for e in found.training) > 5.0 + 0.7 * LONG / 1000.0
    every = (*found.training, *found.proof)
    assert found.samples == sum(e.size if e.valid is None else int(e.valid.sum()) for e in every)


def test_short_recordings_are_explained_whole():
    assert excerpts_of(RIG, [played(wandering(LONG, 0))], []) is None


def test_cells_know_the_last_place_of_an_extreme():
    u = np.random.default_rng(0).integers(-5, 6, 1003).astype(np.float64)
    cells = Cells.of(u, 50)
    for start, stop in ((0, 1003), (3, 40), (40, 60), (49, 951), (1000, 1003), (17, 1003)):
        for upper in (True, False):
            at, level = cells.last_extreme(start, stop, upper=upper)
            some = u[start:stop]
            assert level == (some.max() if upper else some.min())
            assert at == start + int(np.flatnonzero(some == level)[-1])


def test_the_past_of_a_fading_triangle_is_all_its_turns_and_of_a_growing_one_the_last():
    turns = np.array([0.0, 6.0, -5.0, 4.0, -3.0, 2.0])
    fading = np.interp(np.arange(5000), 1000.0 * np.arange(6), turns)
    turned = [(980, 1010), (1980, 2010), (2980, 3010), (3980, 4010)]
    assert before(Cells.of(fading, 40), 4990, 10) == [*turned, (4960, 4990)]
    growing = np.interp(np.arange(5000), 1000.0 * np.arange(6), np.array([0.0, 2.0, -3.0, 4.0, -5.0, 6.0]))
    assert before(Cells.of(growing, 40), 4990, 10) == [turned[3], (4960, 4990)]


def test_windows_reach_the_ends_of_the_levels_and_every_step():
    u = np.concatenate((np.zeros(20_000), [9.0] * 100, np.zeros(20_000), [-9.0] * 100, np.ones(20_000)))
    steps = (Step("a", "hold", 0, 40_000), Step("b", "hold", 40_000, u.size))
    windows = Choice(Cells.of(u, 100), steps).windows([(0, u.size)], 8)
    assert len(windows) == 8
    assert all(b - a == 100 * CELLS for a, b in windows)
    assert all(one[1] <= other[0] for one, other in pairwise(windows))
    seen = [u[a:b] for a, b in windows]
    assert max(s.max() for s in seen) == 9.0
    assert min(s.min() for s in seen) == -9.0


@pytest.mark.usefixtures("_short")
def test_physics_is_found_in_excerpts_and_what_only_others_show_is_told():
    rails = replace(RIG, physics=(Physics("saturation", {"upper": 10.0, "lower": -12.0}),))
    trace = played(4.0 * np.sin(2.0 * np.pi * 2.0 * np.arange(LONG) / 1000.0), rails)
    found = excerpts_of(RIG, [trace], [])
    assert found is not None
    tried = {"saturation", "soft_saturation", "diode_clamp", "adc_clipping", "curved_border", "extra_pole"}
    told = explain(RIG, [trace], leave_out=sorted(set(catalogue()) - tried))
    assert [f.id for f in told.effects] == ["saturation"]
    for name, true in (("upper", 10.0), ("lower", -12.0)):
        found_v = told.effects[0].parameters[name][0]
        assert abs(found_v.value - true) < 4.0 / 1.96 * (found_v.high - found_v.low) / 2.0
    assert told.warnings[0].startswith(f"Of 60,000 samples, {found.samples:,} (20 %) in {found.windows} excerpts")
    assert told.warnings[0].endswith("as it does of the excerpts.")
    shown = [(round(1000.0 * (e.start_s - 5.0)), e.size) for e in (*found.training, *found.proof)]
    seen = np.zeros(LONG, dtype=bool)
    for first, size in shown:
        seen[max(first, 0) : first + size] = True
    hidden = int(np.flatnonzero(~seen)[len(shown)])
    hurt = np.array(trace.y)
    hurt[hidden] += 30.0
    again = everywhere(told, RIG, replace(found, whole=(replace(trace, y=hurt),)))
    assert "in long from 5 s on: look at that stretch by itself" in again.warnings[0]
