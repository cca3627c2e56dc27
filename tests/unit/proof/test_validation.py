"""Are the cases of the validation new, varied, repeatable and consistent in what they want?"""

from collections import Counter

import numpy as np
import pytest

from tests.proof.bench import record
from tests.proof.cases import CASES
from tests.proof.physics import WHERE
from tests.proof.validation import LIBRARY, OUTSIDE, STAGES, drawn

MANY = [drawn(seed) for seed in range(400)]


def test_a_seed_always_gives_the_same_case():
    assert drawn(3) == drawn(3)
    assert drawn(3) != drawn(4)


def test_no_value_is_one_the_explainer_was_built_with():
    old = {value for case in CASES for physics in case.physics for value in physics.values.values()}
    new = {value for case in MANY for physics in case.physics for value in physics.values.values()}
    assert not {value for value in new & old if np.isfinite(value)}


def test_kinds_come_in_the_shares_promised():
    count = Counter(len(case.physics) if case.expected or not case.physics else "outside" for case in MANY)
    assert count[0] == pytest.approx(60, abs=22)
    assert count[1] == pytest.approx(220, abs=30)
    assert count[2] == pytest.approx(60, abs=22)
    assert count["outside"] == pytest.approx(60, abs=22)


def test_every_physics_is_drawn_and_stands_on_the_bench():
    assert {*LIBRARY, *OUTSIDE} == {physics.name for case in MANY for physics in case.physics} <= set(WHERE)


def test_stages_are_those_of_the_findings():
    told = {(p.name, f.stage) for case in MANY for p, f in zip(case.physics, case.expected, strict=False)}
    assert told == set(STAGES.items())


@pytest.mark.parametrize("name", sorted(OUTSIDE))
def test_physics_without_a_name_wants_none(name):
    case = next(case for case in MANY if case.physics and case.physics[0].name == name)
    assert case.verdict == "unexplained"


def test_a_pair_has_two_stages_and_can_be_recorded():
    pairs = [case for case in MANY if len(case.physics) == 2]
    assert all(len({finding.stage for finding in case.expected}) == 2 for case in pairs)
    assert all(np.all(np.isfinite(run.y)) for run in record(pairs[0], substeps=4))
