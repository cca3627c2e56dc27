"""Does an observation weigh the right samples, on a grid that is fine enough?"""

import numpy as np
import pytest

from identify.chain import plain_chain, simulate
from identify.observe import FINEST, Observation, pooled_rms, refined, rms
from identify.trace import Trace
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

STAIRS = recorded(RC, staircase("stairs", FIG13_LEVELS_V[::2], 0.02), fine=128)
FAST = recorded(RC, sine("sine", 500.0, 60.0, 100, 1), fine=128)
CHAIN = plain_chain(model_of(RC))


def test_residual_is_reading_less_answer():
    seen = observed(Trace("t", 1e4, STAIRS.u, STAIRS.y + 0.25), 0.01, 4)
    assert np.allclose(seen.residual(CHAIN), 0.25, rtol=0, atol=2e-3)
    assert np.array_equal(seen.residual(CHAIN), seen.trace.y - simulate(CHAIN, seen.trace, 4))


def test_only_samples_in_use_count():
    use = np.zeros(STAIRS.size, dtype=bool)
    use[100:150] = True
    seen = Observation(STAIRS, use, 0.01)
    assert seen.count == 50
    assert np.array_equal(seen.used_residual(CHAIN), seen.residual(CHAIN)[100:150])


def test_the_beginning_of_a_run_has_the_residual_of_the_whole():
    left_out = np.linspace(-1.0, 1.0, STAIRS.size, dtype=np.float16)
    whole = Observation(STAIRS, np.arange(STAIRS.size) > 50, 0.01, 2, left_out)
    short = whole.until(120)
    assert short.count == 69
    assert np.array_equal(short.residual(CHAIN), whole.residual(CHAIN)[:120])
    assert whole.until(STAIRS.size) is whole


def test_source_is_given_on_the_fine_grid():
    assert observed(STAIRS, 0.01, 4).source.size == 4 * STAIRS.size


def test_rms_of_nothing_is_nothing():
    assert rms(np.array([3.0, -4.0])) == pytest.approx(np.sqrt(12.5))
    assert pooled_rms([np.array([3.0]), np.array([-4.0, 0.0])]) == pytest.approx(np.sqrt(25.0 / 3.0))
    assert rms(np.empty(0)) == pooled_rms([]) == 0.0


@pytest.mark.parametrize("noise_v", [0.1, 0.01, 0.003])
@pytest.mark.parametrize("trace", [STAIRS, FAST], ids=lambda trace: trace.name)
def test_a_refined_grid_leaves_no_error_a_matched_test_could_see(trace, noise_v):
    seen = refined(observed(trace, noise_v, 1), CHAIN)
    error = simulate(CHAIN, trace, seen.substeps) - trace.y
    assert np.linalg.norm(error) / noise_v < 1.0


def test_a_quieter_reading_needs_a_finer_grid():
    substeps = [refined(observed(FAST, noise_v, 1), CHAIN).substeps for noise_v in (10.0, 0.01, 1e-3, 1e-9)]
    assert substeps == sorted(substeps)
    assert substeps[0] == 1
    assert substeps[-1] == FINEST


def test_a_grid_that_is_fine_already_is_kept():
    seen = observed(STAIRS, 1.0, 1)
    assert refined(seen, CHAIN) is seen
