"""Does the band of a simulated answer hold the true one, and is it as wide as the doubt of the values makes it?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.joint import identify
from identify.model import Doubt, LinearF, Model, Rational
from identify.trace import Step, Trace
from identify.uncertainty.band import half_band
from identify.uncertainty.certainty import Certainty
from tests.proof.bench import answer
from tests.proof.integrator import Grid
from tests.proof.rigs import RC, toleranced
from tests.proof.stimuli import FIG13_LEVELS_V, RATE_HZ, multisine, sine, staircase
from tests.trials import model_of

REALISATIONS = 16
SUBSTEPS = 8
NOISE_V = 0.05


def test_the_doubt_of_a_gain_and_an_offset_makes_the_band_they_span():
    u = np.linspace(-2.0, 2.0, 50)
    trace = Trace("ramp", 100.0, u, np.zeros(50), "linear")
    model = Model("line", Rational((1.0,), (1.0,)), LinearF(3.0, 0.5), Rational((1.0,), (1.0,)))
    doubt = Doubt(("F.gain", "F.offset"), ((0.04, -0.006), (-0.006, 0.01)))
    expected = 1.96 * np.sqrt(0.04 * u**2 - 2.0 * 0.006 * u + 0.01)
    assert half_band(model, doubt, trace, 1) == pytest.approx(expected, rel=1e-4)


def test_directions_that_are_one_make_no_second_band():
    trace = Trace("ramp", 100.0, np.linspace(-2.0, 2.0, 50), np.zeros(50), "linear")
    model = Model("line", Rational((1.0,), (1.0,)), LinearF(3.0, 0.5), Rational((1.0,), (1.0,)))
    doubt = Doubt(("F.gain", "F.offset"), ((0.04, 0.04), (0.04, 0.04)))
    assert half_band(model, doubt, trace, 1) == pytest.approx(1.96 * 0.2 * np.abs(trace.u[:] + 1.0), rel=1e-4, abs=1e-6)


def doubt_of(sure: Certainty) -> Doubt:
    return Doubt(sure.names, tuple(map(tuple, sure.covariance.tolist())))


def test_the_true_answer_lies_inside_19_times_out_of_20():
    """The integrator of tests/proof is the truth; its answer to a stimulus that was not fitted is looked for inside."""
    rig = toleranced(RC, 3)
    played = (staircase("stairs", FIG13_LEVELS_V[::3], 0.1), sine("sine", 20.0, 5.0, 4, 2))
    clean = [answer(rig, s.u, Grid(s.rate_hz, s.u.size, 32)) for s in played]
    held_out = multisine("multisine", 5.0, 1).u[:4000]
    true, over = answer(rig, held_out, Grid(RATE_HZ, held_out.size, 32)), Trace("m", RATE_HZ, held_out, held_out)
    shares, squares = [], []
    for seed in range(REALISATIONS):
        rng = np.random.default_rng([seed, 17])
        traces = [
            Trace(s.name, s.rate_hz, s.u, y + rng.normal(0.0, NOISE_V, y.size),
                  steps=tuple(Step(p.label, p.kind, p.start, p.stop, p.repeat) for p in s.segments))
            for s, y in zip(played, clean, strict=True)
        ]  # fmt: skip
        found = identify(replace(model_of(RC), noise_v=None), traces)
        half = half_band(found.model, doubt_of(found.certainty), over, SUBSTEPS)
        moving = half > 1e-3 * NOISE_V
        off = np.abs(true - answered(found.model, over))
        shares.append(np.mean((off < half)[moving]))
        squares.append(np.mean(np.square(1.96 * off[moving] / half[moving])))
    # Six values are fitted, so the points of one realisation err together, as about six independent ones would.
    assert np.mean(shares) == pytest.approx(0.95, abs=3.0 * np.sqrt(0.95 * 0.05 / (6.0 * REALISATIONS)))
    assert np.mean(squares) == pytest.approx(1.0, abs=3.0 * np.sqrt(2.0 / (6.0 * REALISATIONS)))


def answered(model: Model, trace: Trace) -> np.ndarray:
    """Return the fitted model's answer as ``rig simulate`` has it."""
    from identify.chain import simulate
    from identify.effects import chain_of

    return simulate(chain_of(model), trace, SUBSTEPS)
