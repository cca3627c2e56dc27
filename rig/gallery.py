"""Which protocols come with the program, and which question does each of them answer?"""

from dataclasses import dataclass
from pathlib import Path

from rig.errors import FileError, UsageError, unknown
from rig.outputs import check_destination, write_text
from rig.plan import plan
from rig.protocol import read_protocol
from rig.references import packaged
from rig.schemas import with_modeline

SCHEMA = "rig.protocols/1"


@dataclass(frozen=True)
class Piece:
    """One protocol of the gallery: its name without suffix, and what it asks, of which rig, in which time."""

    name: str
    title: str
    question: str
    rig: str
    time_s: float
    steps: tuple[str, ...]

    @property
    def path(self) -> str:
        """Return how a command names it, wherever it is typed."""
        return f"protocols/{self.name}.yaml"

    def to_dict(self) -> dict[str, object]:
        """Return this as it stands in the JSON of ``rig protocols``."""
        return {
            "protocol": self.path, "title": self.title, "question": self.question, "rig": self.rig,
            "time_s": self.time_s, "steps": list(self.steps),
        }  # fmt: skip


def gallery() -> tuple[Piece, ...]:
    """Return all protocols that come with the program, by name."""
    return tuple(_piece(path) for path in sorted(packaged().glob("*.yaml")))


def to_dict(found: tuple[Piece, ...]) -> dict[str, object]:
    """Return the JSON of ``rig protocols``."""
    return {"schema": SCHEMA, "protocols": [piece.to_dict() for piece in found]}


def text_of(name: str) -> str:
    """Return the text of a protocol that comes with the program; raise UsageError for a name there is not."""
    stem = Path(name).stem
    found = {path.stem: path for path in packaged().glob("*.yaml")}
    if stem not in found:
        parts = unknown("protocol", stem, list(found))
        raise UsageError(parts["what"], allowed=parts["allowed"], do=parts.get("do"))
    return found[stem].read_text(encoding="utf-8")


def copy(name: str, out: Path, overwrite: bool = False) -> None:
    """Put a protocol that comes with the program at ``out``, for an operator to change; raise UsageError, FileError."""
    text = text_of(name)
    check_destination(out)
    if out.exists() and not overwrite:
        raise FileError("there is a file of this name already", where=str(out), do="choose another name or --overwrite")
    write_text(out, with_modeline(text, "protocol", out.resolve().parent))


def _piece(path: Path) -> Piece:
    protocol = read_protocol(path)
    rig = protocol.rig.model.title if protocol.rig else ""
    steps = tuple(dict.fromkeys(step.label for step in protocol.steps))
    return Piece(path.stem, protocol.title, protocol.question, rig, plan(protocol).duration_s, steps)
