"""How is a YAML mapping held against its form, so that a refusal names file, line and key?"""

from typing import Annotated, Any, Self

from pydantic import BaseModel, ConfigDict, Discriminator, Field, ValidationError, model_validator

from rig.errors import FileError, MisfitError, unknown
from rig.written import In
from rig.yamlfile import Document, Keys

Volts = Annotated[float, In("V")]
Seconds = Annotated[float, In("s"), Field(ge=0)]
PositiveSeconds = Annotated[float, In("s"), Field(gt=0)]
Hertz = Annotated[float, In("Hz"), Field(gt=0)]
Rate = Annotated[float, In("Hz", whole=True), Field(gt=0)]
VoltsPerSecond = Annotated[float, In("V/s"), Field(gt=0)]
Radians = Annotated[float, In("rad")]
Gain = Annotated[float, In("V/V")]
Fraction = Annotated[float, In(""), Field(gt=0, lt=0.5)]


def either(*ways: tuple[str, ...]) -> dict[str, Any]:
    """Return the JSON Schema of a mapping that has all keys of one of these ways, and none of another."""
    every = {key for way in ways for key in way}
    return {"oneOf": [{"required": list(way), "properties": dict.fromkeys(sorted(every - set(way)), False)}
                      for way in ways]}


def shape_of(value: object) -> str:
    """Return the tag of a value: ``mapping`` or ``plain``."""
    return "mapping" if isinstance(value, dict | BaseModel) else "plain"


BY_SHAPE = Discriminator(shape_of)
"""Tells the two members of a union apart, ``Tag("mapping")`` and ``Tag("plain")``, so that one of them reports."""


class UnknownKeyError(MisfitError):
    """A key the form does not have; ``key`` leads to its line."""

    def __init__(self, key: str, valid: list[str]) -> None:
        """Propose the valid key nearest to ``key``."""
        self.key = key
        super().__init__(**unknown("key", key, valid))


class Form(BaseModel):
    """A mapping with known keys; every other key is refused with the nearest valid one."""

    model_config = ConfigDict(frozen=True, strict=True, extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: Any) -> Any:
        valid = cls.keys()
        if not isinstance(data, dict):
            raise MisfitError("a mapping is needed", value=_shown(data), allowed=f"the keys {', '.join(valid)}")
        for key in data:
            if key not in valid:
                raise UnknownKeyError(key, valid)
        return data

    @classmethod
    def keys(cls) -> list[str]:
        """Return the keys as they stand in the file."""
        return [info.alias or name for name, info in cls.model_fields.items()]

    @classmethod
    def read(cls, document: Document, *keys: str | int) -> Self:
        """Return the mapping at ``keys`` of ``document`` in this form; raise FileError for the first thing wrong."""
        node: Any = document.data
        for key in keys:
            node = node[key]
        return cls.of(document, keys, node)

    @classmethod
    def of(cls, document: Document, keys: Keys, node: object) -> Self:
        """Return ``node``, which stands at ``keys`` or is a part of what does; raise FileError with line and key."""
        try:
            return cls.model_validate(node)
        except ValidationError as error:
            problems = error.errors(include_url=False)
            raise _placed(document, keys, min(problems, key=_urgency)) from error


def _urgency(problem: Any) -> int:
    """Put unknown keys before what they cause: a misspelt key is also a missing one."""
    return 0 if isinstance(_cause(problem), UnknownKeyError) else 1


def _cause(problem: Any) -> object:
    return problem.get("ctx", {}).get("error")


def _placed(document: Document, keys: Keys, problem: Any) -> FileError:
    cause, path = _cause(problem), _path(document, keys, problem)
    if isinstance(cause, UnknownKeyError):
        return cause.placed(document.at(*path, cause.key))
    if isinstance(cause, MisfitError):
        return cause.placed(document.at(*path))
    if problem["type"] == "missing":
        return FileError(f"the key {path[-1]!r} is missing", where=document.at(*path[:-1]), do=f"add '{path[-1]}:'")
    what = problem["msg"].replace("Input should be", "must be").replace("Value error, ", "")
    return FileError(what, where=document.at(*path), value=_shown(problem["input"]))


def _path(document: Document, keys: Keys, problem: Any) -> Keys:
    """Return the key path of a problem as the file has it: without the tags of unions, with a key that is missing."""
    node: Any = document.data
    path: list[str | int] = []
    for part in (*keys, *problem["loc"]):
        if (isinstance(node, dict) and part in node) or (isinstance(node, list) and isinstance(part, int)):
            node = node[part]
            path.append(part)
    return (*path, problem["loc"][-1]) if problem["type"] == "missing" else tuple(path)


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
