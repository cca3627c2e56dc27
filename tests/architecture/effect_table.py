"""What does the README say of the catalogue? ``python -m tests.architecture.effect_table`` prints the table."""

from identify.effects import catalogue
from identify.readings import blemishes

BEGIN, END = "<!-- effects: begin -->", "<!-- effects: end -->"


def table() -> str:
    """Return the catalogue as a Markdown table, generated from the classes."""
    rows = ["| id | stage | what | parameters | fingerprint |", "|---|---|---|---|---|"]
    for effect in dict(sorted({**blemishes(), **catalogue()}.items())).values():
        places = " or ".join(place.label for place in effect.places)
        parameters = ", ".join(f"{p.name.rpartition('.')[2]} [{p.unit}]" for p in effect.declared if not p.local)
        rows.append(f"| `{effect.id}` | {places} | {effect.title} | {parameters} | {effect.fingerprint} |")
    return "\n".join(rows)


if __name__ == "__main__":
    print(table())
