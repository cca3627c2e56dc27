"""What do the READMEs say of the catalogue? ``python -m tests.architecture.effect_table`` prints it."""

from typing import Any

from identify.effects import catalogue
from identify.readings import blemishes
from identify.stage import Place

BEGIN, END = "<!-- effects: begin -->", "<!-- effects: end -->"
NAMED = "<!-- named: begin -->", "<!-- named: end -->"


def known() -> list[Any]:
    """Return everything that has a name, by id."""
    return list(dict(sorted({**blemishes(), **catalogue()}.items())).values())


def table() -> str:
    """Return the catalogue as a Markdown table, generated from the classes."""
    rows = ["| id | stage | what | parameters | fingerprint |", "|---|---|---|---|---|"]
    for effect in known():
        places = " or ".join(place.label for place in effect.places)
        parameters = ", ".join(f"{p.name.rpartition('.')[2]} [{p.unit}]" for p in effect.declared if not p.local)
        rows.append(f"| `{effect.id}` | {places} | {effect.title} | {parameters} | {effect.fingerprint} |")
    return "\n".join(rows)


def summary() -> str:
    """Return what can be named at each stage, a line a stage."""
    return "\n".join(f"- **{place.label}**: {', '.join(_titles(place))}" for place in Place)


def _titles(place: Place) -> list[str]:
    """Return what may be missing at a stage, the physics that may sit there first of all included."""
    return sorted(effect.title for effect in known() if place in effect.places)


if __name__ == "__main__":
    print(table(), summary(), sep="\n\n")
