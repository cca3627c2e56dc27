"""What does the heading of a column say: ``u [mV]``, ``Time (ms)``, ``t/s`` - its name, and the unit of its numbers?"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from rig.units import is_unit

BRACKETED = re.compile(r"(?P<name>[^\[\]]*?)\s*\[\s*(?P<unit>[^\[\]]*?)\s*\]")
IN_PARENTHESES = re.compile(r"(?P<name>[^()]*?)\s*\(\s*(?P<unit>[^()]*?)\s*\)")
AFTER_SLASH = re.compile(r"(?P<name>.*\S)\s*/\s*(?P<unit>[kmµun]?V|[mµun]?s)")
QUOTED_UNIT = re.compile(r"\[(?P<square>[^\[\]]*)\]|\((?P<round>[^()]*)\)|(?P<bare>[^\[\]()]*)")
SPELT = {"volt": "V", "volts": "V", "second": "s", "seconds": "s", "sec": "s", "millivolt": "mV", "millivolts": "mV"}


@dataclass(frozen=True)
class Heading:
    """A heading as it stands in the file, the name in it, and the unit it gives, empty where it gives none."""

    text: str
    name: str = ""
    unit: str = ""


def read_heading(text: str) -> Heading:
    """Return what a heading says.

    What stands in square brackets is a unit, known or not; in parentheses, and after a slash, only a unit known.
    """
    if found := BRACKETED.fullmatch(text):
        return Heading(text, found["name"], SPELT.get(found["unit"].lower(), found["unit"]))
    if (found := IN_PARENTHESES.fullmatch(text)) and (unit := known_unit(found["unit"])):
        return Heading(text, found["name"], unit)
    if found := AFTER_SLASH.fullmatch(text):
        return Heading(text, found["name"], found["unit"])
    return Heading(text, text)


def with_units(headings: Sequence[Heading], row: Sequence[str]) -> tuple[Heading, ...] | None:
    """Return the headings with the units of the row below them; None when that row holds anything but units."""
    units = [known_unit(_bare(cell)) for cell in row]
    if not any(units) or any(bool(cell) != bool(unit) for cell, unit in zip(row, units, strict=True)):
        return None
    return tuple(replace(heading, unit=unit or heading.unit) for heading, unit in zip(headings, units, strict=True))


def known_unit(text: str) -> str:
    """Return the unit that ``text`` spells; empty when it is none."""
    unit = SPELT.get(text.lower(), text)
    return unit if is_unit(unit) else ""


def _bare(cell: str) -> str:
    """Return a cell without the brackets around it."""
    found = QUOTED_UNIT.fullmatch(cell)
    return next((part.strip() for part in found.groups() if part is not None), "") if found else cell
