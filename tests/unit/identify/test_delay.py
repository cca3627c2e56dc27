"""Is a dead time one number wherever the rig file puts it, and is that number right?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.coordinate import coordinates_of
from identify.delay import delay_s, total_delay
from identify.effects import chain_of
from identify.fit import Fit
from identify.joint import identify
from identify.model import Model, Physics
from tests.proof.cases import Concealed
from tests.proof.rigs import RC, Rig
from tests.proof.stimuli import Stimulus
from tests.trials import model_of, noisy, recorded

DELAY_S, START_S, NOISE_V = 5.0, 4.5, 0.003
RATE_HZ, PERIOD_S = 4.0, 160.0
# Eqs. (40a)-(40c), multiplied out; the 5 s of eq. (38b) are concealed behind the reading.
PAPER = Rig(
    "paper", (0.499, 2.49999), (1.0, 6.5, 8.0, 2.5), 1.76, 0.36, 1.76, -1.78, (0.08,), (1.0, 1.6, 0.68, 0.08), NOISE_V
)
SHARES_S = ((0.0, START_S), (3.0, 1.5), (START_S, 0.0))


def late(model: Model, g1_s: float, g2_s: float) -> Model:
    return replace(model, g1=replace(model.g1, dead_time_s=g1_s), g2=replace(model.g2, dead_time_s=g2_s))


@pytest.fixture(scope="module")
def traces():
    t = np.arange(round(6 * PERIOD_S * RATE_HZ)) / RATE_HZ
    levels = np.repeat([-3.0, -2.0, 0.0, 1.5, 3.0, 2.0, 0.0, -1.5, -3.0], round(60.0 * RATE_HZ))
    played = [
        Stimulus("walk", levels, (), RATE_HZ), Stimulus("sine", 3.5 * np.cos(2 * np.pi / PERIOD_S * t), (), RATE_HZ)
    ]  # fmt: skip
    concealed = (Concealed("dead_time", {"delay": DELAY_S}),)
    return [noisy(recorded(PAPER, stimulus, concealed), NOISE_V, [11, i]) for i, stimulus in enumerate(played)]


@pytest.fixture(scope="module")
def answers(traces):
    """Return what is identified with the same dead time put into G2, into both, and into G1."""
    return [identify(late(model_of(PAPER), *shares), traces) for shares in SHARES_S]


def test_the_delay_that_an_independent_rig_has_is_found_wherever_the_rig_file_puts_it(answers):
    for found in answers:
        assert found.fit.converged
        assert found.rms_v == pytest.approx(NOISE_V, rel=0.05)
        assert found.delay.low < DELAY_S < found.delay.high
        assert found.delay.high - found.delay.low < 0.2


def test_moving_delay_between_g1_and_g2_leaves_all_that_can_be_known_as_it_was(answers):
    told = [found.to_dict() for found in answers]
    assert {"backlash", "G1", "G2", "delay_s", "staircase", "fit", "covariance"} <= set(told[0])
    for key in set(told[0]) - {"not_identifiable"}:
        assert told[1][key] == told[0][key], key
        assert told[2][key] == told[0][key], key


def test_g1_is_reported_without_dead_time_and_g2_with_all_of_it(answers):
    for found in answers:
        told = found.to_dict()
        assert told["G1"]["rational"]["dead_time_s"] == 0.0
        assert told["G2"]["rational"]["dead_time_s"] == found.delay.value
        slow = 2.0 * np.pi * found.g2[0].frequency_hz
        poles = np.roots(found.model.g2.den)
        assert found.g2[0].phase_rad.value == pytest.approx(
            -slow * found.delay.value - np.sum(np.angle(1.0 - 1j * slow / poles)), abs=1e-9
        )


def test_the_model_that_is_written_keeps_the_shares_of_its_rig_file(answers):
    shares = [(found.model.g1.dead_time_s, found.model.g2.dead_time_s) for found in answers]
    total = answers[0].delay.value
    assert shares[0] == (0.0, pytest.approx(total))
    assert shares[1] == (3.0, pytest.approx(total - 3.0))
    assert shares[2] == (pytest.approx(total), 0.0)


def test_the_statement_says_where_the_rig_file_puts_the_delay(answers):
    said = [next(i for i in found.not_identifiable if i.what.startswith("delay")).fixed_by for found in answers]
    assert all("G1 assumed without dead time" in text for text in said)
    assert "G1" not in said[0].partition("rig file")[2]
    assert "3 s to G1 and 1.5 s to G2" in said[1]
    assert "4.5 s to G1" in said[2]


def test_two_delays_of_one_chain_add_up_and_so_do_their_doubts():
    chain = chain_of(late(replace(model_of(RC), physics=(Physics("dead_time", {"delay": 3e-4}),)), 0.0, 1e-4))
    assert delay_s(chain) == pytest.approx(4e-4)
    coordinates = coordinates_of(chain, chain.values, ["a"], fixed=("G1", "F", "G2"))
    assert [c.name for c in coordinates] == ["delay", "dead_time.delay"]
    shared = np.array([[1.0, -1.0 / 3.0], [-1.0 / 3.0, 1.0 / 9.0]])  # what one gains the other loses
    alone = np.diag([0.01, 0.0])
    told = [
        total_delay(Fit(chain, coordinates, np.zeros(2), 0.0, covariance, True, ""))
        for covariance in (shared, alone, shared + alone)
    ]
    widths = [interval.high - interval.low for interval in told]
    assert widths == pytest.approx([0.0, 2 * 1.96 * 0.1 * 1e-4, 2 * 1.96 * 0.1 * 1e-4], abs=1e-12)


def test_a_delay_that_is_held_has_no_width():
    chain = chain_of(replace(late(model_of(RC), 2e-4, 1e-4), fixed=("G1", "G2")))
    held = total_delay(Fit(chain, (), np.zeros(0), 0.0, np.zeros((0, 0)), True, ""))
    assert (held.value, held.low, held.high) == pytest.approx((3e-4, 3e-4, 3e-4))
