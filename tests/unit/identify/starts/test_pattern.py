"""Is a pattern of the rig's own dynamics seen in a residual of the noise's size, and is none seen in noise?"""

from dataclasses import replace

import numpy as np
from scipy.stats import kstest

from identify.chain import plain_chain, simulate
from identify.fit import fit
from identify.model import LinearF, Model, Rational
from identify.observe import Observation
from identify.stage import Place
from identify.starts.pattern import FALSE_ALARMS, Lead, pattern
from identify.starts.search import Judge, shortfall
from identify.trace import Trace
from tests.proof.cases import Concealed
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
STIMULI = (staircase("stairs", FIG13_LEVELS_V[::2], 0.02), sine("sine", 62.5, 6.0, 20, 1))
MODEL = model_of(RC)


def observations(seed: int, *concealed: Concealed) -> tuple[Observation, ...]:
    """Return what the bench of the trials records of the rig, with noise of its own."""
    rng = np.random.default_rng(seed)
    clean = [recorded(RC, stimulus, concealed, fine=8) for stimulus in STIMULI]
    noisy = [replace(trace, y=trace.y[:] + NOISE_V * rng.standard_normal(trace.size)) for trace in clean]
    return tuple(observed(trace, NOISE_V, 2) for trace in noisy)


def test_noise_alone_leaves_a_pattern_as_often_as_the_probability_says() -> None:
    found = []
    for seed in range(40):
        seen = observations(seed)
        found.append(pattern(fit(plain_chain(MODEL), seen), seen))
    assert kstest(found, "uniform").pvalue > 1e-3
    assert min(found) > FALSE_ALARMS


def test_a_pole_too_small_to_show_in_the_size_of_the_residual_is_seen() -> None:
    seen = observations(3, Concealed("extra_pole in G2", {"tau": 4e-5}))
    fitted = fit(plain_chain(MODEL), seen)
    assert Judge(seen, 200.0).at_noise(fitted)
    assert pattern(fitted, seen) < FALSE_ALARMS
    assert not Judge(seen, 200.0).settled(fitted)
    (said,) = shortfall(fitted, seen, 200.0)
    assert "no larger than the noise, but follows the rig's own signals" in said


def test_a_rig_without_poles_has_no_pattern() -> None:
    bare = replace(MODEL, g1=Rational((1.0,), (1.0,)), g2=Rational((1.0,), (1.0,)))
    seen = observations(1)
    assert pattern(fit(plain_chain(bare), seen), seen) == 1.0


def test_a_lead_adds_what_its_high_passes_leave_of_a_held_step() -> None:
    bare = Model("bare", Rational((1.0,), (1.0,)), LinearF(1.0), Rational((1.0,), (1.0,)))
    lead = Lead("lead", Place.SENSE, (0.003, 0.05))
    chain = plain_chain(bare).with_stage(lead, {"lead.0": 0.2, "lead.1": -0.1})
    u = np.repeat((0.0, 1.0), 500)
    late_s = np.arange(499) * 1e-4 + 1e-4  # after u[500] began to act
    wanted = 1.0 + 0.2 * np.exp(-late_s / 0.003) - 0.1 * np.exp(-late_s / 0.05)
    assert np.allclose(simulate(chain, Trace("step", 1e4, u, u))[501:], wanted, rtol=0, atol=1e-9)
