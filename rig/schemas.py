"""What does an editor need to know of protocols and rig files: the JSON Schemas of the forms that validate them?

They are generated from those forms, published in ``protocols/schemas`` and used through yaml-language-server, by the
comment a file opens with. Draft 7, the latest that it knows well. A file that a schema accepts may still be refused by
``rig check``, which knows the device, the rig and every unit; one that the program accepts is never marked.
"""

import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

from pydantic.json_schema import models_json_schema

from identify.model import Physics
from rig.forms import Form
from rig.outputs import json_text
from rig.protocol import ProtocolForm, StepForm
from rig.references import packaged
from rig.rigfile import BLOCK_KEYS, BORDER_KEYS, CURVE_KEYS, LINEAR_KEYS
from rig.rigforms import RigForm
from rig.rigphysics import APART, PHYSICS_KEYS, catalogue, parameter_units
from rig.steps import STIMULI
from rig.stimulus import Stimulus
from rig.written import as_written

Schema = dict[str, Any]
DRAFT = "http://json-schema.org/draft-07/schema#"
MODELINE = "# yaml-language-server: $schema="
UNNAMED = "^unnamed(_[0-9]+)?$"


def schema_text(kind: str) -> str:
    """Return the JSON Schema of a ``protocol`` or of a ``rig`` file as it is published."""
    return json_text(SCHEMAS[kind]())


def published(kind: str) -> Path:
    """Return where the schema lies that comes with the program."""
    return packaged() / "schemas" / f"{kind}.schema.json"


def modeline(kind: str, folder: Path) -> str:
    """Return the comment by which editors find the schema, for a file in ``folder``."""
    schema, here = published(kind).resolve(), folder.resolve()
    near = packaged().resolve() in (here, here.parent)
    return MODELINE + Path(os.path.relpath(schema, here) if near else schema).as_posix()


def with_modeline(text: str, kind: str, folder: Path) -> str:
    """Return the text of a file with the comment that fits ``folder`` in place of the one it has."""
    lines = [line for line in text.splitlines() if not line.startswith(MODELINE)]
    first = next((at for at, line in enumerate(lines) if not line.startswith("#")), len(lines))
    return "\n".join([*lines[:first], modeline(kind, folder), *lines[first:]]) + "\n"


def _protocol() -> Schema:
    forms = _forms([ProtocolForm, StepForm, *STIMULI.values()])
    top, step = forms.pop("ProtocolForm"), forms.pop("StepForm")
    top["properties"]["steps"] = {"type": "array", "minItems": 1, "items": _step(step, STIMULI),
                                  "description": "What is played, in this order."}
    return _whole("protocol", "A protocol: what is played on a rig, within which limits, and why.", top, forms)


def _forms(asked: Iterable[type[Form]]) -> Schema:
    """Return the schemas of forms, and of those in them, by name."""
    _, parts = models_json_schema([(form, "validation") for form in asked])
    return dict(parts["$defs"])


def _step(beside: Schema, stimuli: Mapping[str, type[Stimulus]]) -> Schema:
    """Return a step: one stimulus, and what every step may say beside it."""
    named = {kind: {"$ref": f"#/$defs/{form.__name__}"} for kind, form in stimuli.items()}
    return {
        "type": "object", "description": "One stimulus, and perhaps a label and repeats.",
        "properties": {**named, **beside["properties"]}, "additionalProperties": False,
        "oneOf": [{"required": [kind]} for kind in stimuli],
    }  # fmt: skip


def _rig() -> Schema:
    forms = _forms([RigForm])
    top = forms.pop("RigForm")
    forms["Physics"] = {
        "type": "object", "additionalProperties": False, "properties": {name: _piece(name) for name in catalogue()},
        "patternProperties": {UNNAMED: {"type": "object"}, **_elsewhere()},
    }  # fmt: skip
    for key, told in (("physics", "Physics that is known, as part of the model."),
                      ("concealed", "Physics that only simulated devices play.")):  # fmt: skip
        top["properties"][key] = {"allOf": [{"$ref": "#/$defs/Physics"}], "description": told}
    top["properties"]["fixed"]["items"] = {"type": "string", "pattern": _fixed()}
    return _whole("rig", "A rig file: the plain model G1 -> F -> G2 of a circuit.", top, forms)


def _elsewhere() -> Schema:
    """Return the physics that may be at a second place, by the expression of what it is then called."""
    several = {name: [place.label for place in kind.places] for name, kind in catalogue().items()}
    return {
        f"^{name}{APART}({'|'.join(stages)})$": {"$ref": f"#/$defs/Physics/properties/{name}"}
        for name, stages in several.items() if len(stages) > 1
    }  # fmt: skip


def _piece(name: str) -> Schema:
    """Return one piece of physics: its stages, its forms, its values in all of them; one of single runs is `k[run]`."""
    kind = catalogue()[name]
    stages, units = [place.label for place in kind.places], {}
    for stage in stages:
        for form in kind.forms:
            units.update(parameter_units(Physics(name, {}, stage, form)))
    values = {key: as_written(unit) for key, unit in units.items()}
    here = f"#/$defs/Physics/properties/{name}/properties"
    choices = {"stage": {"enum": stages}, "form": {"enum": list(kind.forms)}}
    return {
        "type": "object", "description": kind.title, "properties": {**choices, **values},
        "patternProperties": {rf"^{key}\[": {"$ref": f"{here}/{key}"} for key in values}, "additionalProperties": False,
        "not": {"propertyNames": {"enum": list(PHYSICS_KEYS)}},
    }  # fmt: skip


def _fixed() -> str:
    """Return the expression of what may be held at its value."""
    f = sorted({*BORDER_KEYS, *CURVE_KEYS, *LINEAR_KEYS})
    stages = sorted({place.label for kind in catalogue().values() for place in kind.places})
    physics = rf"[a-z0-9_]+({APART}({'|'.join(stages)}))?(\..+)?"
    return rf"^(noise|(G1|G2)(\.({'|'.join(BLOCK_KEYS)}))?|F(\.({'|'.join(f)}))?|{physics})$"


def _whole(kind: str, told: str, top: Schema, forms: Schema) -> Schema:
    """Return a schema with its head, without what pydantic says for programs."""
    bare: Schema = _plain({**top, "$defs": forms})
    return {"$schema": DRAFT, "title": f"backlash-rig {kind}, spec 1", **bare, "description": told}


def _plain(node: Any) -> Any:
    """Return a schema without titles made from names, defaults nobody could type, and marks of reStructuredText."""
    if isinstance(node, list):
        return [_plain(entry) for entry in node]
    if not isinstance(node, dict):
        return node
    kept = {key: _plain(value) for key, value in node.items() if not _is_noise(key, value)}
    if isinstance(told := kept.get("description"), str):
        kept["description"] = " ".join(told.replace("``", "`").split())
    return kept


def _is_noise(key: str, value: object) -> bool:
    """Return whether an entry tells an editor nothing; below ``properties`` every value is a mapping."""
    return (key == "title" and isinstance(value, str)) or (key == "default" and not isinstance(value, int | str))


SCHEMAS: dict[str, Callable[[], Schema]] = {"protocol": _protocol, "rig": _rig}
