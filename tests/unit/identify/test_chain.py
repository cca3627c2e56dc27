"""Does a chain of stages answer what an independent integrator answers, however the signal is cut?"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify import chain as chain_module
from identify.between import source_voltage
from identify.blocks import Gain, LinearBlock, Play, Source
from identify.chain import (
    CHUNK,
    chunks,
    grid_of,
    local_name,
    model_of,
    plain_chain,
    running,
    signals,
    simulate,
)
from identify.effects import chain_of
from identify.model import Backlash, LinearF, Model, Physics, Rational
from identify.stage import Block, Grid, Place
from identify.trace import Trace
from tests.proof.rigs import OP_AMP, RC, SKEWED
from tests.proof.stimuli import FIG13_LEVELS_V, sine, staircase
from tests.trials import model_of as rig_model
from tests.trials import recorded

STAIRS = staircase("stairs", FIG13_LEVELS_V[::2], 0.01)
EVERYTHING = (
    Physics("extra_pole", {"tau": 1e-3}, "G1"), Physics("plateau_droop", {"rate": 2.0}),
    Physics("dead_time", {"delay": 2.3e-4}), Physics("saturation", {"upper": 10.0, "lower": -9.0}),
    Physics("hum", {"frequency": 50.0, "amplitude": 0.3}),
    Physics("feedthrough", {"k": 0.02}), Physics("offset_drift", {"rate": 0.3}),
)  # fmt: skip
ROUNDING_V = 1e-11
LINEAR = Model("linear", Rational((1.0,), (1e-3, 1.0)), LinearF(3.0, 0.1), Rational((1.0,), (1.0,)))
CHAINS = {
    "plain": plain_chain(rig_model(OP_AMP)),
    "linear F": plain_chain(LINEAR),
    "with everything": chain_of(rig_model(OP_AMP, EVERYTHING)),
}


def ask(run, source, first, grid):
    return run(Block(source, source, first, grid))


@settings(deadline=None, max_examples=40)
@given(st.sampled_from(list(CHAINS)), st.lists(st.integers(1, 70), min_size=1, max_size=8), st.integers(0, 2**32 - 1))
def test_block_wise_running_equals_one_pass(name, sizes, seed):
    source = np.random.default_rng(seed).uniform(-6.0, 6.0, sum(sizes))
    grid = Grid("a", 1e-4, 1, 2.5)
    whole = ask(running(CHAINS[name], grid), source, 0, grid)
    run, ends = running(CHAINS[name], grid), np.cumsum(sizes)
    pieces = [ask(run, source[end - n : end], int(end - n), grid) for n, end in zip(sizes, ends, strict=True)]
    assert np.allclose(np.concatenate(pieces), whole, rtol=0, atol=ROUNDING_V)


@pytest.mark.parametrize("dead_time_s", [0.0, 2.3e-4])
@pytest.mark.parametrize("start", [OP_AMP, SKEWED, RC], ids=lambda rig: rig.name)
def test_one_compiled_loop_equals_the_stages_one_by_one(start, dead_time_s):
    model = rig_model(start)
    chain = plain_chain(replace(model, g2=replace(model.g2, dead_time_s=dead_time_s)))
    trace = Trace("stairs", 1e4, STAIRS.u, STAIRS.u)
    assert np.ptp(simulate(chain, trace)) > 5.0
    assert np.allclose(simulate(chain, trace), signals(chain, trace)[-1], rtol=0, atol=1e-11)


def test_one_compiled_loop_without_dynamics_in_g1_takes_jumps_as_jumps():
    model = Model("m", Rational((2.0,), (1.0,)), Backlash(1.0, 0.5, 1.0, -0.5), Rational((1.0,), (1e-3, 1.0)))
    u = np.repeat([1.0, -2.0, 3.0], 40)
    trace = Trace("jumps", 1e4, u, u)
    chain = plain_chain(model)
    w = np.repeat([1.5, -3.5, 5.5], 40)
    expected = [
        sum(d * -np.expm1(-(t - k * 1e-4) / 1e-3) for k, d in enumerate(np.diff(w, prepend=0.0)) if k * 1e-4 <= t)
        for t in 1e-4 * np.arange(u.size)
    ]
    assert np.allclose(simulate(chain, trace), expected, rtol=0, atol=1e-10)
    assert np.allclose(signals(chain, trace)[-1], expected, rtol=0, atol=1e-10)


@pytest.mark.parametrize("rig", [OP_AMP, SKEWED, RC], ids=lambda rig: rig.name)
@pytest.mark.parametrize("stimulus", [STAIRS, sine("sine", 50.0, 9.5, 5, 1)], ids=lambda stimulus: stimulus.name)
def test_the_chain_answers_what_the_independent_integrator_answers(rig, stimulus):
    """The op-amp rig has poles at 5 us and 0.5 us, which 64 steps of 1.6 us to a sample resolve and 8 do not."""
    trace = recorded(rig, stimulus, fine=128)
    error = {n: np.abs(simulate(plain_chain(rig_model(rig)), trace, n) - trace.y).max() for n in (8, 64)}
    assert np.ptp(trace.y) > 5.0
    assert error[64] < 1e-5  # V, of some 10 V
    assert error[8] < 5e-4  # V, a twentieth of the rig's noise


def test_finer_steps_come_closer_to_continuous_time():
    trace = recorded(RC, sine("sine", 250.0, 30.0, 20, 1), fine=512)
    errors = [np.abs(simulate(plain_chain(rig_model(RC)), trace, n) - trace.y).max() for n in (1, 2, 4, 8)]
    assert all(finer < 0.6 * coarser for coarser, finer in pairwise(errors))


def test_taps_show_every_stage():
    chain, trace = CHAINS["plain"], Trace("stairs", 1e4, STAIRS.u, STAIRS.u)
    u, v, w, x = signals(chain, trace)
    assert np.array_equal(u, source_voltage(STAIRS.u, "held", 1))
    by_hand, level = [], 0.0
    for value in v:
        level = min(max(level, 8.0 * (value - 1.25)), 8.0 * (value + 1.25))
        by_hand.append(level)
    assert np.array_equal(w, by_hand)
    assert np.allclose(x, simulate(chain, trace), rtol=0, atol=1e-11)


def test_a_trace_longer_than_a_chunk_is_cut_without_a_seam(monkeypatch):
    trace = Trace("long", 1e4, STAIRS.u, STAIRS.u)
    whole = {n: simulate(CHAINS["with everything"], trace, n) for n in (1, 3)}
    monkeypatch.setattr(chain_module, "CHUNK", 100)
    for n, y in whole.items():
        assert np.allclose(simulate(CHAINS["with everything"], trace, n), y, rtol=0, atol=ROUNDING_V)
        assert np.allclose(signals(CHAINS["with everything"], trace, n)[-1], y, rtol=0, atol=ROUNDING_V)


@pytest.mark.parametrize("substeps", [1, 3, 7])
def test_chunks_are_whole_samples_and_cover_everything(substeps):
    size = 2 * CHUNK // substeps * substeps + 5 * substeps
    cut = list(chunks(np.arange(float(size)), Grid("a", 1.0, substeps)))
    assert all(block.first % substeps == 0 and block.signal.size % substeps == 0 for block in cut)
    assert [block.first for block in cut] == np.cumsum([0] + [b.signal.size for b in cut[:-1]]).tolist()
    assert np.array_equal(np.concatenate([block.signal for block in cut]), np.arange(float(size)))


def test_a_held_voltage_is_still_the_one_before_just_before_its_instant():
    assert source_voltage(np.array([1.0, 2.0]), "held", 3).tolist() == [0, 1, 1, 1, 2, 2]
    assert source_voltage(np.array([1.0, 2.0]), "held", 1, before=7.0).tolist() == [7, 1]


def test_a_measured_voltage_is_drawn_straight_or_band_limited_between_samples():
    assert source_voltage(np.array([0.0, 3.0, 3.0]), "linear", 3).tolist() == [0, 1, 2, 3, 3, 3, 3, 3, 3]
    turn = 2.0 * np.pi * np.arange(160) / 40.0
    fine = source_voltage(np.sin(3.0 * turn[:40]), "bandlimited", 4)
    assert np.allclose(fine, np.sin(3.0 * turn / 4.0), rtol=0, atol=1e-12)
    assert source_voltage(np.ones(3), "bandlimited", 1).tolist() == [1, 1, 1]


def test_stages_stand_in_the_order_of_the_signal():
    chain = CHAINS["with everything"]
    places = [stage.place for stage in chain.stages]
    assert places == sorted(places)
    assert [stage.name for stage in chain.stages] == [
        "source", "G1", "extra_pole", "F", "saturation", "G2", "hum", "feedthrough", "offset_drift",
    ]  # fmt: skip
    assert [chain.index(place) for place in Place] == [1, 3, 5, 6, 9]
    assert {effect.name for effect in chain.added} == {piece.id for piece in EVERYTHING}


def test_kinds_of_stages_are_found():
    assert isinstance(CHAINS["plain"].stage_of(Play), Play)
    assert CHAINS["linear F"].stage_of(Play) is None
    assert isinstance(CHAINS["linear F"].stage_of(Gain), Gain)


def test_values_are_read_only_and_replaced_in_a_copy():
    chain = CHAINS["plain"]
    with pytest.raises(TypeError):
        chain.values["F.S_L"] = 1.0
    other = chain.with_values({"F.S_L": 7.5})
    assert (chain.values["F.S_L"], other.values["F.S_L"]) == (8.0, 7.5)
    assert chain.first_difference(other, "a") == 2
    assert chain.first_difference(chain, "a") == len(chain.stages)


def test_a_local_value_counts_in_its_own_run_only():
    chain = chain_of(rig_model(OP_AMP, (Physics("hum", {"amplitude": 0.3}),)))
    turned = chain.with_values({local_name("hum.phase", "b"): 1.0})
    assert turned.first_difference(chain, "a") == len(chain.stages)
    assert chain.stages[turned.first_difference(chain, "b")].name == "hum"
    still = Trace("b", 1e4, np.zeros(200), np.zeros(200))
    expected = 0.3 * np.sin(2.0 * np.pi * 50.0 * 1e-4 * np.arange(200) + 1.0)
    assert np.allclose(simulate(turned, still), expected, rtol=0, atol=1e-12)
    assert np.allclose(simulate(turned, replace(still, name="a"))[0], 0.0)


@pytest.mark.parametrize("model", [rig_model(SKEWED), LINEAR], ids=lambda model: model.title)
def test_a_chain_gives_its_model_back(model):
    again = plain_chain(model_of(plain_chain(model), model))
    trace = Trace("t", 1e4, STAIRS.u, STAIRS.u)
    assert np.allclose(simulate(again, trace), simulate(plain_chain(model), trace), rtol=0, atol=1e-12)


def test_fitted_values_reach_the_model():
    moved = plain_chain(rig_model(OP_AMP)).with_values({"F.D_L": 1.5, "G2.den.s1": 3e-3})
    found = model_of(moved, rig_model(OP_AMP))
    assert found.f == Backlash(8.0, 1.5, 8.0, -1.25)
    assert found.g2.den == pytest.approx((1e-9, 3e-3, 1.0))
    assert found.g2.dc_gain == pytest.approx(1.0)


def late_rig(g1_s, g2_s, fixed=()):
    model = rig_model(OP_AMP)
    late = replace(model.g1, dead_time_s=g1_s), replace(model.g2, dead_time_s=g2_s)
    return replace(model, g1=late[0], g2=late[1], fixed=fixed)


@pytest.mark.parametrize(
    ("file_s", "fixed", "fitted_s"),
    [
        ((0.0, 1e-3), (), (0.0, 1.5e-3)), ((1e-3, 0.0), (), (1.5e-3, 0.0)), ((4e-4, 6e-4), (), (4e-4, 1.1e-3)),
        ((4e-4, 6e-4), ("G2.dead_time",), (9e-4, 6e-4)), ((4e-4, 6e-4), ("G1",), (4e-4, 1.1e-3)),
    ],
)  # fmt: skip
def test_a_fitted_delay_goes_back_where_the_rig_file_has_it(file_s, fixed, fitted_s):
    late = late_rig(*file_s, fixed)
    found = model_of(plain_chain(late).with_values({"delay": 1.5e-3}), late)
    assert (found.g1.dead_time_s, found.g2.dead_time_s) == pytest.approx(fitted_s, abs=1e-15)


@pytest.mark.parametrize(("file_s", "fixed"), [((5e-4, 0.0), ()), ((0.0, 5e-4), ()), ((3e-4, 2e-4), ("G2",))])
def test_all_dead_times_are_one_parameter(file_s, fixed):
    late = plain_chain(late_rig(*file_s, fixed))
    assert late.parameters()[-1].name == "delay"
    assert late.values["delay"] == pytest.approx(5e-4)
    trace = Trace("t", 1e4, STAIRS.u, STAIRS.u)
    assert np.allclose(simulate(late, trace)[5:], simulate(plain_chain(rig_model(OP_AMP)), trace)[:-5], atol=1e-9)


@pytest.mark.parametrize(
    ("file_s", "fixed"), [((5e-4, 0.0), ("G1",)), ((3e-4, 2e-4), ("G1.dead_time", "G2")), ((0.0, 0.0), ())]
)
def test_a_delay_the_rig_file_holds_is_kept_and_not_searched(file_s, fixed):
    late = late_rig(*file_s, fixed)
    assert "delay" not in [p.name for p in plain_chain(late).parameters()]
    found = model_of(plain_chain(late), late)
    assert (found.g1.dead_time_s, found.g2.dead_time_s) == file_s
    trace, by = Trace("t", 1e4, STAIRS.u, STAIRS.u), round(sum(file_s) / 1e-4)
    early = simulate(plain_chain(rig_model(OP_AMP)), trace)
    assert np.allclose(simulate(plain_chain(late), trace)[by:], early[: early.size - by], atol=1e-9)


def test_blocks_that_cannot_be_are_refused_when_the_chain_begins():
    chain = plain_chain(Model("m", Rational((1.0, 1.0, 1.0), (1.0, 1.0)), LinearF(), Rational((1.0,), (1.0,))))
    with pytest.raises(ValueError, match="not realisable"):
        chain.begin(grid_of(Trace("t", 1e4, STAIRS.u, STAIRS.u)))


def test_zeros_in_front_of_a_numerator_are_no_parameters():
    model = rig_model(RC)
    padded = plain_chain(replace(model, g1=replace(model.g1, num=(0.0, 0.0, 1000.0))))
    assert [p.name for p in padded.parameters()] == [p.name for p in plain_chain(model).parameters()]
    trace = Trace("t", 1e4, STAIRS.u, STAIRS.u)
    assert np.array_equal(simulate(padded, trace), simulate(plain_chain(model), trace))


def test_stages_of_the_plain_chain():
    assert [type(stage) for stage in CHAINS["plain"].stages] == [Source, LinearBlock, Play, LinearBlock]
