"""Is a delay that is known to be the device's left out of the rig's, and said to be?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.chain import simulate
from identify.effects import chain_of
from identify.harmonic.periods import periods
from identify.interval import Interval
from identify.joint import identify
from identify.model import Model
from identify.trace import KnownDevice, Trace
from tests.proof.rigs import RC
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, noisy, recorded

LATE_S, DOUBT_S, OWN_S = 237e-6, 2e-6, 400e-6
BOARD = KnownDevice(Interval(LATE_S, LATE_S - DOUBT_S, LATE_S + DOUBT_S), "calibration of a board",
                    facts=(("gain", Interval(1.003, 1.002, 1.004), "V/V"),))  # fmt: skip
WALK = staircase("walk", tuple(0.6 * level for level in FIG13_LEVELS_V), 0.03)
TONE = sine("10 Hz", 10.0, 3.0, 5, 2)


def late(model: Model, delay_s: float) -> Model:
    return replace(model, g2=replace(model.g2, dead_time_s=delay_s))


def played(trace: Trace, delay_s: float) -> Trace:
    """Return a run of the rig with so much delay in all, by the chain on the trace's own grid, and noise."""
    y = simulate(chain_of(late(model_of(RC), delay_s), trace.intersample), trace)
    return noisy(replace(trace, y=y), 0.01, [9, len(trace.name)])


@pytest.mark.parametrize("share", [0.3, 1.0, 2.7])
def test_it_acts_as_the_same_dead_time_in_the_rig(share: float) -> None:
    trace = recorded(RC, TONE)
    delay_s = share / trace.rate_hz
    known = replace(trace, device=KnownDevice(Interval(delay_s, 0.0, 1.0), "a cable"))
    model = model_of(RC)
    as_device = simulate(chain_of(model, trace.intersample), known)
    as_rig = simulate(chain_of(late(model, delay_s), trace.intersample), trace)
    assert np.abs(as_device - as_rig).max() < 1e-9 * np.ptp(as_rig)
    unused = replace(known, device=KnownDevice(Interval(delay_s, 0.0, 1.0), "a cable", unused="told too roughly"))
    assert np.array_equal(simulate(chain_of(model, trace.intersample), unused),
                          simulate(chain_of(model, trace.intersample), trace))


def test_the_lines_of_a_period_are_those_of_the_rig_alone() -> None:
    trace = recorded(RC, TONE)
    (plain,) = periods(trace, 0.05, 0.01)
    (known,) = periods(replace(trace, device=BOARD), 0.05, 0.01)
    turned = np.angle(known.lines[plain.played[0]] / plain.lines[plain.played[0]])
    assert turned == pytest.approx(2.0 * np.pi * 10.0 * LATE_S, rel=1e-9)
    assert known.mean_y_v().mean() == pytest.approx(plain.mean_y_v().mean())


def test_the_rig_keeps_its_own_delay_as_unsure_as_the_devices_makes_it() -> None:
    traces = [replace(played(recorded(RC, stimulus), LATE_S + OWN_S), device=BOARD) for stimulus in (WALK, TONE)]
    found = identify(late(model_of(RC), 300e-6), traces)
    assert found.delay.low < OWN_S < found.delay.high
    assert found.delay.value == pytest.approx(OWN_S, abs=10e-6)
    assert found.delay.high - found.delay.low > 2.0 * DOUBT_S
    held = {item.what: item.fixed_by for item in found.not_identifiable}
    left_out = "the device's own 237.0 µs ± 2 µs is left out: calibration of a board"
    assert left_out in held["delay shared between G1 and G2"]
    assert "gain 1.0030 ± 0.001: calibration of a board" in held["gain shared between G1, F and G2"]
    assert [told["used"] for told in found.to_dict()["device"]] == [True, True]  # type: ignore[attr-defined]
