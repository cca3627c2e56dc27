"""Is a fit that failed told from one that did not, and are other starts tried only then?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.blocks import LinearBlock, Play
from identify.chain import plain_chain
from identify.fit import Fit, fit
from identify.model import Backlash, Model, Rational
from identify.stage import Place
from identify.starts.search import Judge, around, freed, on_bound, scaled, searched, shortfall
from identify.starts.thinning import thinned
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
OBSERVATIONS = tuple(
    observed(recorded(RC, stimulus, noise_v=NOISE_V, seed=2, fine=8), NOISE_V, 1)
    for stimulus in (staircase("stairs", FIG13_LEVELS_V[::2], 0.02), sine("sine", 62.5, 6.0, 20, 1))
)
JUDGE = Judge(OBSERVATIONS)
TRUE = model_of(RC)


@pytest.fixture(scope="module")
def good() -> Fit:
    return fit(plain_chain(TRUE), OBSERVATIONS)


def test_a_good_fit_is_kept_as_it_is(good: Fit) -> None:
    assert JUDGE.settled(good)
    assert searched(TRUE, JUDGE, good, plain_chain(TRUE)) is good
    assert shortfall(good, OBSERVATIONS, float("inf")) == ()


def test_a_fit_on_its_bound_says_so_and_is_set_free() -> None:
    start = plain_chain(TRUE).with_values({"G2.den.s1": 2e-4})
    stuck = fit(start, OBSERVATIONS)
    assert on_bound(stuck) == ("G2.den.s1",)
    assert not JUDGE.settled(stuck)
    assert any("G2.den.s1 sits on the bound" in said for said in shortfall(stuck, OBSERVATIONS, float("inf")))
    assert JUDGE.settled(searched(TRUE, JUDGE, stuck, start))


def test_a_residual_a_little_above_the_noise_says_so(good: Fit) -> None:
    quieter = tuple(replace(o, noise_v=0.93 * NOISE_V) for o in OBSERVATIONS)
    said = shortfall(fit(plain_chain(TRUE), quieter), quieter, float("inf"))
    assert len(said) == 1
    assert "more than chance does" in said[0]
    assert shortfall(good, OBSERVATIONS, 50.0) == ()


def test_slow_and_fast_block_exchanged_are_put_right() -> None:
    swapped = plain_chain(replace(TRUE, g1=TRUE.g2, g2=TRUE.g1))
    wrong = fit(swapped, OBSERVATIONS)
    found = searched(TRUE, JUDGE, wrong, swapped)
    assert JUDGE.settled(found)
    assert found.chain.values["G1.den.s1"] == pytest.approx(0.02, rel=0.01)


def test_a_chain_set_free_answers_as_before_without_bounds() -> None:
    g1, g2 = Rational((1.0,), (1e-4, 20.0, 1000.0)), Rational((1.0,), (1.0, 1.0))
    model = Model("", g1, Backlash(2.0, 1.0, 2.0, -1.0), g2)
    chain = plain_chain(model).with_values({"G1.den.s1": 0.5, "F.D_L": 4.0})
    free = freed(chain, ("G2",))
    assert free.values == pytest.approx(dict(chain.values))
    blocks = {stage.name: stage for stage in free.stages}
    assert [p.within for p in blocks["G1"].parameters()] == [None, None]
    assert blocks["G2"] is chain.stages[-1]
    play = free.stage_of(Play)
    assert play is not None
    assert play.start.d_l_v == 4.0


def test_poles_that_met_share_a_section_once_free() -> None:
    block = LinearBlock(Rational((1.0,), tuple(np.poly([-1.0, -2.0, -30.0, -40.0]).tolist())), "G1", Place.G1)
    chain = plain_chain(replace(TRUE, g1=block.start))
    apart = (1.0 / 30.0, 31.0 / 30.0, 1.0 / 80.0, 42.0 / 80.0)  # the poles 1 and 30, and 2 and 40
    names = [p.name for p in block.parameters()]
    free = freed(chain.with_values(dict(zip(names, apart, strict=True))), ())
    assert [free.values[name] for name in names] == pytest.approx(block.start_values(), rel=1e-6)


def test_draws_leave_alone_what_is_fixed() -> None:
    chain, rng = plain_chain(TRUE), np.random.default_rng(0)
    drawn = [around(chain, ("G2",), rng) for _ in range(20)]
    assert {d.values["G2.den.s1"] for d in drawn} == {chain.values["G2.den.s1"]}
    assert len({d.values["G1.den.s1"] for d in drawn}) == 20


def test_slopes_are_scaled_to_the_readings() -> None:
    off = plain_chain(replace(TRUE, f=Backlash(2.0, 1.25, 2.0, -1.25)))
    cost, chain = scaled(off, (), OBSERVATIONS)
    assert chain.values["F.S_L"] == pytest.approx(8.0, rel=1e-2)
    count = sum(o.count for o in OBSERVATIONS)
    assert cost == pytest.approx(count, rel=0.05)
    held, same = scaled(off, ("F",), OBSERVATIONS)
    assert same is off
    assert held > 10.0 * cost


def test_thinned_recordings_are_small_and_tell_the_same() -> None:
    long = observed(recorded(RC, staircase("stairs", FIG13_LEVELS_V, 0.3), noise_v=NOISE_V, seed=4, fine=4), NOISE_V, 1)
    (thin,) = thinned((long,))
    assert thin.trace.size <= 40_000
    assert thin.trace.rate_hz < long.trace.rate_hz
    found = fit(plain_chain(TRUE), (thin,))
    assert found.chain.values["F.D_L"] == pytest.approx(1.25, abs=0.02)
    (same,) = thinned(OBSERVATIONS[1:])
    assert same is OBSERVATIONS[1]
