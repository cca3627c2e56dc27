"""Do innovations make white what wanders in front of a block, weighed as all readings together would be?"""

import numpy as np
import pytest
from scipy.signal import lfilter

from identify.colour import Colour, whitening
from identify.discretise import stepper
from identify.innovations import Wander, innovations

STEP_S, SIZE = 1e-3, 400
DEN = (1.0 / (2.0 * np.pi * 40.0), 1.0)


def wander(rng, use=None, size=SIZE):
    """Return what fades and is pushed now and then, and rests in between, behind a low-pass of 40 Hz."""
    moves = (np.arange(size) // 50) % 2 == 0
    keeps = np.where(moves, rng.uniform(0.7, 1.0, size), 1.0)
    gains = np.where(moves, rng.uniform(0.0, 4.0, size), 0.0)
    return Wander(keeps, gains, stepper((1.0,), DEN, STEP_S, "ramp"), np.ones(size, bool) if use is None else use)


def passed(w):
    """Return what the low-pass makes of straight lines between values, at rest before, from the solution by hand."""
    fades = np.exp(-STEP_S / DEN[0])
    late = 1.0 - DEN[0] / STEP_S * (1.0 - fades)
    return lfilter([late, 1.0 - fades - late], [1.0, -fades], w)


def covariance(wander):
    """Return that of all readings, from what every push does to each of them: a witness without a filter."""
    size = wander.use.size
    answers = np.zeros((size, size))
    for k in range(size):  # what a push of one at k leaves
        w = np.zeros(size)
        w[k:] = np.cumprod(np.append(1.0, wander.keeps[k + 1 :]))
        answers[:, k] = passed(w)
    return answers @ np.diag(wander.gains) @ answers.T + np.eye(size)


@pytest.mark.parametrize("lost", [(), (3, 4, 5, 120, 399)])
def test_innovations_weigh_readings_as_the_covariance_of_all_of_them_does(lost):
    rng = np.random.default_rng(1)
    use = np.ones(SIZE, dtype=bool)
    use[list(lost)] = False
    it, values = wander(rng, use), rng.standard_normal(SIZE)
    white = innovations(it)(values, use)
    matrix = covariance(it)[np.ix_(use, use)]
    assert float(white @ white) == pytest.approx(values[use] @ np.linalg.solve(matrix, values[use]), rel=1e-9)
    assert float(np.sum(it.logs)) == pytest.approx(np.linalg.slogdet(matrix)[1], rel=1e-9)
    assert white.size == use.sum()


def test_what_wanders_is_white_and_of_rms_one_behind_them():
    rng = np.random.default_rng(2)
    it = wander(rng, size=200 * SIZE)
    w, pushes = np.zeros(it.use.size), rng.standard_normal(it.use.size) * np.sqrt(it.gains)
    for k in range(it.use.size):
        w[k] = it.keeps[k] * w[k - 1] + pushes[k]
    y = passed(w)
    y += rng.standard_normal(y.size)
    white = innovations(it)(y, it.use)
    assert float(np.mean(np.square(y))) > 5.0
    assert float(np.mean(np.square(white))) == pytest.approx(1.0, abs=0.02)
    assert abs(float(np.mean(white[1:] * white[:-1]))) < 0.015
    assert abs(float(np.mean(white[25:] * white[:-25]))) < 0.015


@pytest.mark.parametrize("columns", [1, 3, 4, 8, 19])
def test_the_filter_goes_on_from_chunk_to_chunk_and_takes_columns_side_by_side(columns):
    rng = np.random.default_rng(3)
    use = rng.random(SIZE) < 0.9
    it, values = wander(rng, use), rng.standard_normal((SIZE, columns))
    whole, run = innovations(it)(values, it.use), whitening(Colour(wander=it))
    parts = [run(values[at], it.use[at]) for at in (slice(0, 7), slice(7, 250), slice(250, SIZE))]
    assert np.allclose(np.concatenate(parts), whole, rtol=1e-12, atol=1e-12)
    alone = [innovations(it)(column, it.use) for column in values.T]
    assert np.allclose(np.stack(alone, axis=1), whole, rtol=1e-12, atol=1e-12)


def test_where_nothing_wanders_readings_stay_as_they_are():
    still = Wander(np.ones(SIZE), np.zeros(SIZE), stepper((1.0,), DEN, STEP_S, "ramp"), np.ones(SIZE, bool))
    values = np.random.default_rng(4).standard_normal(SIZE)
    assert np.array_equal(innovations(still)(values, still.use), values)
    assert not np.any(still.logs)
    assert not Colour(wander=still).white


def test_what_wanders_beside_means_is_what_wanders_at_every_fifth_instant():
    m, groups = 5, 40
    rng = np.random.default_rng(4)
    it = wander(rng, size=1 + m * groups)
    fewer = it.of_means(m, np.ones(1 + groups, dtype=bool))
    every, there = 0.0, 0.0
    for k in range(groups + 1):  # the variance of what wanders, whose means have a fifth of the noise's
        for j in range(m if k else 1):
            at = 1 + m * (k - 1) + j if k else 0
            every = it.keeps[at] ** 2 * every + it.gains[at]
        there = fewer.keeps[k] ** 2 * there + fewer.gains[k]
        assert there == pytest.approx(m * every, rel=1e-12)
    levels = rng.standard_normal(1 + groups)
    straight = np.interp(np.arange(1 + m * groups), m * np.arange(1 + groups), levels)
    rows, g0, g1, c, d = fewer.system
    x, expected = np.zeros(g0.size), passed(straight - straight[0])[::m]
    for k in range(groups):
        x = rows @ x + g0 * (levels[k] - levels[0]) + g1 * (levels[k + 1] - levels[0])
        assert c @ x + d * (levels[k + 1] - levels[0]) == pytest.approx(expected[k + 1], rel=1e-9, abs=1e-12)
