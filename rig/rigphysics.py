"""What physics does a rig file name, where is it, and with which values?

Each piece stands under its id; the same law at a second place under ``id@stage``.
"""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any

from identify.model import Physics
from rig.errors import FileError, MisfitError, unknown
from rig.units import exact, quantity
from rig.yamlfile import Document, Keys

if TYPE_CHECKING:
    from identify.effects.effect import Effect

Values = Mapping[str, Any]

PHYSICS_KEYS = ("stage", "form")
APART = "@"  # between an id and its stage


def physics_of(document: Document, keys: Keys, pieces: Mapping[str, Values]) -> tuple[Physics, ...]:
    """Return the physics that a rig file names, by its ids or ``id@stage``; FileError for what is not known or twice.
    """
    found: dict[tuple[str, str], Physics] = {}
    for name, values in pieces.items():
        piece = _piece(document, (*keys, name), name, values)
        place = _whereabouts(piece)
        if place in found:
            raise document.error(f"{place[0]} at {place[1]} twice", *keys, name, do="put all of it into one")
        found[place] = piece
    return tuple(found.values())


def _piece(document: Document, keys: Keys, written: str, values: Values) -> Physics:
    """Return one piece of physics; its values are read in the units its effect declares, those not given are absent."""
    name, apart, place = written.partition(APART)
    if apart and values.get("stage", place) != place:
        stage = str(values["stage"])
        raise document.error(f"{written} with another stage", *keys, "stage", value=stage, allowed=place)
    stage, form = _stage_and_form(document, keys, name, {**values, "stage": place} if apart else values)
    given = {key: value for key, value in values.items() if key not in PHYSICS_KEYS}
    units = parameter_units(Physics(name, given, stage, form))
    for key in given:
        if key.partition("[")[0] not in units:
            raise FileError(where=document.at(*keys, key), **unknown("parameter", key, [*units, *PHYSICS_KEYS]))
    if not given:
        raise document.error("physics without values", *keys, allowed=", ".join(units))
    read = {key: _value(document, (*keys, key), value, units[key.partition("[")[0]]) for key, value in given.items()}
    return _whole(document, keys, Physics(name, read, stage, form))


def _stage_and_form(document: Document, keys: Keys, name: str, values: Values) -> tuple[str, str]:
    """Return where a piece of physics is and in which form, empty where the file does not say."""
    from identify.effects import choices
    from identify.unnamed.stored import is_unnamed

    if name not in catalogue() and not is_unnamed(name):
        raise FileError(where=document.at(*keys), **unknown("physics", name, [*catalogue(), "unnamed"]))
    form = _choice(document, keys, values, "form", list(choices(name).forms))
    return _choice(document, keys, values, "stage", list(choices(name, form).stages)), form


def _whole(document: Document, keys: Keys, piece: Physics) -> Physics:
    """Return a piece of physics; raise FileError for an unnamed one that its knots do not make whole."""
    from identify.unnamed.stored import correction_of, is_unnamed

    try:
        if is_unnamed(piece.id):
            correction_of(piece)
    except ValueError as error:
        raise document.error(str(error), *keys) from error
    return piece


def _choice(document: Document, keys: Keys, values: Values, key: str, valid: list[str]) -> str:
    """Return the word at ``key``, empty when there is none; raise FileError for one that is not ``valid``."""
    word = values.get(key)
    if word is None:
        return ""
    if word not in valid:
        raise FileError(where=document.at(*keys, key), **unknown(key, str(word), valid))
    return str(word)


def _value(document: Document, keys: Keys, value: object, unit: str) -> float:
    try:
        return quantity(value, unit)
    except MisfitError as error:
        raise error.placed(document.at(*keys)) from error


def catalogue() -> "dict[str, type[Effect]]":
    """Return the effects that rig files may name; imported on first use, since most rig files name none."""
    from identify import effects

    return effects.catalogue()


def _whereabouts(piece: Physics) -> tuple[str, str]:
    """Return what a piece of physics is and at which stage, the first it may be at where the file does not say."""
    from identify.effects import whereabouts

    return whereabouts(piece)


def parameter_units(piece: Physics) -> dict[str, str]:
    """Return the SI unit of every value ``piece`` may have at its stage in its form, by its short name."""
    from identify.effects import units_of

    return units_of(piece)


def physics_dict(physics: Sequence[Physics]) -> dict[str, dict[str, str]]:
    """Return pieces of physics as ``physics_of`` reads them."""
    return {owner: _piece_dict(piece) for owner, piece in owned(physics).items()}


def owned(physics: Sequence[Physics]) -> dict[str, Physics]:
    """Return every piece of physics by the name under which a rig file has it."""
    if not physics:
        return {}
    from identify.effects import owners

    return dict(zip(owners(physics), physics, strict=True))


def _piece_dict(piece: Physics) -> dict[str, str]:
    """Return the values of ``piece`` with their units; infinite ones are absent and left out."""
    units = parameter_units(piece)
    where = {"stage": piece.stage, "form": piece.form}
    values = {key: exact(value, units[key.partition("[")[0]]) for key, value in piece.values.items() if isfinite(value)}
    return {key: word for key, word in where.items() if word} | values
