"""Does an editor mark what the program refuses, and nothing that it accepts?"""

import json
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema import Draft7Validator

from rig.errors import FileError, MisfitError
from rig.protocol import parse_protocol
from rig.references import packaged
from rig.rigfile import parse_rig
from rig.schemas import SCHEMAS, modeline, published, schema_text, with_modeline
from rig.units import quantity
from rig.written import In, as_written
from rig.yamlfile import parse_yaml
from tests.architecture.published import GALLERY, described, page

MADE = "stale: run `python -m tests.architecture.published`"
TEXTS = {
    "protocol": """\
spec: 1
title: two sines
question: Is every form here?
limits: {level: 10 V}
acquisition: {rate: 10 kHz, inputs: [y, v]}
on_overrun: report
steps:
  - {repeats: 2, sine: {frequency: 8 Hz, amplitude: 3.0 V, periods: 8}}
  - {staircase: {levels: [1 V, {from: -3 V, to: 3 V, step: 0.5 V}], dwell: 200 ms}}
  - {multisine: {frequencies: [4 Hz, 8 Hz], peak: 3 V, time: 1 s}}
  - {hold: {level: 1 V, time: 1 s}}
  - {minor_loops: {amplitudes: [2 V, 1 V], slope: 10 V/s}}
  - {table: {times: [0 s, 1 s], levels: [0 V, 1 V], between: linear}}
  - {triangle: {frequency: 2 Hz, amplitude: 1 V, periods: 2}}
""",
    "rig": """\
spec: 1
rig: op-amp backlash circuit
G1: {num: [1000], den: [1.0e-4, 20, 1000]}
F: {backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1.25 V}}
G2: {num: [1000], den: [1.0e-6, 2, 1000], dead_time: 0 s}
noise: 10 mV
fixed: [noise]
physics:
  saturation: {upper: 10 V, lower: -10 V}
""",
}


def mistakes() -> list[tuple[str, str, str]]:
    """Return kind of file, what is right and what is wrong, of every row in the README of the schemas."""
    lines = (packaged() / "schemas" / "README.md").read_text(encoding="utf-8").splitlines()
    rows = [line.strip("|").split("|") for line in lines if line.startswith(("| protocol |", "| rig |"))]
    return [(kind.strip(), right.strip().strip("`"), wrong.strip().strip("`")) for kind, right, wrong, _ in rows]


def found(kind: str, data: object) -> list[str]:
    """Return what an editor marks."""
    return [error.message for error in Draft7Validator(json.loads(schema_text(kind))).iter_errors(data)]


def read(kind: str, text: str) -> Any:
    return parse_protocol(text, "p.yaml") if kind == "protocol" else parse_rig(text, "r.yaml")


@pytest.mark.parametrize("kind", SCHEMAS)
def test_what_is_published_is_what_the_forms_say(kind: str) -> None:
    assert published(kind).read_text(encoding="utf-8") == schema_text(kind), MADE
    Draft7Validator.check_schema(json.loads(schema_text(kind)))


def test_the_page_of_the_gallery_is_the_gallery() -> None:
    assert GALLERY.read_text(encoding="utf-8") == page(), MADE


@pytest.mark.parametrize(("kind", "path"), [pytest.param(*each, id=each[1].stem) for each in described()])
def test_every_file_that_comes_with_the_program_is_accepted_and_names_its_schema(kind: str, path: Path) -> None:
    text = path.read_text(encoding="utf-8")
    assert not found(kind, parse_yaml(text, str(path)).data)
    assert with_modeline(text, kind, path.parent) == text, MADE


@pytest.mark.parametrize("kind", TEXTS)
def test_what_the_mistakes_are_made_in_is_right(kind: str) -> None:
    read(kind, TEXTS[kind])
    assert not found(kind, parse_yaml(TEXTS[kind], "").data)


@pytest.mark.parametrize(("kind", "right", "wrong"), mistakes())
def test_every_mistake_of_the_readme_is_marked_and_refused(kind: str, right: str, wrong: str) -> None:
    assert TEXTS[kind].count(right) == 1
    text = TEXTS[kind].replace(right, wrong)
    assert found(kind, parse_yaml(text, "").data)
    with pytest.raises(FileError):
        read(kind, text)


def test_the_readme_tells_many_mistakes() -> None:
    assert len(mistakes()) >= 35


@pytest.mark.parametrize("text", [
    "F: linear", "F: backlash", "F: {backlash: unknown}", "F: {linear: {gain: 2, offset: 1 mV}}",
    "F: {backlash: {S: 8, D_L: 1 V, D_U: -1 V}}",
    "F: {curved_backlash: {L: [[-1 V, -18 V], [1 V, -2 V]], U: [[-1 V, 1 V], [1 V, 20 V]]}}",
])  # fmt: skip
def test_every_form_of_f_is_accepted(text: str) -> None:
    rig = TEXTS["rig"].replace("F: {backlash: {S_L: 8, D_L: 1.25 V, S_U: 8, D_U: -1.25 V}}", text)
    read("rig", rig)
    assert not found("rig", parse_yaml(rig, "").data)


def test_every_effect_can_be_named_with_its_values() -> None:
    pieces = json.loads(schema_text("rig"))["$defs"]["Physics"]["properties"]
    assert set(pieces["saturation"]["properties"]) >= {"stage", "form", "upper", "lower"}
    data: Any = parse_yaml(TEXTS["rig"], "").data
    for values in ({"upper": "9 V"}, {"stage": "F", "form": "upper", "upper": "9 V"}, {"upper[monday]": "9 V"}):
        assert not found("rig", {**data, "physics": {"saturation": values}})
    for values in ({}, {"stage": "F"}, {"stage": "F", "form": "upper"}):
        assert found("rig", {**data, "physics": {"saturation": values}})
    unnamed = {"form": "level", "at1": "1 V", "weight1": "1 V"}
    assert not found("rig", {**data, "physics": {"unnamed": unnamed, "unnamed_2": unnamed}})


@pytest.mark.parametrize("second", ["extra_pole@G2", "extra_pole@F", "extra_pole@"])
def test_an_effect_may_be_at_a_second_stage_of_its_own(second: str) -> None:
    data: Any = parse_yaml(TEXTS["rig"], "").data
    rig = {**data, "physics": {"extra_pole": {"tau": "1 ms"}, second: {"tau": "2 ms"}}, "fixed": [f"{second}.tau"]}
    known = second == "extra_pole@G2"
    assert bool(found("rig", rig)) is not known
    with nullcontext() if known else pytest.raises(FileError):
        read("rig", json.dumps(rig))


@given(st.sampled_from(["V", "s", "Hz", "rad", "V/V", "V/s", ""]),
       st.floats(-1e12, 1e12, allow_nan=False), st.sampled_from(["%g", "%.3f", "%e", " %d "]),
       st.sampled_from(["", " V", "mV", " µV", "kV", " ms", " s", "Hz", " kHz", " rad/s", " 1/s", "V/ms", " %", " deg",
                        " volt", "V*s", " V^2", " min", " ppm", " m V"]))  # fmt: skip
def test_a_quantity_that_is_read_is_never_marked(
    unit: str, number: float, form: str, given_unit: str
) -> None:
    text = f"{form % number}{given_unit}"
    marked = bool(list(Draft7Validator(as_written(unit)).iter_errors(text)))
    try:
        quantity(text, unit)
    except MisfitError:
        return
    assert not marked


def test_the_annotation_is_what_it_says() -> None:
    assert In("V").unit == "V"
    assert not list(Draft7Validator(as_written("Hz", whole=True)).iter_errors("628 x 0.01 rad/s"))


def test_the_comment_names_the_schema_from_wherever_the_file_is(tmp_path: Path) -> None:
    assert modeline("rig", packaged() / "rigs").endswith("$schema=../schemas/rig.schema.json")
    assert modeline("protocol", tmp_path).endswith(f"$schema={published('protocol').resolve().as_posix()}")
    text = "# Question: what?\n#\n# Because.\nspec: 1\n"
    once = with_modeline(text, "protocol", tmp_path)
    assert once.splitlines()[3] == modeline("protocol", tmp_path)
    assert with_modeline(once, "protocol", tmp_path) == once
