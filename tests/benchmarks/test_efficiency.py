"""Does a fixed share of the efficiency study come out as the whole does?"""

import numpy as np
import pytest
from scipy.stats import binom, chi2

from tests.benchmarks.efficiency import experiment, measured, realised, table, true
from tests.proof.paper_simulation import NAMES, TRUTH

REALISATIONS = 8
DECIBELS = 32.0
RARE = 1e-3  # chance at which a sound estimator would fail here; the seeds are fixed


@pytest.fixture(scope="module")
def found():
    made = experiment(cut=0.1, coarser=4)
    answers = list(realised(made, made.noise_v(DECIBELS), range(REALISATIONS)))
    return measured(made, made.noise_v(DECIBELS), answers)


def test_errors_are_those_of_the_bound(found):
    """Squares of n normal errors over their variance are a chi-square of n; the quantities are far from independent."""
    told = [m for m in found if m.identifiable]
    assert {"S_L", "D_L", "S_U", "D_U"} <= {m.name for m in told}
    low, high = np.sqrt(chi2.ppf([RARE / len(told), 1.0 - RARE / len(told)], REALISATIONS) / REALISATIONS)
    assert {m.name: m.ratio for m in told if not low < m.ratio < high} == {}


def test_intervals_hold_the_truth(found):
    least = binom.ppf(RARE / len(found), REALISATIONS, 0.95) / REALISATIONS
    assert {m.name: m.coverage for m in found if m.identifiable and m.coverage < least} == {}


def test_every_quantity_is_told_in_a_line(found):
    lines = list(table(found))
    assert len(lines) == len(found) + 1
    assert [line.split()[0] for line in lines[1:5]] == ["S_L", "D_L", "S_U", "D_U"]


def test_the_closed_forms_are_those_of_the_paper():
    """Eqs. (40a-c): G1(0) = G2(0) = 1 to 4 digits, S = 1.76; Tables 4 and 5 print the responses at 0.01 rad/s."""
    at = 0.01 / (2.0 * np.pi)
    names = ["S_L", "D_U", f"arg G1 at {at} Hz", f"|G2| at {5 * at} Hz", f"arg G2 at {5 * at} Hz", *NAMES]
    values = true(TRUTH, names)
    assert values[:5] == pytest.approx([1.76, -1.78, -0.030, 0.96, -0.67], abs=0.003)
    assert values[5:] == pytest.approx(TRUTH)
