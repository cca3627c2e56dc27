"""Is what a stimulus is said to tell apart what a refit of the false hypothesis really finds?"""

import numpy as np
import pytest

from identify.chain import Chain, simulate
from identify.effects import catalogue, chain_of
from identify.fit import Fit, chi_squared, fit
from identify.model import Model, Rational
from identify.observe import FINEST, Observation
from identify.planning.candidates import Room, Stairs, Tone
from identify.planning.discrimination import ENOUGH, LEAST, chosen, of_every_kind, rival, spread, told
from identify.planning.separators import kind_of, separators
from identify.trace import Array, Trace
from tests.unit.identify.planning.test_design import RC

RATE_HZ, NOISE_V = 4000.0, 0.01
POLE, DELAY = (next(catalogue()[name].variants()) for name in ("extra_pole", "dead_time"))
STEPS = np.repeat([2.0, 3.0, 1.0, -1.0, -3.0, -2.0, 0.5], 240)


def observed(name: str, chain: Chain, u: Array) -> Observation:
    trace = Trace(name, RATE_HZ, u, np.zeros_like(u))
    answer = simulate(chain, trace, FINEST)
    return Observation(Trace(name, RATE_HZ, u, answer), np.ones(u.size, dtype=bool), NOISE_V, FINEST)


@pytest.fixture(scope="module")
def true() -> Chain:
    return POLE.put_in(chain_of(RC), {"tau": 2e-4})


def fitted(true: Chain, start: Chain, *stimuli: Array) -> tuple[Fit, float]:
    data = [observed(f"run {k}", true, u) for k, u in enumerate(stimuli)]
    found = fit(start, data)
    return found, sum(chi_squared(found.chain, o) for o in data)


def test_the_expected_rise_of_chi_squared_is_that_of_a_refit(true: Chain) -> None:
    false, before = fitted(true, DELAY.put_in(chain_of(RC), {"delay": 2e-4}), STEPS)
    right, _ = fitted(true, true, STEPS)
    u = Tone(30.0, 7.5, 0.0, 6).drawn(RATE_HZ)
    rivals = [rival(right, 0.5, ()), rival(false, 0.5, ())]
    expected = told(rivals, u, RATE_HZ, NOISE_V, FINEST).sharpness(rivals)[0, 1]
    _, after = fitted(true, false.chain, STEPS, u)
    assert expected**2 == pytest.approx(after - before, rel=0.15)
    plain = told(rivals, u, RATE_HZ, NOISE_V).energy[0, 1]
    assert expected**2 < 0.8 * plain


def test_one_hypothesis_is_not_told_from_itself(true: Chain) -> None:
    found, _ = fitted(true, true, STEPS)
    rivals = [rival(found, 0.5, ()), rival(found, 0.5, ())]
    sums = [told(rivals, STEPS, RATE_HZ, NOISE_V)]
    choice = chosen(rivals, sums, [1.0], 10.0)
    assert max(choice.sharpness.values()) < LEAST
    assert choice.repeats == (0,)


def test_what_decides_soonest_is_played_and_no_more(true: Chain) -> None:
    right, _ = fitted(true, true, STEPS)
    false, _ = fitted(true, DELAY.put_in(chain_of(RC), {"delay": 2e-4}), STEPS)
    rivals = [rival(right, 0.6, ()), rival(false, 0.4, ())]
    drawn = [Tone(5.0, 0.5, 0.0, 1), Tone(30.0, 7.5, 0.0, 6)]
    sums = [told(rivals, c.drawn(RATE_HZ), RATE_HZ, NOISE_V) for c in drawn]
    choice = chosen(rivals, sums, [c.time_s for c in drawn], 3.0)
    assert choice.repeats[0] == 0 < choice.repeats[1]
    assert min(choice.sharpness.values()) > 0.9 * ENOUGH
    assert sum(n * c.time_s for n, c in zip(choice.repeats, drawn, strict=True)) <= 3.0


ROOMS = (Room(-6.0, 6.0, 4000.0, 10.0), Room(-1.0, 7.0, 4000.0, 10.0, 2000.0), Room(-1.0, 7.0, 4000.0, 10.0))


@pytest.mark.parametrize("room", ROOMS)
def test_nothing_is_offered_beyond_the_limits(room: Room) -> None:
    found = separators(RC, room)
    for candidate in found:
        u = candidate.drawn(room.rate_hz)
        assert room.low_v <= u.min() <= u.max() <= room.high_v
        assert np.max(np.abs(np.diff(u))) * room.rate_hz <= room.slew_v_per_s
    assert len({kind_of(c) for c in found}) > 2


def test_what_identification_leaves_out_is_offered() -> None:
    found = separators(Model("line", Rational((1.0,), (0.02, 1.0)), RC.f, RC.g2), Room(-6.0, 6.0, 4000.0, 10.0))
    stuck = [c for c in found if isinstance(c, Tone) and c.amplitude_v < 1.25]
    holds = {c.dwell_s for c in found if isinstance(c, Stairs)}
    assert stuck
    assert max(holds) > 8.0 * min(holds)


def test_every_kind_keeps_its_share_of_what_is_weighed() -> None:
    assert spread([5.0, 4.0, 3.0, 1.0, 0.5], ["a", "a", "a", "b", "b"], 2) == [0, 3]


def test_where_no_hypothesis_is_the_truth_every_kind_of_stimulus_is_played_once(true: Chain) -> None:
    """The one that tells most of each; a kind that takes more than its share of the time is left out."""
    right, _ = fitted(true, true, STEPS)
    false, _ = fitted(true, DELAY.put_in(chain_of(RC), {"delay": 2e-4}), STEPS)
    rivals = [rival(right, 0.6, ()), rival(false, 0.4, ())]
    weak, strong = Tone(30.0, 2.0, 0.0, 6), Tone(30.0, 7.5, 0.0, 6)
    walk, slow = (Stairs((2.0, 3.0, -1.0, -3.0, 0.5), dwell_s, readable=False) for dwell_s in (0.05, 1.0))
    offered = [weak, strong, walk, slow]
    sums = [told(rivals, c.drawn(RATE_HZ), RATE_HZ, NOISE_V) for c in offered]
    times_s = [c.time_s for c in offered]
    choice = of_every_kind(rivals, sums, [kind_of(c) for c in offered], times_s, 3.0)
    assert choice.repeats == (0, 1, 1, 0)
    alone = [sums[k].sharpness(rivals) for k in (1, 2)]
    assert all(choice.sharpness[pair] > max(one[pair] for one in alone) for pair in choice.sharpness)
    faint = [told(rivals, c.drawn(RATE_HZ), RATE_HZ, 20.0 * NOISE_V) for c in offered]
    more = of_every_kind(rivals, faint, [kind_of(c) for c in offered], times_s, 3.0)
    assert more.repeats == (0, 5, 4, 0)
    assert sum(n * t for n, t in zip(more.repeats, times_s, strict=True)) <= 3.0
