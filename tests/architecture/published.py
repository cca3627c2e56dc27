"""Writes what is published of the forms: the JSON Schemas, the comments that name them, and the page of the gallery.

``python -m tests.architecture.published`` after a form or a protocol has changed.
"""

from collections.abc import Iterator
from pathlib import Path

from rig.gallery import gallery
from rig.narration import span
from rig.references import packaged
from rig.schemas import SCHEMAS, published, schema_text, with_modeline

GALLERY = packaged() / "GALLERY.md"
HEAD = """\
# The gallery

Protocols to be played as they are, or copied and changed: `rig protocols` lists them, `rig protocols NAME --out F.yaml`
makes a copy, `rig new F.yaml` asks a few questions and writes one for your own rig. Each opens with its question and
with why it is as it is. (Made by `python -m tests.architecture.published`.)
"""


def described() -> Iterator[tuple[str, Path]]:
    """Yield every file that comes with the program and the kind of its schema."""
    yield from (("protocol", path) for path in sorted(packaged().glob("*.yaml")))
    yield from (("rig", path) for path in sorted((packaged() / "rigs").glob("*.yaml")))


def page() -> str:
    """Return the page of the gallery."""
    rows = [f"| [`{p.name}`]({p.name}.yaml) | {p.question} | {span(p.time_s)} |" for p in gallery()]
    return "\n".join([HEAD, "| protocol | the question it answers | time |", "|---|---|---|", *rows, ""])


def main() -> None:
    """Write all of it."""
    for kind in SCHEMAS:
        published(kind).write_text(schema_text(kind), encoding="utf-8")
    for kind, path in described():
        path.write_text(with_modeline(path.read_text(encoding="utf-8"), kind, path.parent), encoding="utf-8")
    GALLERY.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
