"""What does a rig file say: the plain model, the physics known beside it, and what a simulated rig keeps to itself?

The same form is written into reports and JSON: ``model_to_dict`` and ``read_rig`` are inverse to each other, to the
last bit. ``read_rig`` also takes the JSON of ``rig explain``, whose ``model`` is in this form. A block may give its
orders in place of its values, and F may be just ``backlash``: ``rig/orders.py`` says how.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import yaml

from identify.model import Backlash, CurvedBacklash, LinearF, Model, NonlinearF, Physics, Points, Rational
from rig.amplifier import Amplifier
from rig.errors import FileError, MisfitError, unknown
from rig.limits import Limits
from rig.linearblock import check_block, check_stable, may_start_unstable
from rig.orders import UNIT_BACKLASH, OrdersForm, is_open, orders_dict, owns, unvalued
from rig.rigforms import BlockForm, BordersForm, CurvesForm, FForm, NonlinearityForm, OneSlopeForm, RigForm
from rig.rigphysics import owned, physics_dict, physics_of
from rig.units import exact
from rig.yamlfile import Document, Keys, parse_json, parse_yaml, read_text

Values = Mapping[str, Any]

BLOCK_KEYS = ("num", "den", "dead_time")
BORDER_KEYS = ("S_L", "D_L", "S_U", "D_U")
CURVE_KEYS = ("L", "U")
LINEAR_KEYS = ("gain", "offset")


@dataclass(frozen=True)
class RigFile:
    """A rig as ``where`` describes it, with the limits of its input; only simulated devices play ``concealed``.

    ``amplifier`` stands between the output of a device and the rig; u is the voltage behind it.
    """

    model: Model
    concealed: tuple[Physics, ...]
    text: str
    where: str = "the rig file"
    limits: Limits | None = None
    amplifier: Amplifier | None = None

    def is_as(self, other: "RigFile") -> bool:
        """Return whether another file describes the same plain model; only a simulation knows what it conceals."""
        return (self.model, self.amplifier) == (other.model, other.amplifier)

    def simulated(self) -> Model:
        """Return what a simulated device plays; raise FileError for what is only a start, or no value, for a fit."""
        if self.model.unknown:
            raise FileError("a rig without values cannot be simulated", where=self.where,
                            value=f"{self.model.unknown[0]} has none", do="give num, den and borders, or identify it")
        for name, block in (("G1", self.model.g1), ("G2", self.model.g2)):
            try:
                check_stable(block.den)
            except MisfitError as error:
                raise error.placed(f"{self.where}: {name}") from error
        return replace(self.model, physics=(*self.model.physics, *self.concealed))


def read_rig(path: str | Path) -> RigFile:
    """Return the rig in a YAML file, a model JSON or an explanation JSON; raise FileError."""
    return parse_rig(read_text(Path(path)), str(path))


def parse_rig(text: str, where: str) -> RigFile:
    """Return the rig in ``text``; ``where`` names it in messages; raise FileError."""
    document = parse_json(text, where) if text.lstrip().startswith("{") else parse_yaml(text, where)
    keys = _root(document)
    form = RigForm.read(document, *keys)
    physics = physics_of(document, (*keys, "physics"), form.physics)
    g1, one = _block(document, (*keys, "G1"), form.G1, form.fixed)
    g2, two = _block(document, (*keys, "G2"), form.G2, form.fixed)
    f, between = _f(document, (*keys, "F"), form.F)
    unknown = (*one, *between, *two)
    model = Model(
        title=form.rig, g1=g1, f=f, g2=g2, noise_v=form.noise, physics=physics, unknown=unknown,
        fixed=_fixed(document, (*keys, "fixed"), form, physics, unknown),
    )
    concealed = physics_of(document, (*keys, "concealed"), form.concealed)
    return RigFile(model, concealed, text, where, form.limits.limits() if form.limits else None,
                   form.amplifier.amplifier() if form.amplifier else None)


def model_to_dict(model: Model) -> dict[str, Any]:
    """Return the model in the form of a rig file: plain dicts, lists and numbers, quantities as text with a unit."""
    built: dict[str, Any] = {
        "spec": 1, "rig": model.title, "G1": _block_dict("G1", model.g1, model.unknown),
        "F": "backlash" if "F" in model.unknown else _f_dict(model.f), "G2": _block_dict("G2", model.g2, model.unknown),
    }
    if model.noise_v is not None:
        built["noise"] = exact(model.noise_v, "V")
    if model.fixed:
        built["fixed"] = list(model.fixed)
    if model.physics:
        built["physics"] = physics_dict(model.physics)
    return built


def model_to_yaml(model: Model) -> str:
    """Return the text of a rig file that reads back as the same model."""
    return str(yaml.safe_dump(model_to_dict(model), sort_keys=False, default_flow_style=None, allow_unicode=True))


def _root(document: Document) -> Keys:
    """Return where the rig stands in the document: at the top, or under ``model`` of an explanation."""
    data = document.data
    if data is None:
        raise document.error("the file is empty", do="a rig file starts with 'spec: 1'")
    if not isinstance(data, dict) or not str(data.get("schema", "")).startswith("rig."):
        return ()
    return ("model",) if isinstance(data.get("model"), dict) else ()


def _block(
    document: Document, keys: Keys, form: BlockForm | OrdersForm, fixed: Sequence[str]
) -> tuple[Rational, tuple[str, ...]]:
    """Return a block and what of it is unknown; only one to be fitted may be unstable at its starting values."""
    name = str(keys[-1])
    try:
        if isinstance(form, OrdersForm):
            return unvalued(name, form)
        check_block(form.num, form.den)
        if {name, f"{name}.den"} & set(fixed) or not may_start_unstable(form.den):
            check_stable(form.den)
    except MisfitError as error:
        raise error.placed(document.at(*keys)) from error
    return Rational(tuple(map(float, form.num)), tuple(map(float, form.den)), form.dead_time), ()


def _f(document: Document, keys: Keys, form: FForm) -> tuple[NonlinearF | LinearF, tuple[str, ...]]:
    """Return F, and ``F`` where its borders are unknown."""
    if form == "linear":
        return LinearF(), ()
    if form == "backlash" or (form.backlash == "unknown" and form.curved_backlash is None and form.linear is None):
        return UNIT_BACKLASH, ("F",)
    return _valued_f(document, keys, form), ()


def _valued_f(document: Document, keys: Keys, form: NonlinearityForm) -> NonlinearF | LinearF:
    if sum(kind is not None for kind in (form.backlash, form.curved_backlash, form.linear)) != 1:
        raise document.error("F has one kind", *keys, allowed="backlash, curved_backlash or linear")
    if form.linear is not None:
        return LinearF(form.linear.gain, form.linear.offset)
    if form.curved_backlash is not None:
        return _curved(document, (*keys, "curved_backlash"), form.curved_backlash)
    assert isinstance(form.backlash, BordersForm | OneSlopeForm)
    return _backlash(document, (*keys, "backlash"), form.backlash)


def _curved(document: Document, keys: Keys, form: CurvesForm) -> CurvedBacklash:
    from identify.bent.border import crossing

    loading, unloading = (_points(document, (*keys, side), getattr(form, side)) for side in CURVE_KEYS)
    curved = CurvedBacklash(loading, unloading)
    if met := crossing(curved):
        v, low, high = met
        raise document.error("the borders cross", *keys, value=f"at v = {v:.4g} V L is {low:.4g} V, U {high:.4g} V",
                             allowed="L at most U at every v", do="the loading border lies below the unloading one")
    return curved


def _points(document: Document, keys: Keys, pairs: list[list[float]]) -> Points:
    """Return the points of one border; raise FileError at the first that does not rise."""
    for index, (before, point) in enumerate(pairwise(pairs), start=1):
        for column, name in enumerate(("v", "w")):
            if point[column] <= before[column]:
                raise document.error(f"a border rises in {name}", *keys, index, column, value=f"{point[column]:g} V",
                                     allowed=f"above the {before[column]:g} V of the point before")
    return tuple((v, w) for v, w in pairs)


def _backlash(document: Document, keys: Keys, form: BordersForm | OneSlopeForm) -> Backlash:
    slopes = {"S": form.S} if isinstance(form, OneSlopeForm) else {"S_L": form.S_L, "S_U": form.S_U}
    for name, slope in slopes.items():
        if slope <= 0:
            raise document.error("a border rises", *keys, name, value=f"{slope:g} V/V", allowed="above 0 V/V")
    if form.D_L < form.D_U:
        raise document.error("the borders are exchanged", *keys, "D_L", value=f"{form.D_L:g} V",
                             allowed=f"at least D_U = {form.D_U:g} V",
                             do="the loading border lies right of the unloading one")
    if isinstance(form, OneSlopeForm):
        return Backlash(form.S, form.D_L, form.S, form.D_U, tied=True)
    return Backlash(form.S_L, form.D_L, form.S_U, form.D_U)


def _fixed(
    document: Document, keys: Keys, form: RigForm, physics: tuple[Physics, ...], open_names: Sequence[str]
) -> tuple[str, ...]:
    of_physics = {owner: tuple(piece.values) for owner, piece in owned(physics).items()}
    owners = {"G1": BLOCK_KEYS, "F": _f_keys(form.F), "G2": BLOCK_KEYS, **of_physics}
    valid = [*owners, *(f"{owner}.{name}" for owner, names in owners.items() for name in names), "noise"]
    for index, name in enumerate(form.fixed):
        if name not in valid:
            raise FileError(where=document.at(*keys, index), **unknown("parameter", name, valid))
        if is_open(name, open_names):
            raise document.error(f"{name} has no value to be held at", *keys, index, do="give its values")
    return tuple(form.fixed)


def _f_keys(form: FForm) -> tuple[str, ...]:
    """Return what of F may be fixed."""
    if form == "backlash":
        return BORDER_KEYS
    if form == "linear" or form.linear is not None:
        return LINEAR_KEYS
    return tuple(CURVE_KEYS) if form.curved_backlash is not None else BORDER_KEYS


def _block_dict(name: str, block: Rational, unknown_names: tuple[str, ...]) -> dict[str, Any]:
    if any(owns(name, other) for other in unknown_names):
        return orders_dict(name, block, unknown_names)
    return {"num": list(block.num), "den": list(block.den), "dead_time": exact(block.dead_time_s, "s")}


def _f_dict(f: NonlinearF | LinearF) -> dict[str, Any]:
    if isinstance(f, LinearF):
        return {"linear": {"gain": f.gain, "offset": exact(f.offset_v, "V")}}
    if isinstance(f, CurvedBacklash):
        curves = {"L": f.loading, "U": f.unloading}
        return {"curved_backlash": {s: [[exact(v, "V"), exact(w, "V")] for v, w in c] for s, c in curves.items()}}
    if f.tied:
        return {"backlash": {"S": f.s_l, "D_L": exact(f.d_l_v, "V"), "D_U": exact(f.d_u_v, "V")}}
    return {"backlash": {"S_L": f.s_l, "D_L": exact(f.d_l_v, "V"), "S_U": f.s_u, "D_U": exact(f.d_u_v, "V")}}
