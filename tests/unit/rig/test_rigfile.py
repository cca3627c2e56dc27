"""Does a rig file mean what it says, read back what was written, and refuse what it must not say?"""

import json
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.effects import chain_of, physics_in
from identify.model import Backlash, CurvedBacklash, LinearF, Model, Physics, Rational
from rig.errors import FileError
from rig.rigfile import model_to_dict, model_to_yaml, parse_rig, read_rig

TEXT = """\
spec: 1
rig: op-amp backlash circuit
G1: {num: [1000], den: [1.0e-4, 20, 1000]}
F: {backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1250 mV}}
G2: {num: [1000], den: [1.0e-6, 2, 1000], dead_time: 100 us}
noise: 10 mV
fixed: [G1, F.S_L]
physics:
  dead_time: {delay: 1 ms}
concealed:
  saturation: {upper: 10 V, lower: -10 V}
"""
PLAIN = TEXT.partition("fixed:")[0]


def refused(text: str) -> str:
    with pytest.raises(FileError) as caught:
        parse_rig(text, "r.yaml")
    return str(caught.value)


def test_a_rig_says_what_its_file_says() -> None:
    rig = parse_rig(PLAIN, "r.yaml")
    assert rig.model == Model(
        "op-amp backlash circuit", Rational((1000.0,), (1e-4, 20.0, 1000.0)), Backlash(8.0, 1.25, 8.0, -1.25),
        Rational((1000.0,), (1e-6, 2.0, 1000.0), 1e-4), noise_v=0.01,
    )
    assert rig.concealed == ()
    assert rig.text == PLAIN


def test_physics_known_and_concealed_are_kept_apart() -> None:
    rig = parse_rig(TEXT.replace("delay: 1 ms", DELAY), "r.yaml")
    assert [piece.id for piece in rig.model.physics] == ["dead_time"]
    assert rig.concealed == (Physics("saturation", {"upper": 10.0, "lower": -10.0}),)
    assert rig.model.fixed == ("G1", "F.S_L")


def _short_name_of_dead_time() -> str:
    from identify.effects import catalogue

    return catalogue()["dead_time"].declared[0].name.rpartition(".")[2]


DELAY = f"{_short_name_of_dead_time()}: 1 ms"


def test_stage_and_form_of_physics_are_read_and_written() -> None:
    text = PLAIN + "physics:\n  saturation: {form: upper, stage: F, upper: 9 V}\n"
    model = parse_rig(text, "r.yaml").model
    assert model.physics == (Physics("saturation", {"upper": 9.0}, "F", "upper"),)
    assert parse_rig(model_to_yaml(model), "r.yaml").model == model


def test_the_same_law_at_a_second_place_goes_by_its_stage_too() -> None:
    text = PLAIN + "fixed: [extra_pole@G2.tau]\nphysics:\n  extra_pole: {tau: 1 ms}\n  extra_pole@G2: {tau: 2 ms}\n"
    model = parse_rig(text, "r.yaml").model
    assert model.physics == (Physics("extra_pole", {"tau": 1e-3}), Physics("extra_pole", {"tau": 2e-3}, "G2"))
    assert parse_rig(model_to_yaml(model), "r.yaml").model == model
    chain = chain_of(model)
    assert (chain.values["extra_pole.tau"], chain.values["extra_pole@G2.tau"]) == (1e-3, 2e-3)
    assert [(piece.id, piece.stage) for piece in physics_in(chain)] == [("extra_pole", "G1"), ("extra_pole", "G2")]


def test_values_that_mean_absent_are_not_written() -> None:
    model = Model("t", Rational((1.0,), (1.0,)), LinearF(), Rational((1.0,), (1.0,)),
                  physics=(Physics("saturation", {"upper": 9.0, "lower": float("-inf")}),))
    assert model_to_dict(model)["physics"] == {"saturation": {"upper": "9.0 V"}}


number = st.floats(min_value=1e-6, max_value=1e6)
block = st.builds(lambda gain, taus, dead: Rational((gain,), (*taus, 1.0), dead),
                  number, st.lists(number, max_size=1), st.floats(0, 10))
rising = st.lists(st.tuples(st.floats(0.01, 5), st.floats(0.01, 50)), min_size=2, max_size=6).map(
    lambda steps: tuple((float(sum(v for v, _ in steps[: i + 1])), float(sum(w for _, w in steps[: i + 1])))
                        for i in range(len(steps))))
law = st.one_of(
    rising.map(lambda points: CurvedBacklash(points, tuple((v, w + 0.5) for v, w in points))),
    st.builds(LinearF, st.floats(-1e3, 1e3), st.floats(-10, 10)),
    st.builds(lambda s, d, gap: Backlash(s, d, s, d - gap), number, st.floats(-10, 10), st.floats(0, 10)),
)


@settings(max_examples=50, deadline=None)
@given(st.builds(Model, st.just("a: rig"), block, law, block, st.one_of(st.none(), st.floats(0, 10))))
def test_a_model_reads_back_to_the_last_bit(model: Model) -> None:
    assert parse_rig(model_to_yaml(model), "r.yaml").model == model
    assert parse_rig(json.dumps(model_to_dict(model)), "m.json").model == model


def test_the_model_of_an_explanation_is_a_rig(tmp_path: Path) -> None:
    model = parse_rig(PLAIN, "r.yaml").model
    path = tmp_path / "explanation.json"
    path.write_text(json.dumps({"schema": "rig.explain/1", "verdict": "consistent", "model": model_to_dict(model)}))
    assert read_rig(path).model == model


@pytest.mark.parametrize(("wrong", "right", "message"), [
    ("D_L: 1.25,", "D_L: 1.25 V,", "r.yaml:4: F.backlash.D_L: a number without a unit: 1.25"),
    ("S_R: 8,", "S_L: 8,", "r.yaml:4: F.backlash.S_R: unknown key 'S_R'; allowed: D_L, D_U, S_L, S_U; did you"),
    ("S_L: -8,", "S_L: 8,", "r.yaml:4: F.backlash.S_L: a border rises: -8 V/V; allowed: above 0 V/V"),
    ("D_L: -2 V,", "D_L: 1.25 V,", "r.yaml:4: F.backlash.D_L: the borders are exchanged: -2 V; allowed: at least D_U"),
    ("S_U: 8, ", "S_U: 8, D_U: -1250 mV", "r.yaml:4: F.backlash: the key 'D_U' is missing; add 'D_U:'"),
    ("F: straight", "F: {backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1250 mV}}", "r.yaml:4: F: must be 'linear'"),
    ("F: {}", "F: {backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1250 mV}}", "r.yaml:4: F: F has one kind"),
    ("den: [1, -20]", "den: [1.0e-4, 20, 1000]", "r.yaml:3: G1: the block is not stable: a pole at 20 rad/s"),
    ("den: []", "den: [1.0e-4, 20, 1000]", "r.yaml:3: G1.den:"),
    ("noise: -1 mV", "noise: 10 mV", "r.yaml:6: noise: must be greater than or equal to 0"),
    ("spec: 7", "spec: 1", "r.yaml:1: spec: must be 1: 7"),
])
def test_a_wrong_rig_is_refused_with_its_line(wrong: str, right: str, message: str) -> None:
    assert message in refused(PLAIN.replace(right, wrong))


ONE_SLOPE = PLAIN.replace("S_L: 8, D_L: 1.25 V, S_U: 8,", "S: 8, D_L: 1.25 V,")


def test_one_slope_for_both_borders_is_a_promise_of_the_circuit() -> None:
    model = parse_rig(ONE_SLOPE, "r.yaml").model
    assert model.f == Backlash(8.0, 1.25, 8.0, -1.25, tied=True)
    assert parse_rig(model_to_yaml(model), "r.yaml").model == model
    assert not isinstance(f := parse_rig(PLAIN, "r.yaml").model.f, Backlash) or not f.tied
    assert "r.yaml:4: F.backlash.S: a border rises: -8 V/V" in refused(ONE_SLOPE.replace("S: 8", "S: -8"))
    assert "unknown key 'S_U'; allowed: D_L, D_U, S" in refused(ONE_SLOPE.replace("S: 8", "S: 8, S_U: 8"))


CURVED = PLAIN.replace("{backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1250 mV}}", """{curved_backlash: {
    L: [[-1 V, -18 V], [1 V, -2 V], [3000 mV, 13 V]],
    U: [[-3 V, -14 V], [1 V, 18 V]]}}""")


def test_bent_borders_are_points_with_units() -> None:
    model = parse_rig(CURVED, "r.yaml").model
    assert model.f == CurvedBacklash(((-1.0, -18.0), (1.0, -2.0), (3.0, 13.0)), ((-3.0, -14.0), (1.0, 18.0)))
    assert parse_rig(model_to_yaml(model), "r.yaml").model == model
    assert parse_rig(CURVED + "fixed: [F.L]\n", "r.yaml").model.fixed == ("F.L",)


@pytest.mark.parametrize(("wrong", "right", "message"), [
    ("[1, -2 V]", "[1 V, -2 V]", "r.yaml:5: F.curved_backlash.L[1][0]: a number without a unit: 1; allowed: a voltage"),
    ("[-1 V, -2 V]", "[1 V, -2 V]", "F.curved_backlash.L[1][0]: a border rises in v: -1 V; allowed: above the -1 V"),
    ("[1 V, -19 V]", "[1 V, -2 V]", "F.curved_backlash.L[1][1]: a border rises in w: -19 V; allowed: above the -18 V"),
    ("[[1 V, 18 V]]", "[[-3 V, -14 V], [1 V, 18 V]]", "r.yaml:6: F.curved_backlash.U: "),
    ("[1 V, -2 V, 3 V]", "[1 V, -2 V]", "r.yaml:5: F.curved_backlash.L[1]: "),
    ("[1 V, -13 V]", "[1 V, 18 V]", "r.yaml:4: F.curved_backlash: the borders cross: at v = 3 V L is 13 V, U -12.5 V"),
])
def test_wrong_bent_borders_are_refused_with_their_line(wrong: str, right: str, message: str) -> None:
    assert right in CURVED
    assert message in refused(CURVED.replace(right, wrong))


@pytest.mark.parametrize(("text", "message"), [
    ("fixed: [G3]\n", "r.yaml:7: fixed[0]: unknown parameter 'G3'"),
    ("physics:\n  saturaton: {upper: 1 V}\n", "r.yaml:8: physics.saturaton: unknown physics 'saturaton'"),
    ("physics:\n  saturation: {uper: 1 V}\n", "r.yaml:8: physics.saturation.uper: unknown parameter 'uper'"),
    ("physics:\n  saturation: {upper: 1}\n", "r.yaml:8: physics.saturation.upper: a number without a unit"),
    ("physics:\n  saturation: {}\n", "r.yaml:8: physics.saturation: physics without values; allowed: upper, lower"),
    ("concealed:\n  saturation: {stage: G9, upper: 1 V}\n", "r.yaml:8: concealed.saturation.stage: unknown stage 'G9'"),
    ("concealed:\n  saturation: {form: uper, upper: 1 V}\n", "did you mean 'upper'?"),
    ("physics: [saturation]\n", "r.yaml:7: physics:"),
    ("physics:\n  hum: {amplitude: 1 V}\n  hum@sense: {amplitude: 2 V}\n",
     "r.yaml:9: physics.hum@sense: hum at sense twice"),
    ("physics:\n  hum@G1: {stage: sense, amplitude: 2 V}\n",
     "r.yaml:8: physics.hum@G1.stage: hum@G1 with another stage: sense; allowed: G1"),
    ("physics:\n  hum@G2: {amplitude: 2 V}\n", "r.yaml:8: physics.hum@G2"),
])
def test_wrong_physics_is_refused_with_its_line(text: str, message: str) -> None:
    assert message in refused(PLAIN + text)


RINGING = PLAIN.replace("den: [1.0e-4, 20, 1000]", "den: [1, 0.5, 1, 1]")


def test_a_third_order_may_start_unstable_where_it_is_fitted_but_is_not_played() -> None:
    rig = parse_rig(RINGING, "r.yaml")
    assert rig.model.g1.den == (1.0, 0.5, 1.0, 1.0)
    with pytest.raises(FileError, match=r"r\.yaml: G1: the block is not stable"):
        rig.simulated()


@pytest.mark.parametrize("fixed", ["G1", "G1.den"])
def test_a_fixed_block_is_stable(fixed: str) -> None:
    assert "r.yaml:3: G1: the block is not stable" in refused(RINGING + f"fixed: [{fixed}]\n")


def test_a_simulated_rig_plays_what_it_conceals_too() -> None:
    rig = parse_rig(TEXT.replace("delay: 1 ms", DELAY), "r.yaml")
    assert [piece.id for piece in rig.simulated().physics] == ["dead_time", "saturation"]


def test_an_empty_file_says_how_a_rig_starts() -> None:
    assert refused("") == "r.yaml: the file is empty; a rig file starts with 'spec: 1'"


ORDERS = """\
spec: 1
rig: nobody knows
G1: {order: 2}
F: backlash
G2: {order: 3, zeros: 1, dead_time: fit}
"""


def test_a_rig_file_may_give_orders_in_place_of_values() -> None:
    model = parse_rig(ORDERS, "r.yaml").model
    assert (len(model.g1.den), len(model.g1.num)) == (3, 1)
    assert (len(model.g2.den), len(model.g2.num)) == (4, 2)
    assert model.unknown == ("G1", "F", "G2", "G2.gain", "G2.dead_time")
    assert parse_rig(model_to_yaml(model), "r.yaml").model == model
    known = parse_rig(ORDERS.replace("dead_time: fit", "gain: -2, dead_time: 1 ms"), "r.yaml").model
    assert known.unknown == ("G1", "F", "G2")
    assert (known.g2.dc_gain, known.g2.dead_time_s) == (-2.0, 1e-3)
    assert parse_rig(model_to_yaml(known), "r.yaml").model == known


@pytest.mark.parametrize("f", ["{backlash: unknown}", "backlash"])
def test_borders_alone_may_be_unknown(f: str) -> None:
    text = PLAIN.replace("{backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1250 mV}}", f)
    assert parse_rig(text, "r.yaml").model.unknown == ("F",)


@pytest.mark.parametrize(("wrong", "right", "message"), [
    ("{order: 2, zeros: 3}", "{order: 2}", "r.yaml:3: G1: more zeros than poles: 3 zeros over 2 poles; allowed: zeros"),
    ("{order: -1}", "{order: 2}", "r.yaml:3: G1.order: must be greater than or equal to 0"),
    ("{order: 7}", "{order: 2}", "r.yaml:3: G1.order: must be less than or equal to 6"),
    ("{order: 2.5}", "{order: 2}", "r.yaml:3: G1.order: "),
    ("{order: 2, dead_time: fit}", "{order: 2}", "r.yaml:3: G1: only the sum of the dead times shows in a recording"),
    ("{order: 2, gain: 0}", "{order: 2}", "r.yaml:3: G1: no gain at 0 Hz"),
    ("{order: 2, den: [1, 1]}", "{order: 2}", "r.yaml:3: G1.order: unknown key 'order'"),
    ("{order: 2, zero: 1}", "{order: 2}", "r.yaml:3: G1.zero: unknown key 'zero'; allowed: dead_time, gain, order"),
    ("dead_time: fitt", "dead_time: fit", "r.yaml:5: G2.dead_time: "),
    ("F: {backlash: none}", "F: backlash", "r.yaml:4: F.backlash: must be 'unknown'"),
    ("F: curved", "F: backlash", "r.yaml:4: F: must be 'linear' or 'backlash'"),
    ("F: backlash\nfixed: [G1]", "F: backlash", "r.yaml:5: fixed[0]: G1 has no value to be held at"),
    ("F: backlash\nfixed: [F.S_L]", "F: backlash", "r.yaml:5: fixed[0]: F.S_L has no value to be held at"),
    ("F: backlash\nfixed: [G2.dead_time]", "F: backlash", "r.yaml:5: fixed[0]: G2.dead_time has no value to be held"),
])
def test_nonsense_about_orders_is_refused_with_its_line(wrong: str, right: str, message: str) -> None:
    assert message in refused(ORDERS.replace(right, wrong))


def test_a_dead_time_with_a_value_may_be_held_in_a_block_without() -> None:
    text = ORDERS.replace("dead_time: fit", "dead_time: 1 ms") + "fixed: [G2.dead_time]\n"
    assert parse_rig(text, "r.yaml").model.fixed == ("G2.dead_time",)


def test_a_rig_without_values_is_not_simulated() -> None:
    with pytest.raises(FileError, match=r"r\.yaml: a rig without values cannot be simulated: G1 has none"):
        parse_rig(ORDERS, "r.yaml").simulated()
