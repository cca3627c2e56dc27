"""Does a fixed share of the study of drifting benches end as it should, and is what is moved what is said?"""

import numpy as np
import pytest

from tests.benchmarks.drifting import null, same, shifted, summary, value
from tests.proof.detect import neighbours


def test_one_rig_on_two_days_shows_no_change() -> None:
    found = same(0, 4)
    assert found.verdict == "no change seen", found.line()
    assert "wrong claim: 0 of 1" in summary("same", [found])


def test_a_value_that_moved_is_claimed_and_accounts_for_the_change() -> None:
    found = value(0, 3)
    assert found.z > 5.0
    assert (found.verdict, found.wrong) == ("changed", ()), found.line()
    assert found.moved in found.claimed
    assert found.moved in found.accounted


@pytest.mark.parametrize("number", range(3))
def test_one_value_of_a_rig_is_moved_and_no_other(number: int) -> None:
    trial = null(0, number)
    moved, name, z = shifted(trial, np.random.default_rng(number))
    same_values = [item for item in vars(trial.rig) if getattr(moved, item) == getattr(trial.rig, item)]
    assert len(same_values) == len(vars(trial.rig)) - 1
    assert 2.0 <= z <= 30.0
    assert len(neighbours(trial.rig)) >= 6
    assert name.startswith(("F.", "G1.", "G2."))
