"""Is a recording in which nothing of the source comes back refused, in words, and no other?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.explain.explain import explain
from identify.heard import check_heard
from identify.joint import identify
from identify.trace import Trace
from tests.proof.cases import Concealed
from tests.proof.rigs import LINEAR, RC, Rig
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, recorded

NOISE_V = 0.01
LARGE = sine("large", 5.0, 4.0, 4, 2)  # v goes 3.4 V either way: the gap of RC ends at 1.25 V
STAIRS = staircase("stairs", FIG13_LEVELS_V, 0.05, 1)
RNG = np.random.default_rng(5)


def silent(trace: Trace, level_v: float = 0.1) -> Trace:
    return replace(trace, y=level_v + NOISE_V * RNG.normal(size=trace.size))


def played(stimulus=LARGE, *physics: Concealed, rig: Rig = RC) -> Trace:
    return recorded(rig, stimulus, physics, NOISE_V, 1)


@pytest.mark.parametrize("answer", [explain, identify])
@pytest.mark.parametrize("stimulus", [LARGE, STAIRS], ids=lambda s: s.name)
def test_noise_about_a_level_is_answered_with_what_may_be_the_reason(answer, stimulus):
    """It had been the end of an ADC's range, with 0.99, and slopes of -0.09."""
    told = r"they stay at (100|99\.\d) mV ± (10|9\.\d) mV .*check the cable, .* more than 1\.5 times as wide"
    with pytest.raises(ValueError, match=told):
        answer(model_of(RC), [silent(played(stimulus)), silent(played(stimulus))])


def test_pickup_is_nothing_of_the_source():
    dead = silent(played())
    hum = 0.3 * np.sin(2.0 * np.pi * 50.02 * np.arange(dead.size) / dead.rate_hz)
    with pytest.raises(ValueError, match="do not follow the source"):
        check_heard(model_of(RC), [replace(dead, y=dead.y[:] + hum)], NOISE_V)


def test_without_a_gap_none_is_blamed():
    with pytest.raises(ValueError, match=r"check the cable, the channel and the supply\)$"):
        check_heard(model_of(LINEAR), [silent(played(rig=LINEAR))], NOISE_V)


@pytest.mark.parametrize(
    "trace",
    [
        played(), replace(played(), y=-0.05 * played().y[:]),
        replace(played(), y=silent(played()).y[:] + 0.2 * played().u[:]),
        played(STAIRS, Concealed("saturation", {"upper": 0.5, "lower": -0.5})),
        played(STAIRS, Concealed("ac_coupling", {"tau": 3e-4})),
    ],
    ids=["all", "a twentieth, turned over", "past the gap", "short rails", "edges alone"],
)  # fmt: skip
def test_what_follows_the_source_in_any_way_is_heard(trace):
    check_heard(model_of(RC), [trace], NOISE_V)


def test_a_gap_that_may_be_stuck_in_earnest_is_no_lead_that_is_off():
    """v passes the gap of the rig file by less than that may be wrong."""
    check_heard(model_of(RC), [silent(played(sine("small", 5.0, 1.8, 4, 2)))], NOISE_V)


def test_one_run_that_is_heard_is_enough():
    check_heard(model_of(RC), [silent(played()), played(STAIRS)], NOISE_V)


def test_what_has_no_values_yet_foretells_nothing():
    check_heard(replace(model_of(RC), unknown=("G1",)), [silent(played())], NOISE_V)
