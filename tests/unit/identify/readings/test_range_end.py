"""Is the end of the ADC's range told from the readings alone, and from nothing that only looks like it?"""

import numpy as np
import pytest

from identify.readings.range_end import range_ends
from identify.trace import Trace
from tests.proof.cases import Concealed
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import noisy, recorded

NOISE_V = OP_AMP.noise_v
STAIRS = staircase("stairs", FIG13_LEVELS_V, 0.05, 2)
SINE = sine("sine", 10.0, 3.4, 5, 2)
RAIL_V = 6.0


def quiet(stimulus, *physics):
    return recorded(OP_AMP, stimulus, physics)


def clipped(trace, upper=np.inf, lower=-np.inf, lsb=0.0):
    y = np.clip(trace.y, lower, upper)
    return Trace(trace.name, trace.rate_hz, trace.u, lsb * np.rint(y / lsb) if lsb else y)


def read(stimulus, *physics, seed=3):
    return noisy(quiet(stimulus, *physics), NOISE_V, seed)


@pytest.mark.parametrize("stimulus", [STAIRS, SINE], ids=lambda s: s.name)
@pytest.mark.parametrize("lsb", [0.0, 0.002])
def test_an_end_that_stops_the_noise_is_told_exactly_and_what_it_cut_is_left_out(stimulus, lsb):
    trace = clipped(read(stimulus), upper=RAIL_V, lsb=lsb)
    (seen,), (told,) = range_ends([trace], NOISE_V)
    assert set(told.values) == {"upper"}
    assert told.values["upper"].low <= RAIL_V <= told.values["upper"].high
    assert told.values["upper"].high - told.values["upper"].low <= max(lsb, 1e-7)
    assert told.p_value < 1e-6
    left_out = ~seen.valid
    without_it = quiet(stimulus).y > RAIL_V - 2.0 * NOISE_V
    assert np.all(left_out[without_it & (trace.y > RAIL_V - NOISE_V)])
    assert np.count_nonzero(left_out & ~without_it) < 0.02 * trace.size


def test_both_ends_are_told_and_counted_over_all_recordings():
    traces = [clipped(read(s, seed=i), RAIL_V, -7.0) for i, s in enumerate((STAIRS, SINE))]
    seen, (told,) = range_ends(traces, NOISE_V)
    assert (told.values["upper"].value, told.values["lower"].value) == (RAIL_V, -7.0)
    assert [trace.name for trace in seen] == ["stairs", "sine"]


def test_of_short_visits_to_the_end_none_is_left_that_its_noise_has_chosen():
    answer = np.where(np.arange(8000) % 20 < 3, RAIL_V - 0.5 * NOISE_V, 0.0)
    noise = np.random.default_rng(8).normal(0.0, NOISE_V, answer.size)
    visits = Trace("visits", 1e4, answer, np.minimum(answer + noise, RAIL_V))
    (seen,), _ = range_ends([visits], NOISE_V)
    left = (seen.y - answer)[seen.valid & (answer > 0.0)]
    assert left.size == 0
    assert np.count_nonzero(seen.valid) > 3000


@pytest.mark.parametrize("below", [3.5, 4.0, 4.5, 5.0])
def test_of_a_level_a_little_below_the_end_the_noise_does_not_choose_what_counts(below):
    """Were the highest readings of it left out, the others would look like a rail just below it."""
    answer = np.where(np.arange(40_000) % 4000 < 2000, RAIL_V - below * NOISE_V, RAIL_V)
    noise = np.random.default_rng(9).normal(0.0, NOISE_V, answer.size)
    (seen,), (told,) = range_ends([Trace("held", 1e4, answer, np.minimum(answer + noise, RAIL_V))], NOISE_V)
    assert told.p_value < 1e-6
    left = (seen.y - answer)[seen.valid & (answer < RAIL_V)]
    assert abs(np.sum(left)) <= 4.0 * NOISE_V * np.sqrt(left.size)


def test_few_readings_at_one_value_are_an_end_beside_as_many_in_a_stretch_far_wider():
    y = np.random.default_rng(10).uniform(-1.0, 0.0, 10_000)
    y[::290] = 1e-5  # 35 of them, beside 25 within a quarter of the noise
    _, (told,) = range_ends([Trace("some", 1e4, y, y)], NOISE_V)
    assert told.p_value < 1e-9


@pytest.mark.parametrize("trace", [
    read(STAIRS), read(SINE), read(STAIRS, Concealed("saturation", {"upper": 10.0, "lower": -10.0})),
    clipped(read(STAIRS), lsb=0.004), clipped(read(SINE), lsb=0.02), clipped(read(STAIRS), RAIL_V, lsb=0.05),
], ids=["clean", "clean sine", "rails of F", "fine steps", "coarse steps", "wide steps"])  # fmt: skip
def test_what_only_looks_like_it_is_left_as_it_is(trace):
    seen, told = range_ends([trace], NOISE_V)
    assert told == ()
    assert seen == (trace,)


@pytest.mark.parametrize("noise_v", [1e-7, 1e-4])
def test_periods_without_noise_that_are_alike_to_the_last_digit_have_no_end(noise_v):
    """As of a simulation: the highest reading is read again in every period, and what is before it, too."""
    repeated = quiet(sine("sine", 10.0, 3.4, 40, 2))
    repeated = Trace("same", 1e4, repeated.u, np.tile(repeated.y[40_000:41_000], 80))
    assert np.count_nonzero(repeated.y >= repeated.y.max() - 1e-9) > 25
    assert range_ends([repeated], noise_v)[1] == ()


@pytest.mark.parametrize("noise_v", [0.0, 1e-9])
def test_where_no_noise_is_that_an_end_could_stop_none_is_told(noise_v):
    assert range_ends([quiet(STAIRS)], noise_v)[1] == ()
