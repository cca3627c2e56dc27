"""Does every rule speak where it must, with the right numbers, and stay silent elsewhere?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.chain import plain_chain
from identify.coordinate import coordinates_of
from identify.effects import chain_of
from identify.identification import Branch, StairPoint
from identify.interval import Interval
from identify.model import Backlash, LinearF, Model, Physics, Rational
from identify.observe import Observation
from identify.planning.advice import Advice, Bench, advice, bench_of, clear_of_mains, mains_hit
from identify.planning.information import information
from identify.trace import Array, Step, Trace

RATE_HZ = 10_000.0
MODEL = Model(
    "op-amp", Rational((1000.0,), (1e-4, 20.0, 1000.0)), Backlash(8.0, 1.25, 8.0, -1.25),
    Rational((1000.0,), (1e-6, 2.0, 1000.0)), noise_v=0.01,
)  # fmt: skip
RAILED = replace(MODEL, physics=(Physics("saturation", {"upper": 10.0, "lower": -9.0}),))


def sine(frequency_hz: float, amplitude_v: float, seconds: float = 1.0, rate_hz: float = RATE_HZ) -> Trace:
    u = amplitude_v * np.cos(2 * np.pi * frequency_hz * np.arange(round(seconds * rate_hz)) / rate_hz)
    return trace("sine", "sine", u, rate_hz)


def walk(levels: list[float], dwell_s: float) -> Trace:
    return trace("walk", "staircase", np.repeat(levels, round(dwell_s * RATE_HZ)), RATE_HZ)


def trace(label: str, kind: str, u: Array, rate_hz: float) -> Trace:
    return Trace("run", rate_hz, u, np.zeros(u.size), steps=(Step(label, kind, 0, u.size),))


def bench(model: Model = MODEL, limit_v: float | None = None) -> Bench:
    return bench_of(model, chain_of(model).values, limit_v)


def said(traces: list[Trace], model: Model = MODEL, limit_v: float | None = None) -> dict[str, str]:
    found = [a for a in advice(bench(model, limit_v), traces) if not a.remark]
    assert len({a.rule for a in found}) == len(found)
    return {a.rule: a.sentence for a in found}


def test_a_good_sine_and_a_good_staircase_need_no_advice() -> None:
    assert said([sine(8.0, 3.0), walk([0.0, 2.0, -2.0], 0.3)], RAILED) == {}


def test_a_stuck_gap_names_the_amplitude_that_frees_it() -> None:
    assert said([sine(51.0, 3.0)]) == {"stuck gap": "sine: the gap is stuck at U = 3 V, raise it above 8.11 V"}


def test_where_the_limit_forbids_that_a_lower_frequency_is_named() -> None:
    assert said([sine(97.0, 10.0)], limit_v=10.0)["stuck gap"] == (
        "sine: the gap is stuck at U = 10 V, raise it above 15.3 V, or within 10 V go below 63.2 Hz")
    assert said([sine(97.0, 1.0)], limit_v=1.0)["stuck gap"].endswith("or within 1 V no frequency moves it")


def test_a_staircase_within_the_gap_is_stuck() -> None:
    found = said([walk([1.0, 0.5, -1.0], 0.3)])["stuck gap"]
    assert found == "walk: the gap is stuck on every level, make them more than 1.25 times as large"


def test_levels_and_waves_on_known_rails_are_told() -> None:
    assert said([walk([0.0, 3.0, 2.0, -3.0], 0.3)], RAILED)["rail"] == (
        "walk: 3 of 4 levels end on the rails (-9 V and 10 V of w), which tells nothing of the borders; "
        "stay between -2.38 V and 2.5 V")
    found = said([sine(8.0, 5.0)], RAILED)["rail"]
    assert "w is on the rails (-9 V and 10 V) for " in found
    limit = 2.375 / abs(np.polyval(MODEL.g1.num, 16j * np.pi) / np.polyval(MODEL.g1.den, 16j * np.pi))
    assert found.endswith(f"stay below U = {limit:.3g} V")
    assert "rail" not in said([sine(8.0, 0.99 * limit)], RAILED)
    assert "rail" in said([sine(8.0, 1.01 * limit)], RAILED)


def test_levels_read_on_a_rail_are_told_where_none_was_known() -> None:
    def point(level_v: float, mean_v: float, branch: Branch) -> StairPoint:
        return StairPoint("run", level_v, Interval(mean_v, mean_v, mean_v), branch)

    stairs = [point(2.0, 6.0, "loading"), point(2.5, 10.0, "saturated"), point(3.0, 10.0, "saturated"),
              point(1.0, 10.0, "saturated"), point(-2.0, -6.0, "unloading")]  # fmt: skip
    played = [walk([2.0, 2.5, 3.0, 1.0, -2.0], 0.3)]
    found = {a.rule: a.sentence for a in advice(bench(), played, None, stairs)}
    assert found["rail"] == ("run: 3 of 5 levels rest on a rail, at 10 V of the reading, which tells nothing of the "
                             "borders; stay between -2 V and 2 V")


def test_a_short_dwell_names_the_one_that_settles() -> None:
    assert said([walk([2.0, -2.0, 2.0], 0.05)])["dwell"] == (
        "walk: the dwell of 50 ms ends before G1 and G2 settle to 0.01 %, which takes 203 ms: no level is read "
        "settled; dwell 220 ms")


@pytest.mark.parametrize(("frequency_hz", "order"), [(50.0, 1), (60.0, 1), (150.0, 1), (10.0, 5), (25.0, 2), (12.0, 5)])
def test_frequencies_on_the_mains_are_told_with_a_better_one(frequency_hz: float, order: int) -> None:
    found = said([sine(frequency_hz, 60.0, 2.0)])["mains"]
    assert ("harmonic" in found) == (order > 1)
    assert mains_hit(clear_of_mains(frequency_hz)) is None


@pytest.mark.parametrize("frequency_hz", [0.01, 8.0, 28.0, 44.0, 63.0])
def test_frequencies_clear_of_the_mains(frequency_hz: float) -> None:
    assert mains_hit(frequency_hz) is None


def test_harmonics_above_half_the_rate_are_told() -> None:
    found = said([sine(28.0, 8.0, 1.0, 280.0)])["rate"]
    assert found == ("sine: harmonics from 6 on lie above half the sample rate of 280 Hz and fold back; sample at "
                     "392 Hz or faster")


def test_a_step_that_tells_nothing_is_told_once() -> None:
    still = trace("still", "hold", np.zeros(2000), RATE_HZ)
    good = sine(8.0, 3.0)
    u = np.concatenate((still.u, good.u))
    steps = (Step("still", "hold", 0, 2000), Step("sine", "sine", 2000, u.size))
    both = Trace("run", RATE_HZ, u, np.zeros(u.size), steps=steps)
    chain = plain_chain(MODEL)
    seen = Observation(both, np.ones(u.size, dtype=bool), 0.01)
    told = information(chain, coordinates_of(chain, chain.values, ["run"]), [seen])
    found = [a for a in advice(bench(), [both], told) if not a.remark]
    assert [(a.rule, a.step) for a in found] == [("silent step", "still")]


def test_a_linear_rig_has_no_gap_to_be_stuck() -> None:
    linear = Model("RC", Rational((1.0,), (0.02, 1.0)), LinearF(), Rational((1.0,), (1.0,)), 0.01)
    assert said([sine(8.0, 0.1), walk([0.0, 0.1], 1.0)], linear) == {}


def test_unreachable_poles_are_remarks() -> None:
    found = [a for a in advice(bench(), [sine(8.0, 3.0)]) if a.remark]
    assert [a.rule for a in found] == ["rate", "rate"]
    assert found[0].to_dict()["remark"] is True


def test_an_advice_has_the_form_of_the_json() -> None:
    assert Advice("mains", "s", "a sentence").to_dict() == {
        "rule": "mains", "step": "s", "sentence": "a sentence", "remark": False}
