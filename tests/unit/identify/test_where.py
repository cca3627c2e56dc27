"""Where on its coordinate does an effect act?"""

from dataclasses import replace

import numpy as np
import pytest

from identify.chain import simulate
from identify.effects import catalogue, chain_of
from identify.effects.effect import Effect
from identify.explain.where import acting, coordinate, profile
from identify.observe import Observation
from identify.stage import Place
from tests.proof.rigs import LINEAR, OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of, observed, recorded

NOISE_V = 0.01
PLAIN, STRAIGHT = chain_of(model_of(OP_AMP)), chain_of(model_of(LINEAR))


def seen(stimulus=None) -> Observation:
    return observed(recorded(OP_AMP, stimulus or staircase("walk", FIG13_LEVELS_V, 0.1), fine=4), NOISE_V)


def test_rails_act_beyond_their_levels_on_both_sides() -> None:
    rails = catalogue()["saturation"](Place.F, "both").put_in(PLAIN, {"upper": 10.0, "lower": -12.0})
    below, above = acting("level of w", Place.F, rails, PLAIN, [seen()])
    assert below.high == pytest.approx(-12.0, abs=0.05)
    assert below.low == pytest.approx(-18.0, abs=0.05)
    assert above.low == pytest.approx(10.0, abs=0.05)
    assert above.high == pytest.approx(14.0, abs=0.05)
    assert below.share + above.share == pytest.approx(1.0, abs=1e-3)


def test_a_drift_acts_where_the_clock_has_gone_far_enough() -> None:
    drifting = catalogue()["offset_drift"](Place.SENSE).put_in(PLAIN, {"rate": 0.02})
    (found,) = acting("clock time", Place.SENSE, drifting, PLAIN, [seen()])
    assert found.low == pytest.approx(0.5, abs=0.01)  # 10 mV of noise at 20 mV/s
    assert found.unit == "s"


def test_a_change_below_the_noise_everywhere_still_has_a_place() -> None:
    faint = catalogue()["offset_drift"](Place.SENSE).put_in(PLAIN, {"rate": 1e-4})
    (found,) = acting("clock time", Place.SENSE, faint, PLAIN, [seen()])
    assert found.share > 0.9


def test_a_delay_acts_at_the_frequency_played() -> None:
    late = catalogue()["dead_time"](Place.G2).put_in(PLAIN, {"delay": 1e-3})
    (found,) = acting("frequency", Place.G2, late, PLAIN, [seen(sine("slow", 10.0, 3.0, 5, 4))])
    assert found.low <= 10.0 <= found.high < 200.0


def test_without_a_gap_plateaus_are_where_the_source_holds() -> None:
    walk = staircase("walk", FIG13_LEVELS_V, 0.1)
    run = observed(recorded(LINEAR, walk, fine=4), NOISE_V)
    age_s = coordinate("time on a plateau", STRAIGHT, run)
    assert max(age_s) == pytest.approx(0.1, abs=2e-4)
    assert age_s[3500] == pytest.approx(0.05, abs=2e-4)  # 10 kS/s: in the middle of the fourth level
    assert age_s[3000] == 0.0


@pytest.mark.parametrize("effect", [e for kind in catalogue().values() for e in kind.variants()], ids=repr)
def test_every_effect_acts_somewhere_on_a_rig_without_a_gap_if_it_can_be_there(effect: Effect) -> None:
    if not effect.applicable(STRAIGHT):
        return
    values = {name: value for name, value in effect.example.items() if f"{effect.id}.{name}" in names_of(effect)}
    run = observed(recorded(LINEAR, sine("slow", 10.0, 3.0, 5, 4), fine=4), NOISE_V)
    changed = effect.put_in(STRAIGHT, values)
    found = acting(effect.along, effect.shows_at, changed, STRAIGHT, [run])
    assert all(r.low <= r.high for r in found)
    change_v = np.max(np.abs(simulate(changed, run.trace) - simulate(STRAIGHT, run.trace)))
    assert any(r.share > 0.0 for r in found) is bool(change_v > 1e-3 * NOISE_V)


def test_a_skew_acts_where_a_run_has_gone_far_enough_whenever_it_began() -> None:
    run = seen(sine("slow", 10.0, 3.0, 20, 4))
    late = replace(run, trace=replace(run.trace, start_s=1000.0))
    skewed = catalogue()["clock_skew"](Place.SENSE)
    found = [acting(skewed.along, Place.SENSE, skewed.put_in(PLAIN, {"ppm": 60.0}), PLAIN, [o]) for o in (run, late)]
    assert found[0] == found[1]
    assert 0.05 < found[0][0].low < found[0][0].high <= run.trace.size / run.trace.rate_hz
    assert found[0][0].unit == "s"


def test_a_capacitor_acts_along_the_level_on_it() -> None:
    capacitors = [catalogue()["capacitor_nonlinearity"](place, "square") for place in (Place.G1, Place.G2)]
    assert [capacitor.along for capacitor in capacitors] == ["level of v", "level of x"]
    x_top = float(max(coordinate("level of x", PLAIN, seen())))
    changed = capacitors[1].put_in(PLAIN, {"k2": 0.02, "tau": 4e-3})
    above = acting(capacitors[1].along, Place.G2, changed, PLAIN, [seen()])[-1]
    assert 0.5 * x_top < above.high <= 1.01 * x_top


def names_of(effect: Effect) -> set[str]:
    return {p.name for p in effect.parameters()}


def test_noise_in_front_of_the_gap_acts_behind_it() -> None:
    noise = catalogue()["process_noise"](Place.G1, "white")
    noisy = noise.put_in(PLAIN, {"sd": 0.03, "bandwidth": 1e3})
    (found,) = acting("rate of w", noise.shows_at, noisy, PLAIN, [seen()])
    assert found.share > 0.9
    assert acting("rate of w", noise.place, noisy, PLAIN, [seen()])[0].share == 0.0


def test_the_profile_of_a_residual_has_its_rms_in_every_bin() -> None:
    drifting = catalogue()["offset_drift"](Place.SENSE).put_in(PLAIN, {"rate": 0.1})
    one = seen()
    made = profile("clock time", drifting, PLAIN, [one])
    assert made is not None
    middle = 0.5 * (made.edges[1:] + made.edges[:-1])
    assert made.before_v == pytest.approx(0.1 * middle, rel=0.02, abs=2e-3)
    assert float(made.after_v.max()) < 1e-4
    assert profile("frequency", drifting, PLAIN, [one]) is None


def test_coordinates_are_those_of_the_signals() -> None:
    one = seen()
    assert coordinate("level of u", PLAIN, one).tolist() == one.trace.u.tolist()
    assert coordinate("clock time", PLAIN, one)[-1] == pytest.approx((one.trace.size - 1) / one.trace.rate_hz)
    age_s = coordinate("time on a plateau", PLAIN, one)
    assert age_s.min() == 0.0
    assert 0.3 < age_s.max() < 0.6  # four levels of 0.1 s inside the gap, and the way back to the border
