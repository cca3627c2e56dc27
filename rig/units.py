"""What does `200 ms` mean: text with a unit to a float in the unit the program works in.

Pint does the conversion and is imported on first use; each pair of units is worked out once. Only plain products and
quotients of units pass the grammar, so no text reaches pint's expression parser.
"""

import math
import re
from functools import cache
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rig.errors import MisfitError, cut_short, nearest

Number = TypeVar("Number", float, NDArray[np.float64])

NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_ATOM = r"(?:[A-Za-zµμΩ°%]+(?:\^-?\d)?)"
UNIT = rf"(?:1/)?{_ATOM}(?:[*/·]{_ATOM})*"
_QUANTITY = re.compile(rf"\s*(?P<number>{NUMBER})\s*(?P<unit>(?:{UNIT})?)\s*", re.ASCII)
_UNIT = re.compile(UNIT)
_MULTIPLE = re.compile(r"\s*(?P<count>\d{1,15})\s*[x\u00d7]\s*(?P<quantity>.+)", re.ASCII)
_LONGEST = 100
"""Characters of a quantity."""
COMMON = (
    "V", "mV", "µV", "kV", "Hz", "mHz", "kHz", "MHz", "s", "ms", "µs", "us", "ns", "min", "h", "V/s", "V/ms", "V/µs",
    "kV/s", "rad/s", "rad", "deg", "V/V", "1/s", "ppm", "percent",
)
_KINDS = {
    "V": "a voltage", "s": "a time", "Hz": "a frequency", "V/s": "a slew rate", "rad": "an angle",
    "rad/s": "an angular rate",
}


def quantity(value: object, unit: str) -> float:
    """Return ``value`` (such as ``"200 ms"``) as a finite float in ``unit``; raise MisfitError.

    A bare number is accepted only where ``unit`` has no dimension. Between Hz and rad/s the factor 2 pi is applied.
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise MisfitError(f"{kind_of(unit)} is needed", value=repr(value), do=f"write as '{example(unit)}'")
    if not isinstance(value, str):
        return _finite(_bare(float(value), unit), str(value))
    found = _QUANTITY.fullmatch(value) if len(value) <= _LONGEST else None
    if found is None:
        raise MisfitError(f"not {kind_of(unit)} with a unit", value=cut_short(repr(value)),
                          do=f"write as '{example(unit)}'")
    number = float(found["number"])
    return _finite(scaled(number, factor(found["unit"], unit)) if found["unit"] else _bare(number, unit), value)


def multiple(value: object, unit: str) -> float:
    """Return a quantity or a whole multiple of one, such as ``"640 x 0.01 rad/s"``, as a float in ``unit``."""
    found = _MULTIPLE.fullmatch(value) if isinstance(value, str) else None
    return int(found["count"]) * quantity(found["quantity"], unit) if found else quantity(value, unit)


def show(value: float, unit: str) -> str:
    """Return ``value`` with its unit for a message, to six digits."""
    return f"{value:.6g} {unit}".rstrip()


def exact(value: float, unit: str) -> str:
    """Return ``value`` with its unit so that ``quantity`` reads back the same float."""
    return f"{float(value)!r} {unit}".rstrip()


@cache
def is_unit(text: str) -> bool:
    """Return whether ``text`` is a unit by itself, such as ``mV``."""
    try:
        return len(text) <= _LONGEST and bool(_UNIT.fullmatch(text)) and _pint(text) is not None
    except MisfitError:
        return False


@cache
def factor(source: str, target: str) -> float:
    """Return how many ``target`` one ``source`` is; raise MisfitError for an unknown unit or another dimension."""
    if len(source) > _LONGEST or not _UNIT.fullmatch(source):
        raise MisfitError(f"unknown unit {cut_short(repr(source))}", do="units look like V, ms, kHz")
    one, two = _scale(source, target), _scale(source, target, 2.0)
    if not math.isclose(two, 2.0 * one, rel_tol=1e-12):
        raise MisfitError("a logarithmic or offset unit", value=source, do=f"write as '{example(target)}'")
    if "hertz" in _names(target) and "radian" in _names(source, root=True):
        return one / (2.0 * math.pi)
    if "hertz" in _names(source) and "radian" in _names(target, root=True):
        return one * 2.0 * math.pi
    return one


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(cache_folder=None)


def _pint(unit: str) -> Any:
    """Return pint's unit; an empty unit is dimensionless; raise MisfitError when unknown."""
    import pint

    text = unit.replace("·", "*").replace("%", "percent").replace("°", "degree").replace("1/", "dimensionless/")
    try:
        return _registry().Unit(text or "dimensionless")
    except (pint.PintError, AttributeError, ValueError) as error:
        close = nearest(unit, COMMON)
        advice = f"did you mean {close!r}?" if close else "units look like V, ms, kHz"
        raise MisfitError(f"unknown unit {unit!r}", do=advice) from error


def _scale(source: str, target: str, number: float = 1.0) -> float:
    import pint

    try:
        return float(_registry().Quantity(number, _pint(source)).to(_pint(target)).magnitude)
    except pint.DimensionalityError as error:
        raise MisfitError(f"wrong unit {source!r}", allowed=f"{kind_of(target)}, as in '{example(target)}'") from error


def _names(unit: str, root: bool = False) -> str:
    pinted = _pint(unit)
    return str(_registry().Quantity(1.0, pinted).to_root_units().units if root else pinted)


def is_bare(unit: str) -> bool:
    """Return whether a quantity in ``unit`` may be a number alone."""
    return bool(_pint(unit).dimensionless) and unit not in {"rad", "deg"}


def _bare(number: float, unit: str) -> float:
    if is_bare(unit):
        return number
    do = f"write '{number:g} {unit}'"
    raise MisfitError("a number without a unit", value=f"{number:g}", allowed=kind_of(unit), do=do)


def scaled(number: Number, by: float) -> Number:
    """Return number * by; a submultiple divides, so that 100 us is the float 1e-4 and not its neighbour."""
    parts = round(1.0 / by) if 0 < by < 1 else 0
    return number / parts if parts and math.isclose(parts * by, 1.0, rel_tol=1e-12) else number * by


def _finite(number: float, text: str) -> float:
    if math.isfinite(number):
        return number
    raise MisfitError("not a finite number", value=text)


def kind_of(unit: str) -> str:
    """Return what a quantity in ``unit`` is called in a message."""
    return _KINDS.get(unit, f"a quantity in {unit}" if unit else "a number")


def example(unit: str) -> str:
    """Return how a quantity in ``unit`` may be written."""
    return {"s": "200 ms", "Hz": "50 Hz", "V": "3 V", "rad": "90 deg"}.get(unit, f"3 {unit}".rstrip())
