"""Are dwells that are counted as samples come those that a look at the whole recording finds?"""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from identify.noise import settled_dwells
from identify.staircase import ENOUGH
from rig.live.dwells import MOST, Dwells
from tests.unit.rig.live.test_envelope import CUTS, pieces

SETTLE = 8
LENGTHS = st.lists(st.integers(1, 40), min_size=1, max_size=30)


def staircase(lengths: list[int]) -> np.ndarray:
    """Return levels 0, 1, 2, 0, 1, 2, ... V, each for so many samples: a level comes back."""
    return np.repeat(np.arange(len(lengths)) % 3.0, lengths)


@given(LENGTHS, CUTS)
def test_means_are_those_of_settled_readings_however_samples_arrive(lengths: list[int], cuts: list[int]) -> None:
    u = staircase(lengths)
    y = np.random.default_rng(u.size).standard_normal(u.size)
    came = np.random.default_rng(u.size + 1).random(u.size) > 0.1
    dwells = Dwells(SETTLE)
    for first, stop in pieces(u.size, cuts):
        dwells.add(u[first:stop], np.where(came, y, 0.0)[first:stop], came[first:stop])
    edges = np.cumsum([0, *lengths])
    whole = [(u[a], y[a + SETTLE : b][came[a + SETTLE : b]]) for a, b in pairwise(edges)]
    expected = [(level, held.mean(), held.size) for level, held in whole if held.size >= ENOUGH]
    found = [(dwell.level_v, dwell.mean_v, dwell.count) for dwell in dwells.found]
    assert [(level, count) for level, _, count in found] == [(level, count) for level, _, count in expected]
    assert [mean for _, mean, _ in found] == pytest.approx([mean for _, mean, _ in expected])


def test_they_agree_with_what_identification_takes_for_settled() -> None:
    u = staircase([30, 5, 60, 20])
    dwells = Dwells(SETTLE)
    dwells.add(u, u, np.ones(u.size, dtype=bool))
    settled = [u[start] for start, stop in settled_dwells(u, SETTLE) if stop - start >= ENOUGH]
    assert [dwell.level_v for dwell in dwells.found] == settled


def test_noise_is_told_from_settled_readings_and_not_before_there_are_some() -> None:
    dwells, rng = Dwells(SETTLE), np.random.default_rng(1)
    assert dwells.noise_v is None
    for level in range(40):
        u = np.full(200, float(level))
        dwells.add(u, 3.0 * u + 0.02 * rng.standard_normal(u.size), np.ones(u.size, dtype=bool))
    assert dwells.noise_v == pytest.approx(0.02, rel=0.03)


def test_a_signal_that_never_stands_still_has_none_and_memory_has_an_end() -> None:
    moving = Dwells(SETTLE)
    moving.add(np.sin(np.arange(5000.0)), np.zeros(5000), np.ones(5000, dtype=bool))
    assert moving.found == ()
    many = Dwells(0)
    for level in range(3 * MOST):
        many.add(np.full(ENOUGH, float(level)), np.zeros(ENOUGH), np.ones(ENOUGH, dtype=bool))
    assert len(many.found) == MOST
    assert many.found[-1].level_v == 3 * MOST - 1
