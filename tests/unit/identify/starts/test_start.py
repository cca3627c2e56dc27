"""Does a fit find its way from values that are off, whatever the blocks: unstable starts, negative gains, overshoot?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.joint import identify
from identify.model import Backlash, Model, Rational
from identify.starts.start import stabilised
from identify.trace import Step, Trace
from tests.proof.rigs import Rig
from tests.proof.stimuli import FIG13_LEVELS_V, Stimulus, sine, staircase
from tests.trials import model_of, recorded

NOISE_V = 0.01
RINGING = Rig(  # G1 overshoots by a third, G2 is of third order
    "ringing", (-1.0,), (1e-6, 6e-4, 1.0), 3.0, 0.8, 2.5, -1.1,
    (1.0,), tuple(np.polymul([1.5e-6, 5e-4, 1.0], [3e-3, 1.0])), NOISE_V,
)  # fmt: skip
PLAYED = (staircase("stairs", FIG13_LEVELS_V[::2], 0.08), sine("sine_31hz", 31.25, 3.4, 10, 2),
          sine("sine_125hz", 125.0, 2.5, 20, 2))  # fmt: skip


def trace_of(rig: Rig, stimulus: Stimulus) -> Trace:
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in stimulus.segments)
    return replace(recorded(rig, stimulus, noise_v=NOISE_V, seed=5, fine=8), steps=steps)


def test_negative_gain_overshoot_and_an_unstable_start_are_no_hindrance() -> None:
    a3, a2, a1, a0 = RINGING.g2_den
    off = Model(
        "off", Rational((-1.0,), (1.3e-6, 4.2e-4, 1.0)), Backlash(2.1, 1.04, 3.25, -0.77),
        Rational((1.0,), (1.3 * a3, 0.7 * a2, 0.7 * a1, a0)), NOISE_V,
    )  # fmt: skip
    found = identify(off, [trace_of(RINGING, stimulus) for stimulus in PLAYED])
    assert found.fit.converged
    assert found.rms_v == pytest.approx(NOISE_V, rel=0.05)
    assert any(warning.startswith("G2 is not stable as the rig file gives it") for warning in found.warnings)
    truth = {"S_L": 3.0, "D_L": 0.8, "S_U": 2.5, "D_U": -1.1}
    for name, interval in found.own_scale.items():
        assert abs(interval.value - truth[name]) < 2.0 * (interval.high - interval.low), name
    den = np.asarray(found.model.g2.den) / found.model.g2.den[-1]
    assert den == pytest.approx(RINGING.g2_den, rel=0.05)


def test_what_is_not_to_be_fitted_is_not_mirrored() -> None:
    unstable = Rational((1.0,), (1.0, 0.5, 1.0, 1.0))
    model = replace(model_of(RINGING), g1=unstable)
    assert stabilised(model)[0].g1 != unstable
    for fixed in ("G1", "G1.den"):
        with pytest.raises(ValueError, match="G1 is not stable"):
            stabilised(replace(model, fixed=(fixed,)))
    with pytest.raises(ValueError, match="G1 is not stable"):
        stabilised(replace(model, g1=Rational((1.0,), (1.0, -1.0))))
    assert stabilised(model_of(RINGING)) == (model_of(RINGING), ())
