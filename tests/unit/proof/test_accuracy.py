"""Is the error of the integrator far below what the noise of a run can reveal?"""

from dataclasses import replace

import numpy as np
import pytest

from tests.proof.bench import SUBSTEPS, answer, schedule
from tests.proof.cases import CASES
from tests.proof.detect import COARSE
from tests.proof.integrator import Grid
from tests.proof.kinds import LIBRARY
from tests.proof.rigs import RC
from tests.proof.trial import Key, drawn

DETECTED = 5.0  # standard deviations a matched test needs
CASE = {case.name: case for case in CASES}


def _answer_of_rc_rig_to_a_step(t, level_v):
    """Return y in closed form: w leaves the gap when v reaches d_l, then is a constant minus one exponential."""
    a, b = RC.g1_den[1] / RC.g1_den[0], RC.g2_den[1] / RC.g2_den[0]
    contact_s = -np.log(1.0 - RC.d_l_v / level_v) / a
    since = np.maximum(t - contact_s, 0.0)
    top, fall = RC.s_l * (level_v - RC.d_l_v), RC.s_l * level_v * np.exp(-a * contact_s)
    return top * (1.0 - np.exp(-b * since)) - fall * b / (b - a) * (np.exp(-a * since) - np.exp(-b * since))


def test_whole_path_agrees_with_the_closed_form_of_a_step_through_the_gap():
    grid = Grid(10_000.0, 2000, SUBSTEPS)
    error = answer(RC, np.full(2000, 3.1), grid) - _answer_of_rc_rig_to_a_step(grid.sample_s, 3.1)
    assert np.sqrt(np.mean(error**2)) < 1e-6
    assert np.abs(error).max() < 1e-5


def _answers(case, substeps):
    return [
        answer(case.rig, s.u, Grid(s.rate_hz, s.u.size, substeps, at), case.physics, case.seed)
        for s, at, _ in schedule(case)
    ]


def _errors(case):
    """Return the error of every run, V: the error falls fourfold a halving, so 4/3 of the difference to the next."""
    pairs = zip(_answers(case, SUBSTEPS), _answers(case, 2 * SUBSTEPS), strict=True)
    return [4.0 / 3.0 * (coarse - fine) for coarse, fine in pairs]


@pytest.mark.parametrize("name", ["clean, op-amp", "clean, skewed", "dead_time", "plateau_droop, leak", "hum, G1"])
def test_error_is_a_twentieth_of_what_a_matched_test_could_find(name):
    case = CASE[name]
    errors = _errors(case)
    rms_v = np.sqrt(np.mean(np.concatenate(errors) ** 2))
    z = [np.linalg.norm(error) / case.rig.noise_v for error in errors]
    assert rms_v < 1e-5  # measured: 1e-7 (RC) to 2.4e-6
    assert max(z) < DETECTED / 20.0


def test_slew_limit_is_known_less_well_yet_far_below_its_mismatch():
    """The limit sets in between two nodes at a corner of w, so its error falls only in proportion to the step."""
    case = CASE["slew_limit"]
    difference = np.concatenate(_answers(case, SUBSTEPS)) - np.concatenate(_answers(case, 2 * SUBSTEPS))
    assert 2.0 * np.sqrt(np.mean(difference**2)) < 5e-4  # V; its mismatch is 50 mV


@pytest.mark.parametrize("about", ["extra_pole", "soft_knee"])
def test_a_sealed_trial_is_integrated_far_below_what_a_matched_test_could_find(about):
    trial = drawn(Key(21, "single", about, 0))
    errors = _errors(replace(trial, training=trial.training[1:5:3], held_out=()))
    assert np.linalg.norm(np.concatenate(errors)) / trial.rig.noise_v < 0.1


def test_grid_of_the_sizes_costs_a_twentieth_of_the_noise_at_most():
    case = CASE["clean, op-amp"]
    for coarse, fine in zip(_answers(case, COARSE), _answers(case, SUBSTEPS), strict=True):
        assert np.sqrt(np.mean((coarse - fine) ** 2)) < case.rig.noise_v / 20.0


if __name__ == "__main__":
    for shown in CASES:
        print(f"{shown.name:32s} {np.sqrt(np.mean(np.concatenate(_errors(shown)) ** 2)):.1e} V rms")
    for about in sorted({kind.id for kind in LIBRARY}):
        trial = drawn(Key(21, "single", about, 0))
        off = np.concatenate(_errors(replace(trial, held_out=())))
        z = np.linalg.norm(off) / trial.rig.noise_v
        print(f"{trial.physics[0].name:32s} {z:.3f} standard deviations", flush=True)
