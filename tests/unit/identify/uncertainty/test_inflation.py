"""Are intervals widened where a residual is larger than noise or hangs together, and left alone where it is noise?"""

import numpy as np
import pytest
from scipy.signal import lfilter

from identify.chain import plain_chain
from identify.model import LinearF, Model, Rational
from identify.noise import DWELLS_SHARE, PERIODS_SHARE, noise_of
from identify.observe import Observation
from identify.trace import Trace
from identify.uncertainty.inflation import inflation

NOTHING = plain_chain(Model("nothing", Rational((1.0,), (1.0,)), LinearF(1.0), Rational((1.0,), (1.0,))))
NOISE_V = 0.01


def inflated(residual, freedom=float("inf")):
    """Return the factor for a rig at rest that leaves this residual, in units of the noise."""
    trace = Trace("rest", 1e3, np.zeros(residual.size), NOISE_V * residual)
    return inflation(NOTHING, [Observation(trace, np.ones(residual.size, dtype=bool), NOISE_V)], freedom)


def test_noise_of_the_known_size_never_widens_an_interval():
    assert all(inflated(np.random.default_rng(seed).normal(size=40_000)) == 1.0 for seed in range(40))


@pytest.mark.parametrize("excess", [1.1, 2.0])
def test_a_residual_above_the_noise_widens_by_its_excess(excess):
    assert inflated(excess * np.random.default_rng(1).normal(size=40_000)) == pytest.approx(excess, rel=0.05)


def test_a_residual_that_hangs_together_widens_by_what_its_sums_scatter():
    white = np.random.default_rng(2).normal(size=200_000)
    coloured = lfilter([np.sqrt(1.0 - 0.9**2)], [1.0, -0.9], white)  # of rms one; long sums scatter sqrt(19) as much
    assert inflated(coloured) == pytest.approx(np.sqrt(19.0), rel=0.2)


def test_an_excess_that_the_noises_own_doubt_explains_does_not_count():
    residual = 1.1 * np.random.default_rng(3).normal(size=40_000)
    assert inflated(residual, freedom=100.0) == 1.0
    assert inflated(residual, freedom=10_000.0) > 1.05


@pytest.mark.parametrize(("u", "share"), [(np.zeros(400), DWELLS_SHARE), (np.tile(np.arange(40.0), 10), PERIODS_SHARE)])
def test_the_noise_is_known_as_well_as_it_says(u, share):
    """400 estimates scatter as ``freedom`` independent readings would let them: to 1 / sqrt(800) = 3.5 %."""
    rng = np.random.default_rng(4)
    found = [noise_of([Trace("n", 1.0, u, rng.normal(size=u.size))], 1.0) for _ in range(400)]
    spread = np.var([noise.rms_v**2 for noise in found])
    assert found[0].freedom == pytest.approx(share * u.size, rel=0.3)
    assert spread == pytest.approx(2.0 / found[0].freedom, rel=4.0 * np.sqrt(2.0 / 400.0))
