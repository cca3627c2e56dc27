"""Are bent borders found where the independent integrator bends them, and left alone where it does not?"""

import json
from dataclasses import replace
from html import unescape

import numpy as np
import pytest

from identify.bent.bend import orders, ridden
from identify.bent.curved import CurvedPlay
from identify.bent.curves import HeldOut, in_form
from identify.chain import plain_chain
from identify.fit import fit
from identify.identification import Identification
from identify.joint import identify
from identify.model import Backlash, CurvedBacklash, LinearF
from identify.page.report import identification_page
from identify.trace import Step, Trace
from tests.benchmarks.bent_borders import NOISE_V, RIG, SHAPES, clean, trial
from tests.proof.rigs import toleranced
from tests.trials import model_of, noisy, observed

STRAIGHT, CUBIC, TANH = SHAPES[:3]
MODEL = replace(model_of(toleranced(RIG, 1)), noise_v=NOISE_V)


def recordings(shape) -> list[Trace]:
    """Return a noisy realisation whose sines are repeats of one another."""
    return [replace(noisy(trace, NOISE_V, i), steps=repeats(trace)) for i, trace in enumerate(clean(shape))]


def repeats(trace: Trace) -> tuple[Step, ...]:
    count = {"stairs": 1, "slow": 3, "fast": 4}[trace.name]
    size = trace.size // count
    return tuple(Step(trace.name, "sine", i * size, (i + 1) * size, i) for i in range(count))


@pytest.fixture(scope="module")
def bent() -> Identification:
    return identify(MODEL, recordings(CUBIC), borders="curved")


@pytest.mark.parametrize("shape", SHAPES[:3], ids=lambda shape: shape.name)
def test_the_bands_hold_the_borders_of_the_integrator(shape) -> None:
    found = trial(shape, 11)
    assert np.max(np.abs(found.off)) < 4.0  # 18 places of one realisation; the study is in tests/benchmarks
    assert np.mean(np.abs(found.off) < 1.96) > 0.7
    assert found.bent == (shape is not STRAIGHT)


def test_the_answer_tells_the_bend_and_what_speaks_for_it(bent: Identification) -> None:
    told = json.loads(json.dumps(bent.to_dict()))["backlash"]
    assert {"S_L", "D_L", "S_U", "D_U", "unit"} <= told.keys()
    assert told["bend"]["taken"]
    assert told["bend"]["sentence"].startswith("The borders are bent: ")
    straight, *_, last = told["bend"]["orders"]
    assert straight["knots"] == 2
    assert last["schwarz"] < straight["schwarz"]
    for side, (slope, crossing) in {"L": (RIG.s_l, RIG.d_l_v), "U": (RIG.s_u, RIG.d_u_v)}.items():
        assert len(told["curves"][side]) == told["bend"]["knots"]
        for point in told["curves"][side]:
            x, (low, high) = point["v_V"] - crossing, point["w_V"]["ci95"]
            assert low < point["w_V"]["value"] < high
            assert abs(point["w_V"]["value"] - x * (slope + 0.05 * x * x)) < 2.5 * (high - low)


def test_held_out_repeats_speak_for_the_bend(bent: Identification) -> None:
    held = bent.bend.held_out
    assert isinstance(held, HeldOut)
    assert held.straight_v > 2.0 * held.bent_v
    assert held.bent_v == pytest.approx(held.noise_v, rel=0.05)


def test_what_cannot_be_told_of_a_shape_is_told(bent: Identification) -> None:
    open_ends = {item.what: item.because for item in bent.not_identifiable}
    assert open_ends["bent borders against a rising law right behind F"].endswith("exactly")
    assert any("loading border outside" in what for what in open_ends)


def test_the_page_shows_the_shape_and_its_points(bent: Identification) -> None:
    page = identification_page(bent).html()
    assert "Shape of the borders" in page
    assert bent.bend.sentence in unescape(page)


def test_the_straight_lines_beside_a_bend_are_those_nearest_to_it(bent: Identification) -> None:
    v = np.linspace(bent.bend.curves["L"][0].v_v, bent.bend.curves["L"][-1].v_v, 400) - RIG.d_l_v
    slope, offset = np.polyfit(v, v * (RIG.s_l + 0.05 * v * v), 1)
    assert bent.own_scale["S_L"].value == pytest.approx(slope, rel=1e-3)
    assert bent.own_scale["D_L"].value == pytest.approx(RIG.d_l_v - offset / slope, abs=2e-3)


def test_a_bent_model_is_refitted_as_it_is_and_starts_straight_where_asked(bent: Identification) -> None:
    again = identify(bent.model, recordings(CUBIC))
    assert isinstance(again.model.f, CurvedBacklash)
    assert np.array(again.model.f.loading) == pytest.approx(np.array(bent.model.f.loading), abs=2e-3)
    knots = bent.bend.chosen.knots
    assert again.bend.sentence == f"The borders are curves through {knots} and {knots} points."
    assert isinstance(in_form(bent.model, "curved").f, Backlash)


def test_straight_borders_stay_straight_unless_knots_are_asked_for() -> None:
    runs = recordings(STRAIGHT)
    found = identify(MODEL, runs, borders="curved")
    assert isinstance(found.model.f, Backlash)
    assert found.bend.sentence.startswith("Straight borders suffice: ")
    asked = identify(MODEL, runs, borders="curved", knots=3)
    assert isinstance(asked.model.f, CurvedBacklash)
    assert len(asked.model.f.loading) == 3
    assert asked.bend.sentence.endswith("all the same.")


def test_what_else_is_missing_does_not_pass_for_a_bend() -> None:
    """A slow wave in the readings is no bend, however large: the criteria take what is left over for noise."""
    runs = [
        replace(t, y=t.y[:] + 0.5 * np.sin(0.003 * np.arange(t.size)), steps=()) for t in recordings(STRAIGHT)
    ]  # fmt: skip
    observations = [observed(t, NOISE_V) for t in runs]
    made = orders(fit(plain_chain(MODEL), observations), observations, knots=4)
    assert made.tried[0].chi_squared - made.chosen.chi_squared > 4.0 * np.log(20_000)
    assert not made.pays


@pytest.mark.parametrize(("change", "sentence"), [
    ({"f": LinearF()}, "no borders to bend"), ({"fixed": ("F.S_L",)}, "cannot be bent"),
])
def test_borders_that_cannot_be_bent_are_refused(change, sentence) -> None:
    with pytest.raises(ValueError, match=sentence):
        in_form(replace(MODEL, **change), "curved")


def test_a_border_that_no_run_rides_is_told() -> None:
    u = np.concatenate((np.linspace(0.0, 3.0, 500), np.full(500, 3.0)))
    observation = observed(Trace("up only", 1e4, u, np.zeros(u.size)), NOISE_V)
    with pytest.raises(ValueError, match="no run rides the unloading border"):
        ridden(plain_chain(MODEL), [observation])


def test_a_stage_needs_a_plain_backlash() -> None:
    observation = observed(recordings(STRAIGHT)[0], NOISE_V)
    chain = plain_chain(replace(MODEL, f=CurvedBacklash(((0.0, 0.0), (1.0, 1.0)), ((-1.0, 0.0), (0.0, 1.0)))))
    assert chain.stage_of(CurvedPlay) is not None
    with pytest.raises(ValueError, match="plain backlash"):
        orders(fit(chain, [observation], iterations=1), [observation])
