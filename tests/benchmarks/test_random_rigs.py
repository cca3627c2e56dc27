"""Does a fixed share of the study end at the truth, and does the bench draw what it says it draws?"""

import numpy as np
import pytest

from tests.benchmarks.random_rigs import outcome, summary
from tests.proof.random_rigs import OFF, SLOWEST_S, SUBSTEPS, answer, drawn, off, random_rig

SHARE = (0, 2, 5, 7, 15, 31)  # plain, ringing, late, with a zero; 2 and 7 do not end at the noise from their files


RIGS = [random_rig(np.random.default_rng([1, number])) for number in range(120)]
BLOCKS = [block for rig in RIGS for block in (rig.g1, rig.g2)]


@pytest.mark.parametrize("number", SHARE)
def test_a_rig_file_wrong_in_every_value_leads_to_the_truth(number: int) -> None:
    found = outcome(0, number)
    assert found.at_truth, found.line()
    assert found.within, found.line()
    assert found.said == ()
    assert "1 of 1" in summary([found])


def test_rigs_are_stable_and_of_every_order() -> None:
    poles = [np.roots(block.den) * SLOWEST_S for block in BLOCKS]
    assert {p.size for p in poles} == {1, 2, 3, 4}
    assert all(np.all(p.real < -0.1) and np.all(np.abs(p) < 16.0) for p in poles)


def test_thirds_ring_are_skewed_and_late() -> None:
    ringing = [any(np.any(np.abs(np.roots(b.den).imag) > 0.0) for b in (r.g1, r.g2)) for r in RIGS]
    for share in (ringing, [r.s_l != r.s_u for r in RIGS], [r.delay_s > 0.0 for r in RIGS]):
        assert np.mean(share) == pytest.approx(1.0 / 3.0, abs=0.15)


def test_every_value_of_the_file_is_off() -> None:
    for rig in RIGS[:20]:
        file = off(rig, np.random.default_rng(3))
        true, nominal = ((*b.g1.num, *b.g1.den, b.s_l, b.d_l_v, b.s_u, b.d_u_v) for b in (rig, file))
        assert np.abs(np.divide(nominal, true) - 1.0) == pytest.approx(np.full(len(true), OFF))


def test_the_integrator_s_own_error_is_lost_in_the_noise() -> None:
    bench = drawn(0, 2)
    error = [answer(bench.rig, s.u) - answer(bench.rig, s.u, 4 * SUBSTEPS) for s in bench.stimuli]
    assert np.linalg.norm(np.concatenate(error)) < 0.05 * bench.rig.noise_v
