"""Do the times come out as theory says, and do whole repetitions fit?"""

import numpy as np
import pytest
from scipy.optimize import minimize

from identify.planning.allocation import LOSS, Choice, spread, thinned, whole

TINY = 1e-9 * np.eye(2)


def separate(times: tuple[float, float] = (1.0, 1.0), weights: tuple[float, float] = (0.5, 0.5)) -> Choice:
    """Return two stimuli of which each tells one of two numbers, at different rates."""
    matrices = np.array([[np.diag([4.0, 0.0]), np.diag([0.0, 9.0])]])
    return Choice(matrices, np.eye(2)[None], np.array([weights]), TINY, np.array(times))


def random_choice(seed: int, stimuli: int = 12, size: int = 4, rigs: int = 2) -> Choice:
    draw = np.random.default_rng(seed)
    factors = draw.normal(size=(rigs, stimuli, size, 2))
    matrices = np.einsum("rcik,rcjk->rcij", factors, factors)
    slopes = draw.normal(size=(rigs, 5, size))
    weights, times_s = np.full((rigs, 5), 0.2 / rigs), draw.uniform(0.5, 2, stimuli)
    return Choice(matrices, slopes, weights, 1e-6 * np.eye(size), times_s)


def test_stimuli_that_tell_one_number_each_share_the_time_by_its_weight() -> None:
    assert spread(separate(), 10.0) == pytest.approx([0.5, 0.5], abs=1e-6)
    assert spread(separate(weights=(0.8, 0.2)), 10.0) == pytest.approx([0.8, 0.2], abs=1e-6)
    assert spread(separate(times=(2.0, 0.1)), 10.0) == pytest.approx([0.5, 0.5], abs=1e-6)


def test_no_other_shares_of_the_time_do_better() -> None:
    choice = random_choice(0, 8)

    def cost(logits: np.ndarray) -> float:
        weights = np.exp(logits - np.max(logits))
        return choice.score(weights / np.sum(weights) * 10.0 / choice.times_s)

    ours = choice.score(spread(choice, 10.0, 2000) * 10.0 / choice.times_s)
    best = minimize(cost, np.zeros(8), method="BFGS").fun
    assert ours <= best + 1e-3


def test_shares_add_up_to_what_the_data_tell() -> None:
    choice = random_choice(7)
    assert np.sum(choice.shares(np.full(12, 100.0))) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("seed", range(2))
def test_fewer_steps_cost_little_and_those_that_must_stay(seed: int) -> None:
    choice = random_choice(seed, 40)
    kept = np.zeros(40, dtype=bool)
    kept[3] = True
    mask = thinned(choice, 100.0, kept)
    assert mask[3]
    assert np.count_nonzero(mask) < 12
    best = choice.score(spread(choice, 100.0) * 100.0 / choice.times_s)
    part = choice.part(mask)
    assert part.score(spread(part, 100.0) * 100.0 / part.times_s) < best + 3.0 * LOSS


@pytest.mark.parametrize("seed", range(3))
def test_whole_repetitions_fit_the_time_and_no_exchange_of_one_helps(seed: int) -> None:
    choice = random_choice(seed, 5)
    least = np.array([2, 0, 0, 0, 0])
    counts = whole(choice, 20.0, least)
    assert counts @ choice.times_s <= 20.0
    assert np.all(counts >= least)
    here = choice.score(counts)
    for one in np.flatnonzero(counts > least):
        for other in range(5):
            moved = counts.copy()
            moved[one] -= 1
            moved[other] += 1
            if moved @ choice.times_s <= 20.0:
                assert choice.score(moved) >= here - 1e-8
