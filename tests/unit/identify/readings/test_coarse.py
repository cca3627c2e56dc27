"""Is it known how much noise leaves of readings on coarse steps of an ADC?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.effects import catalogue, chain_of
from identify.explain import explain
from identify.holdout import split
from identify.readings.coarse import CoarseSteps
from identify.stage import Place
from tests.proof.cases import Concealed
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, recorded

LSB = 0.06
PLAYED = staircase("walk", FIG13_LEVELS_V, 0.03), sine("sine", 31.25, 8.0, 8, 1), sine("other", 20.0, 7.0, 20, 1)
LAW = catalogue()["adc_quantisation"](Place.SENSE)


def _steps(noise_v):
    return CoarseSteps(LAW.put_in(chain_of(model_of(RC)), {"LSB": LSB, "noise": noise_v}))


@pytest.mark.parametrize("noise", [0.05, 0.1, 0.17])
def test_what_noise_leaves_of_every_run_is_what_is_expected_of_it(noise):
    """One figure for all is off by more, by where levels stand in their steps."""
    steps, law = _steps(noise * LSB), Concealed("adc_quantisation", {"lsb": LSB})
    runs = [recorded(RC, stimulus, (law,), noise * LSB, seed=3, fine=8) for stimulus in PLAYED]
    before = split(model_of(RC), runs[:2], runs[2:])
    data, off = steps.told(before), []
    for seen, told in zip((*before.train, *before.test), (*data.train, *data.test), strict=True):
        share = np.square(steps.of(told.trace) / LSB)  # p (1 - p), where p is how likely a reading is the next step
        sd_v2 = LSB**2 * float(np.sqrt(np.sum(share * (1.0 - 4.0 * share))))
        left = float(np.sum(np.square(told.used_residual(steps.chain))))
        assert abs(left - told.expected * told.noise_v**2) < 3.0 * sd_v2
        off.append(abs(left - seen.expected * seen.noise_v**2) / sd_v2)
    assert max(off) > 4.0
    assert all(o.noise_v == data.train[0].noise_v < 0.5 * LSB for o in (*data.train, *data.test))
    assert data.train[0].noise_v > max(o.noise_v * o.scatter**0.5 for o in data.train)  # most of what tells is loud
    assert data.noise.rms_v == pytest.approx(data.test[0].noise_v * data.test[0].scatter ** 0.5)


@pytest.mark.parametrize(("lsb", "upper"), [(LSB, 7.97), (2.0 * LSB, 7.97), (LSB, 7.8)])
def test_a_source_that_is_cut_off_is_told_beside_steps_six_and_twelve_times_the_noise(lsb, upper):
    """What is left is the noise then; with one figure for all of twelve times it was 0.70 of that.

    What is cut off by more had passed for noise, before it was known, and would leave 0.79 of that.
    """
    cut, steps = Concealed("input_clipping", {"upper": upper}), Concealed("adc_quantisation", {"lsb": lsb})
    *seen, held_out = (recorded(RC, s, (cut, steps), 0.01, i, 3.0 * i, 8) for i, s in enumerate(PLAYED))
    told = explain(model_of(RC), seen, [held_out])
    assert sorted(effect.id for effect in told.effects) == ["adc_quantisation", "input_clipping"]
    assert told.verdict == "explained"
    assert told.noise.origin.startswith("the steps of the ADC")
    assert told.remaining.over_noise == pytest.approx(1.0, abs=0.03)


def test_nothing_is_said_of_what_noise_leaves_where_it_turns_no_reading_over():
    """Of 7,800 readings in the middle of a step it turns none over where it is a tenth of that."""
    moving = replace(recorded(RC, PLAYED[0], (), 0.0, fine=8), u=np.zeros(7800), y=np.linspace(0.0, 1.0, 7800))
    data = split(model_of(RC), [moving], [moving])
    still = tuple(replace(o, trace=replace(o.trace, y=np.zeros(7800))) for o in data.train)
    data = replace(data, train=still, test=still)
    assert _steps(0.1 * LSB).told(data) is None
    assert _steps(0.25 * LSB).told(data) is not None  # one in 44 then


def test_steps_that_noise_rounds_off_scatter_all_readings_alike():
    assert not _steps(0.51 * LSB).shows
    assert _steps(0.49 * LSB).shows
