"""A small fixed share of the benchmark: a designed protocol keeps its promise on independent recordings."""

import numpy as np

from rig.design import Wish
from tests.benchmarks.designed import planned, reached
from tests.proof.rigs import RC
from tests.trials import model_of


def test_identification_reaches_the_intervals_that_were_promised() -> None:
    plan = planned(model_of(RC), Wish(5.0, 10.0, rate_hz=2000.0))
    found = reached(RC, plan, 5, fine=16)
    errors = np.array([row.errors for row in found])
    assert 0.75 < np.sqrt(np.mean(np.square(errors))) < 1.3  # some 40 independent errors: 1 +- 0.12
    assert np.max(np.abs(errors)) < 4.5
