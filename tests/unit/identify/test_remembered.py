"""Is a question about a hypothesis asked once, also where nothing of what it hangs on has changed?"""

from dataclasses import replace

import pytest

import identify.explain.bench as benches
from identify.effects import catalogue, chain_of
from identify.explain.bench import ENOUGH, Bench
from identify.explain.beside import foretelling
from identify.explain.hypothesis import Hypothesis
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01


@pytest.fixture
def plain() -> tuple[Bench, Hypothesis]:
    run = recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V, 0.02), (), NOISE_V, 3)
    bench = Bench(chain_of(model_of(OP_AMP)), (observed(run, NOISE_V, 1),), (), tuple(catalogue().values()))
    return bench, bench.fitted(bench.plain, (), 1)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Return a list that gets a number every time corrections of free form are looked through."""
    times: list[float] = []

    def seen(evidence: benches.Evidence) -> list[benches.Suspect]:
        times.append(evidence.left)
        return []

    monkeypatch.setattr(benches, "suspects", seen)
    return times


def finer(bench: Bench, base: Hypothesis, by: float) -> tuple[Bench, Hypothesis]:
    """Return a bench on a finer grid and the same fit there, which leaves more by some chi-squared."""
    observations = tuple(replace(o, substeps=2) for o in bench.observations)
    there = replace(bench, observations=observations, asked={}, coarser=bench)
    return there, replace(base, chi2=base.chi2 + by, data=there.observations)


def test_other_kinds_make_no_difference_to_free_forms(plain: tuple[Bench, Hypothesis], asked: list[float]) -> None:
    bench, base = plain
    bench.suspects(base)
    fewer = foretelling(bench)
    assert len(fewer.kinds) < len(bench.kinds)
    fewer.suspects(base)
    assert len(asked) == 1


@pytest.mark.parametrize(("by", "times"), [(0.5 * ENOUGH, 1), (2.0 * ENOUGH, 2)])
def test_a_finer_grid_that_changes_no_odds_asks_nothing_again(
    by: float, times: int, plain: tuple[Bench, Hypothesis], asked: list[float]
) -> None:
    bench, base = plain
    bench.suspects(base)
    there, again = finer(bench, base, by)
    there.suspects(again)
    there.suspects(again)
    assert len(asked) == times


def test_promises_on_a_coarser_grid_come_with_the_chi_squared_they_would_lower(
    plain: tuple[Bench, Hypothesis], asked: list[float]
) -> None:
    bench, base = plain
    bench.suspects(base)
    there, again = finer(bench, base, 10.0)
    assert there.suspects_near(again, 11.0) == (base.chi2, [])
    assert len(asked) == 1
    assert there.suspects_near(again, 9.0) == (again.chi2, [])
    assert there.suspects_near(again, 11.0) == (again.chi2, [])
    assert len(asked) == 2
