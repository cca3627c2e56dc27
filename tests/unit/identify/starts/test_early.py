"""Are other starts tried on the beginning of a long run, and judged on all of it?"""

import numpy as np
import pytest

from identify.chain import plain_chain
from identify.fit import fit
from identify.starts import early
from identify.starts.early import sought
from identify.starts.search import Judge
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, staircase
from tests.trials import model_of, noisy, observed, recorded

MODEL = model_of(RC)
SEEN = (observed(noisy(recorded(RC, staircase("stairs", FIG13_LEVELS_V[::2], 0.1)), 0.01, 1), 0.01, 1),)
WRONG = plain_chain(MODEL).with_values({"F.D_L": 2.0, "G1.den.s1": 0.05})


@pytest.fixture
def looked_at(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    sizes = []

    def remembered(model, judge, first, start):
        sizes.append(judge.observations[0].trace.size)
        return first

    monkeypatch.setattr(early, "searched", remembered)
    return sizes


def test_a_long_run_is_searched_by_its_beginning_and_fitted_as_a_whole(monkeypatch, looked_at):
    monkeypatch.setattr(early, "TRIED", 4000)
    failed = fit(WRONG, SEEN, iterations=0)
    found = sought(MODEL, Judge(SEEN), failed, WRONG)
    assert looked_at == [4000]
    assert Judge(SEEN).at_noise(found)
    assert found.chain.values["F.D_L"] == pytest.approx(1.25, abs=5e-3)


def test_a_run_that_is_not_long_is_searched_as_it_is(looked_at):
    failed = fit(WRONG, SEEN, iterations=0)
    assert sought(MODEL, Judge(SEEN), failed, WRONG) is failed
    assert looked_at == [SEEN[0].trace.size]


def test_a_good_fit_is_kept(monkeypatch, looked_at):
    monkeypatch.setattr(early, "TRIED", 4000)
    good = fit(plain_chain(MODEL), SEEN)
    assert np.isfinite(good.cost)
    assert sought(MODEL, Judge(SEEN), good, WRONG) is good
