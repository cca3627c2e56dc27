"""Are the recordings of the trial bench what a bench would give: timing, clock, noise, amount, repeatability?"""

from itertools import pairwise

import numpy as np
import pytest

from tests.proof.bench import SUBSTEPS, answer, record, schedule
from tests.proof.cases import CASES, Case, Concealed
from tests.proof.integrator import Grid
from tests.proof.rigs import OP_AMP, RC, SKEWED, toleranced

MOST_TRAINING, MOST_HELD_OUT = 150_000, 60_000
CASE = {case.name: case for case in CASES}


@pytest.fixture(scope="module")
def clean():
    return record(CASE["clean, op-amp"])


def _truth(case):
    return [answer(case.rig, s.u, Grid(s.rate_hz, s.u.size, SUBSTEPS, at)) for s, at, _ in schedule(case)]


def test_training_and_held_out_runs_stay_within_the_budget(clean):
    assert sum(run.u.size for run in clean if not run.held_out) <= MOST_TRAINING
    assert sum(run.u.size for run in clean if run.held_out) <= MOST_HELD_OUT
    assert len({run.name for run in clean}) == len(clean)


def test_clock_runs_on_between_runs(clean):
    for before, after in pairwise(clean):
        assert after.start_s > before.start_s + before.u.size / before.rate_hz


def test_steps_tile_every_run_and_repeats_play_the_same(clean):
    for run in clean:
        assert run.steps[0].start == 0
        assert run.steps[-1].stop == run.u.size
        assert len(run.steps) >= 2
        first = run.u[run.steps[0].start : run.steps[0].stop]
        for step in run.steps:
            assert np.array_equal(run.u[step.start : step.stop], first)


def test_noise_is_white_gaussian_of_ten_millivolts_and_new_in_every_run(clean):
    noise = [run.y - truth for run, truth in zip(clean, _truth(CASE["clean, op-amp"]), strict=True)]
    pooled = np.concatenate(noise)
    assert np.std(pooled) == pytest.approx(0.010, rel=0.01)
    assert abs(np.mean(pooled)) < 5.0 * 0.010 / np.sqrt(pooled.size)
    assert abs(np.corrcoef(pooled[1:], pooled[:-1])[0, 1]) < 5.0 / np.sqrt(pooled.size)
    assert np.mean((pooled / 0.010) ** 4) == pytest.approx(3.0, abs=0.1)
    assert abs(np.corrcoef(noise[0][:10_000], noise[1][:10_000])[0, 1]) < 0.05


def test_a_case_recorded_twice_is_the_same_to_the_last_bit(clean):
    again = record(CASE["clean, op-amp"])
    assert all(np.array_equal(a.y, b.y) for a, b in zip(clean, again, strict=True))


def test_reading_comes_before_the_update_of_the_same_instant():
    u = np.array([0.0, 9.0, 9.0, 9.0])
    y = answer(RC, 100.0 * u, Grid(1000.0, 4, 64))
    assert y[0] == y[1] == 0.0
    assert y[2] > 0.0


def test_stuck_sine_moves_nothing_but_noise(clean):
    stuck = next(run for run in clean if run.name.startswith("stuck"))
    assert np.std(stuck.y) == pytest.approx(0.010, rel=0.05)


def test_staircases_visit_and_avoid_the_rails(clean):
    reached = {run.name: np.abs(run.y).max() for run in clean}
    assert reached["staircase"] > 13.0
    assert reached["staircase_0.6"] < 9.0


def test_held_out_runs_ask_for_no_level_the_training_runs_have_not_seen(clean):
    trained = np.concatenate([run.y for run in clean if not run.held_out])
    proof = np.concatenate([run.y for run in clean if run.held_out])
    assert trained.min() < proof.min() - 0.5
    assert proof.max() < trained.max() + 1.5


def test_two_physics_that_replace_the_play_are_refused():
    both = (Concealed("leak", {"rate": 1.0}), Concealed("bias current", {"current": 1.0}))
    with pytest.raises(ValueError, match="2 physics at place play"):
        answer(OP_AMP, np.zeros(10), Grid(1000.0, 10, 2), both)


@pytest.mark.parametrize("name", [case.name for case in CASES if case.physics])
def test_concealed_physics_changes_the_recording(name):
    case = CASE[name]
    changed = np.concatenate([
        answer(case.rig, s.u, Grid(s.rate_hz, s.u.size, 2, at), case.physics, case.seed)
        - answer(case.rig, s.u, Grid(s.rate_hz, s.u.size, 2, at))
        for s, at, _ in schedule(case)
    ])  # fmt: skip
    assert np.sqrt(np.mean(changed**2)) > 1.5 * case.rig.noise_v


@pytest.mark.parametrize("rig", [OP_AMP, SKEWED, RC])
def test_parts_are_off_by_two_per_cent_at_most_and_never_exact(rig):
    def values(r):
        return np.array([*r.g1_den[:-1], *r.g2_den[:-1], r.s_l, r.d_l_v, r.s_u, r.d_u_v])

    off = values(toleranced(rig, 3)) / values(rig) - 1.0
    assert np.all(np.abs(off) <= 0.02)
    assert np.all(np.abs(off) > 1e-6)


def test_cases_are_told_apart_by_name_and_seed():
    assert len({case.name for case in CASES}) == len({case.seed for case in CASES}) == len(CASES)
    assert {case.verdict for case in CASES} == {"consistent", "explained", "unexplained"}


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_no_true_value_is_a_round_number_a_search_might_start_from(case: Case):
    for concealed in case.physics:
        for value in concealed.values.values():
            assert float(f"{value:.1g}") != value
