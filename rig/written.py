"""How may a quantity be written, told twice: to the validator as a function, to an editor as a JSON Schema?

Both stand in one annotation, ``In("V")``, so that a form cannot say one thing and its schema another. The schema knows
the grammar, the sign and the common units; any other unit it takes, as only the program can tell it from a misspelling.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from rig.errors import MisfitError
from rig.units import COMMON, NUMBER, UNIT, example, factor, is_bare, kind_of, multiple, quantity

NOT_NEGATIVE = r"(?!-)"
ABOVE_0 = r"(?!-)(?=\+?[0.]*[1-9])"
TIMES = r"(?:\d{1,15}\s*[x\u00d7]\s*)?"


@dataclass(frozen=True)
class In:
    """A quantity in a unit, or a ``whole`` multiple of one such as ``628 x 0.01 rad/s``, as a float in that unit."""

    unit: str
    whole: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Return what validates: the text becomes a float before the float is held against its bounds."""
        read: Callable[[Any], float] = partial(multiple if self.whole else quantity, unit=self.unit)
        return core_schema.no_info_before_validator_function(read, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return what an editor is told."""
        bounds = handler(schema)
        sign = ABOVE_0 if bounds.get("gt", bounds.get("exclusiveMinimum")) == 0 else ""
        sign = NOT_NEGATIVE if bounds.get("ge", bounds.get("minimum")) == 0 else sign
        return as_written(self.unit, sign, self.whole)


def as_written(unit: str, sign: str = "", whole: bool = False) -> dict[str, Any]:
    """Return the JSON Schema of a quantity in ``unit``, or of a whole multiple of one."""
    told = f"{kind_of(unit)}, as in '{example(unit)}'"
    text = {"type": "string", "pattern": _pattern(unit, sign, TIMES if whole else ""), "description": told}
    if not is_bare(unit):
        return text
    least = {ABOVE_0: {"exclusiveMinimum": 0}, NOT_NEGATIVE: {"minimum": 0}}.get(sign, {})
    return {"anyOf": [{"type": "number", **least}, text], "description": told}


def _pattern(unit: str, sign: str, times: str) -> str:
    """Return the expression of a number and a unit, those that are known to be of another dimension left out."""
    others = "|".join(_others(unit))
    named = rf"(?!(?:{others})\s*$){UNIT}" if others else UNIT
    return rf"^\s*{times}{sign}{NUMBER}\s*{f'(?:{named})?' if is_bare(unit) else named}\s*$"


@cache
def _others(unit: str) -> tuple[str, ...]:
    """Return the common units that no quantity in ``unit`` has, as expressions."""
    return tuple(other for other in COMMON if not _fits(other, unit))


def _fits(other: str, unit: str) -> bool:
    try:
        return bool(factor(other, unit))
    except MisfitError:
        return False
