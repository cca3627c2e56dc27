"""Is every concealed mismatch clear against the noise once the plain model has been refitted, and nothing else is?"""

import pytest

from tests.proof.cases import CASES, CLEAN, Case
from tests.proof.sizing import size

CLEAR, ABSURD = 1.5, 40.0  # mismatch rms over noise rms on the runs used for fitting

pytestmark = pytest.mark.slow  # about a second a case


@pytest.mark.parametrize("case", CLEAN, ids=lambda case: case.name)
def test_clean_rig_is_explained_by_the_plain_model(case: Case):
    found = size(case)
    assert found.nominal > CLEAR  # the parts are off, so a fit is needed
    assert found.refitted < 0.05
    assert found.held_out < 0.05


@pytest.mark.parametrize("case", [case for case in CASES if case.physics], ids=lambda case: case.name)
def test_mismatch_is_clear_and_not_absurd(case: Case):
    found = size(case)
    assert CLEAR < found.refitted < ABSURD
    assert found.held_out > 1.0
