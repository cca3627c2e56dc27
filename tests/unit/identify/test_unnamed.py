"""Is physics without a name placed, stored, read back and played like any other?"""

import json
from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from identify import chain as chain_module
from identify.chain import simulate
from identify.derivatives.sensitivities import DIFFERENCE, sensitivities
from identify.effects import chain_of, physics_in, with_physics
from identify.model import LinearF, Model, Physics
from identify.observe import Observation
from identify.simulate import Player
from identify.stage import Block, Grid, Place
from identify.unnamed.correction import Correction
from identify.unnamed.maps import LevelMap
from identify.unnamed.past import (
    GainAfterLevel,
    GainAfterMotion,
    GapAfterMotion,
    GapAfterUse,
    LeadAfterLevel,
    OffsetAfterMotion,
    OffsetAfterUse,
)
from identify.unnamed.stored import KINDS, correction_of
from identify.unnamed.sudden import GainSince, SuddenDynamics, SuddenGain, SuddenOffset
from identify.unnamed.turned import GainAfterFarthest, GapAfterTurn, OffsetSinceTurn
from rig.rigfile import model_to_dict, model_to_yaml, parse_rig
from tests.proof.rigs import OP_AMP
from tests.proof.stimuli import FIG13_LEVELS_V, staircase
from tests.trials import model_of, recorded

MODEL = model_of(OP_AMP)
PLAIN = chain_of(MODEL)
WALK = recorded(OP_AMP, staircase("walk", FIG13_LEVELS_V[::3], 0.02), fine=4)
KNOTS = {
    "V": (-22.0, -14.0, -6.0, 2.0, 10.0, 18.0), "V/s": (0.0, 30.0, 100.0, 300.0), "s": (0.001, 0.01, 0.1),
    "Hz": (77.0,),
}  # fmt: skip
SIZE = {"V": 0.05, "V/V": 0.02, "V/s": 0.7, "V^-1": 2e-3, "V^-2": 1e-4, "s": 2e-4, "s/V": 1e-4, "s/V^2": 5e-6}
EVERY = [(form, place) for form, kind in KINDS.items() for place in kind.places]


def correction(form: str, place: Place) -> Correction:
    kind = KINDS[form]
    return kind(place, KNOTS[kind.knot_unit])


def planted(form: str, place: Place) -> Physics:
    """Return unnamed physics of every form with weights of both signs."""
    free = correction(form, place)
    signs = np.resize((1.0, -0.4, 0.7), len(free.parameters()))
    values = {p.name: float(s) * SIZE[p.unit] for p, s in zip(free.parameters(), signs, strict=True)}
    return physics_in(free.put_in(PLAIN, values))[0]


@pytest.mark.parametrize(("form", "place"), EVERY)
def test_absent_weights_change_nothing_and_planted_ones_do(form: str, place: Place) -> None:
    answer = simulate(PLAIN, WALK)
    absent = correction(form, place).put_in(PLAIN)
    assert np.abs(simulate(absent, WALK) - answer).max() < 1e-12
    assert np.abs(simulate(with_physics(PLAIN, [planted(form, place)]), WALK) - answer).max() > 1e-3


@pytest.mark.parametrize(("form", "place"), EVERY)
def test_a_model_keeps_it_to_the_last_bit(form: str, place: Place) -> None:
    piece = planted(form, place)
    model = Model(MODEL.title, MODEL.g1, MODEL.f, MODEL.g2, MODEL.noise_v, physics=(piece,))
    for text in (model_to_yaml(model), json.dumps({"schema": "rig.explain/1", "model": model_to_dict(model)})):
        read = parse_rig(text, "model.json").model
        assert read == model
        assert np.array_equal(simulate(chain_of(read), WALK), simulate(with_physics(PLAIN, [piece]), WALK))
    assert physics_in(chain_of(model)) == (piece,)


@pytest.mark.parametrize(("form", "place"), EVERY)
def test_slopes_by_its_weights_are_those_of_the_simulation(
    form: str, place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(chain_module, "CHUNK", 700)  # pieces that do not begin at rest
    piece = planted(form, place)
    chain, seen = with_physics(PLAIN, [piece]), Observation(WALK, np.ones(WALK.size, dtype=bool), 1e-3, 1)
    free = chain.added[0]
    own = [n for n in chain.values if n.partition("[")[0] in {p.name for p in free.parameters()}]
    scales = {name: max(abs(chain.values[name]), 1e-3) for name in own}
    answer = simulate(chain, WALK)
    for (name, scale), slope in zip(scales.items(), sensitivities(chain, scales, seen).slopes(), strict=True):
        moved = simulate(chain.with_values({name: chain.values[name] + DIFFERENCE * scale}), WALK)
        expected = (moved - answer) / (DIFFERENCE * seen.noise_v)
        assert np.abs(slope - expected).max() < 1e-5 * max(np.abs(expected).max(), 1.0), name


def test_it_stands_beside_named_physics_and_is_played_block_by_block() -> None:
    pieces = (Physics("dead_time", {"delay": 2e-4}, "G2"), planted("map of the level", Place.F))
    model = Model(MODEL.title, MODEL.g1, MODEL.f, MODEL.g2, 0.0, physics=pieces)
    assert [piece.id for piece in physics_in(chain_of(model))] == ["dead_time", "unnamed"]
    whole = Player(model, WALK.rate_hz).play(WALK.u)
    player = Player(model, WALK.rate_hz)
    halves = np.concatenate([player.play(part) for part in np.array_split(WALK.u, 3)])
    assert np.abs(whole - halves).max() < 1e-9


@pytest.mark.parametrize("form", list(KINDS))
def test_it_runs_the_same_in_one_piece_and_in_many(form: str) -> None:
    model = Model(MODEL.title, MODEL.g1, MODEL.f, MODEL.g2, 0.0, physics=(planted(form, KINDS[form].places[0]),))
    one, many = Player(model, WALK.rate_hz), Player(model, WALK.rate_hz)
    parts = [many.play(part) for part in np.array_split(WALK.u, 7)]
    assert np.abs(one.play(WALK.u) - np.concatenate(parts)).max() < 1e-9


def test_a_gain_leans_as_its_signal_stood_and_falls_as_it_moved() -> None:
    """At 2 V for long, and on a ramp of 3 V/s: by the level and by the way, once the lag of 10 ms has passed."""
    grid, stood, moved = Grid("run", 1e-4, 1, 0.0, 0.0), np.full(3000, -2.0), -3.0 * np.arange(3000) * 1e-4
    for kind, signal, load in ((GainAfterLevel, stood, -2.0), (GainAfterMotion, moved, 0.03)):
        out = kind(Place.SENSE, (0.01,)).summed((0.05,), grid)(Block(signal, signal, 0, grid))
        assert out[-1] == pytest.approx(signal[-1] * (1.0 + 0.05 * load), rel=1e-6)


def test_an_offset_and_a_gap_follow_how_a_signal_stood_and_moved() -> None:
    """The same, where zero or both borders follow; w is on the upper border as v falls, and stays as v stands."""
    grid, stood, moved = Grid("run", 1e-4, 1, 0.0, 0.0), np.full(3000, -2.0), -3.0 * np.arange(3000) * 1e-4
    for kind, signal, load in ((OffsetAfterUse, stood, 2.0), (OffsetAfterMotion, moved, 0.03)):
        out = kind(Place.SENSE, (0.01,)).summed((0.05,), grid)(Block(signal, signal, 0, grid))
        assert out[-1] == pytest.approx(signal[-1] + 0.05 * load, rel=1e-6)
    for gap, signal, load in ((GapAfterUse, moved, -moved[-101]), (GapAfterMotion, moved, 0.03)):
        out = gap(Place.F, (0.01,)).played((2.0, 0.1, 2.0, -0.1), (0.0, 0.05), grid)(Block(signal, signal, 0, grid))
        assert out[-1] == pytest.approx(2.0 * (signal[-1] + 0.1 + 0.05 * load), rel=1e-4)


def test_what_is_remembered_is_where_and_when_a_signal_turned_and_how_far_it_went() -> None:
    """Up to 2 V in 0.2 s, down to -1 V, and up again."""
    grid, at = Grid("run", 1e-3, 1, 0.0, 0.0), np.arange(800) * 1e-3
    signal = np.interp(at, [0.0, 0.2, 0.5, 0.8], [0.0, 2.0, -1.0, 2.0])
    block, volts, seconds = Block(signal, signal, 0, grid), (0.0, 1.0, 2.0), (0.0, 0.1, 0.2, 0.3)
    grown = GainAfterFarthest(Place.SENSE, volts).summed((0.0, 0.1, 0.3), grid)(block) / np.where(signal, signal, 1.0)
    assert grown[[100, 350, 700]] == pytest.approx([1.1, 1.3, 1.3], abs=1e-9)  # at 1 V; and 2 V were there before
    since = OffsetSinceTurn(Place.SENSE, seconds).summed((0.0, 0.1, 0.2, 0.3), grid)(block) - signal
    assert since[[100, 250, 400, 600]] == pytest.approx([0.1, 0.05, 0.2, 0.1], abs=2e-3)
    borders = (1.0, 0.0, 1.0, 0.0)  # without a gap both borders are v
    wide = GapAfterTurn(Place.F, volts).played(borders, (0.0, 0.2, 0.0, 0.0, 0.0, 0.0), grid)(block)
    assert wide[700] == pytest.approx(signal[700] - 0.2)  # it turned at -1 V: the rising border is 0.2 V further out


def test_dynamics_follow_how_a_signal_stood() -> None:
    """On a ramp of 2 V/s that has long been beyond 1 V: sooner by 1 ms a volt, which is 2 mV a volt."""
    grid, at = Grid("run", 1e-4, 1, 0.0, 0.0), np.arange(6000) * 1e-4
    signal = 2.0 * at
    for weight in (1e-3, -1e-3):
        out = LeadAfterLevel(Place.G2, (1e-3,)).summed((weight,), grid)(Block(signal, signal, 0, grid))
        assert (out - signal)[-1] == pytest.approx(2.0 * weight * (signal[-1] - 2e-3), rel=1e-3)


def test_a_delay_is_as_long_on_a_fine_grid() -> None:
    """10 ms are a thousand steps of 10 us, more than a piece has; on a ramp of 2 V/s they are 20 mV."""
    signal = 2.0 * np.arange(6000) * 1e-5
    grid = Grid("run", 1e-5, 1, 0.0, 0.0)
    run = LeadAfterLevel(Place.G2, (1e-6,)).summed((-0.1,), grid)
    pieces = [Block(signal[at : at + 200], signal[at : at + 200], at, grid) for at in range(0, 6000, 200)]
    out = np.concatenate([run(piece) for piece in pieces])
    assert (out - signal)[5000] == pytest.approx(-2.0 * 0.1 * signal[5000], rel=1e-3)


def test_what_comes_in_at_a_moment_is_all_there_from_it_on() -> None:
    """A gain, and dynamics whose states have been running all along."""
    grid, at = Grid("run", 1e-3, 1, 5.0, 0.0), 5.0 + np.arange(400) * 1e-3
    signal = np.sin(40.0 * at)
    block = Block(signal, signal, 0, grid)
    out = SuddenGain(Place.G1, (5.1,)).summed((0.5,), grid)(block)
    assert np.array_equal(out, np.where(at >= 5.1, 1.5, 1.0) * signal)
    dynamics, early = (SuddenDynamics(Place.G2, (0.01, moment)).summed((0.3,), grid)(block) for moment in (5.1, 4.0))
    assert np.array_equal(dynamics, np.where(at >= 5.1, early, signal))
    assert np.abs(early - signal).max() > 0.01


@pytest.mark.parametrize(("place", "in_front"), [(Place.G1, Place.SOURCE), (Place.SENSE, Place.F)])
def test_a_gain_that_leaps_between_two_runs_is_the_same_in_front_of_a_linear_block(
    place: Place, in_front: Place
) -> None:
    """In both runs, to rounding; one that leaps during the second is not, nor is a zero: rigs start at rest."""
    runs = [WALK, replace(WALK, name="again", start_s=10.0)]

    def apart(*laws: Correction) -> float:  # both blocks have a gain of 1 at rest
        chains = [law.put_in(PLAIN, {law.parameters()[0].name: 0.1}) for law in laws]
        return max(float(np.abs(np.subtract(*(simulate(chain, run) for chain in chains))).max()) for run in runs)

    assert in_front in GainSince(place, (5.0,)).same_at
    assert in_front not in SuddenGain(place, (5.0,)).like_at
    assert apart(GainSince(place, (5.0,)), SuddenGain(in_front, (5.0,))) < 1e-9
    assert apart(GainSince(place, (10.1,)), SuddenGain(in_front, (10.1,))) > 1e-4
    assert apart(SuddenOffset(place, (5.0,)), SuddenOffset(in_front, (5.0,))) > 1e-2


def test_a_curve_goes_through_its_knots_and_on_straight() -> None:
    free = LevelMap(Place.SENSE, (-2.0, -1.0, 0.0, 1.0, 2.0))
    run, _ = free.begin((0.0, 0.1, -0.2, 0.3, 0.0), None, None)
    levels = np.array([-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0])

    class Bare:
        signal = levels

    added = run(Bare) - levels
    assert added[2:7] == pytest.approx([0.0, 0.1, -0.2, 0.3, 0.0], abs=1e-12)
    assert added[0] == pytest.approx(2.0 * added[1], abs=1e-12)
    assert added[8] == pytest.approx(2.0 * added[7], abs=1e-12)


WRONG = {
    "no form": (Physics("unnamed", {}, "F", "law of nature"), "has no form 'law of nature'"),
    "no knots": (Physics("unnamed", {"add1": 1.0}, "F"), "needs knots at1, at2"),
    "falling": (Physics("unnamed", {"at1": 1.0, "at2": 0.0, "at3": 2.0, "at4": 3.0}, "F"), "must rise"),
    "uneven": (Physics("unnamed", {"at1": 0.0, "at2": 1.0, "at3": 2.0, "at4": 4.0}, "F"), "evenly spaced"),
    "no time constant": (
        Physics("unnamed", {"at1": 0.0, "at2": 1.0, "at3": 2.0, "at4": 3.0}, "G1", "current over the level"),
        "needs tau, in s, above zero",
    ),
    "stage": (Physics("unnamed", {"at1": 1.0}, "F", "line"), "not at F; stages: sense, G1"),
    "value": (Physics("unnamed", {"at1": 1.0, "pass7": 1.0}, "sense", "path past the circuit"), "no value 'pass7'"),
}


@pytest.mark.parametrize("name", WRONG)
def test_what_cannot_be_is_refused_with_one_sentence(name: str) -> None:
    piece, words = WRONG[name]
    with pytest.raises(ValueError, match=words):
        with_physics(PLAIN, [piece])


def test_what_needs_a_gap_is_refused_without_one() -> None:
    linear = Model(MODEL.title, MODEL.g1, LinearF(), MODEL.g2, physics=(planted("drift of the gap", Place.F),))
    with pytest.raises(ValueError, match="does not go into this F"):
        chain_of(linear)


def test_every_form_is_told_apart_by_its_values() -> None:
    for form, place in EVERY:
        assert correction_of(planted(form, place)) == correction(form, place)
    assert all(a is b or KINDS[a] is not KINDS[b] for a, b in product(KINDS, KINDS))
