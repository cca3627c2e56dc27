"""Do intervals by profile hold what a search by hand finds, and are they open where the data set no end?"""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from scipy.stats import binom

from identify.chain import Chain, plain_chain
from identify.fit import fit
from identify.joint import identify
from identify.model import LinearF, Model, Rational
from identify.observe import Observation
from identify.trace import Trace
from identify.uncertainty.profile import Fitted, profile

RATE_HZ = 100.0
REALISATIONS = 25
AT_S = np.arange(300) / RATE_HZ
STEP = np.where(np.arange(300) < 100, 0.0, 1.0)  # from 1 s on, held: it acts from t[100] on
TAU = Model("RC", Rational((1.0,), (0.05, 1.0)), LinearF(1.0), Rational((1.0,), (1.0,)), fixed=("F.offset",))
DELAY = replace(TAU, g2=Rational((1.0,), (1.0,), 0.004), fixed=("F.offset", "F.gain"))


def answer(tau_s: float, delay_s: float = 0.0) -> np.ndarray:
    """Return an RC section's answer to STEP in closed form."""
    return np.where(1.0 + delay_s < AT_S, 1.0 - np.exp(-np.maximum(AT_S - 1.0 - delay_s, 0.0) / tau_s), 0.0)


def observed(y: np.ndarray, noise_v: float) -> tuple[Observation, ...]:
    return (Observation(Trace("step", RATE_HZ, STEP, y), np.ones(y.size, dtype=bool), noise_v),)


def fitted(model: Model, seen: tuple[Observation, ...]) -> Fitted:
    chain = plain_chain(model)
    return Fitted(fit(chain, seen, fixed=model.fixed), seen, chain.values, model.fixed)


def told(name: str, chain: Chain) -> float:
    return chain.values[name]


def by_hand(y: np.ndarray, noise_v: float) -> tuple[float, float]:
    """Return the ends of the time constant's interval: the gain has its best value at each."""
    taus = np.geomspace(0.05 / 3.0, 0.15, 4000)  # as far as a fit may go
    cost = []
    for tau in taus:
        x, prior = answer(tau), (noise_v / (10.0 * 0.3)) ** 2
        gain = (x @ y + prior) / (x @ x + prior)
        misfit = np.sum((y - gain * x) ** 2)
        cost.append(misfit / noise_v**2)
    inside = taus[np.array(cost) - min(cost) < 3.8415]
    return float(inside[0]), float(inside[-1])


@pytest.mark.parametrize("seed", range(4))
def test_the_ends_are_where_the_cost_has_risen_by_a_95_percent_quantile(seed):
    noise_v = 0.35
    y = answer(0.05) + np.random.default_rng(seed).normal(0.0, noise_v, STEP.size)
    problem = fitted(TAU, observed(y, noise_v))
    sd = problem.best.sd("G1.den.s1") / problem.best.chain.values["G1.den.s1"]
    found = profile(problem, partial(told, "G1.den.s1"), sd)
    low, high = by_hand(y, noise_v)
    assert low > 0.017 or high < 0.14  # one end at least is told by the data
    assert (found.low or 0.05 / 3.0, min(found.high, 0.15)) == pytest.approx((low, high), rel=0.05)


def test_what_the_data_do_not_tell_has_no_ends():
    y = answer(0.05) + np.random.default_rng(1).normal(0.0, 20.0, STEP.size)
    found = profile(fitted(TAU, observed(y, 20.0)), partial(told, "G1.den.s1"), 1.0)
    assert (found.low, found.high) == (0.0, np.inf)


def test_a_delay_that_may_be_none_is_bounded_on_one_side_and_covered():
    noise_v, inside, open_ended = 0.05, 0, 0
    for seed in range(REALISATIONS):
        y = answer(0.05, 0.001) + np.random.default_rng([seed, 5]).normal(0.0, noise_v, STEP.size)
        problem = fitted(DELAY, observed(y, noise_v))
        late = "delay"
        sd = problem.best.sd(late) / problem.best.chain.values[late]
        found = profile(problem, partial(told, late), sd)
        inside += found.low <= 0.001 <= found.high
        open_ended += found.low == 0.0
        assert np.isfinite(found.high)
    assert open_ended >= REALISATIONS // 2
    assert inside >= binom.ppf(0.005, REALISATIONS, 0.95)


def test_an_answer_tells_a_doubtful_number_by_its_profile():
    noise_v = 0.05
    y = answer(0.05, 0.001) + np.random.default_rng(5).normal(0.0, noise_v, STEP.size)
    found = identify(replace(DELAY, noise_v=noise_v), [Trace("step", RATE_HZ, STEP, y)])
    told = found.to_dict()
    assert told["profiled"] == ["G2.dead_time"]
    assert told["delay_s"]["ci95"][0] == 0.0
    assert found.delay.value < found.delay.high < 0.02
