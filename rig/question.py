"""What was asked, of which recordings, and of which program - so exactly that it can be asked again?

Every answer in JSON says so under ``made_from``: recordings by path and SHA-256, the text of a rig file or calibration
that was named, the options, and what computed it. ``rig verify`` asks again, ``rig batch`` does not ask twice.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, Self

from pydantic import Field

from rig.errors import FileError
from rig.forms import Form
from rig.provenance import PLACE, program
from rig.yamlfile import Document, read_text

Job = Literal["identify", "explain"]
KEY = "made_from"


@dataclass(frozen=True)
class Source:
    """A recording as it was when it was asked: where it lay, and the SHA-256 of all its bytes."""

    path: Path
    sha256: str

    @classmethod
    def of(cls, path: Path) -> Self:
        """Return the recording at ``path`` as it is now; raise FileError."""
        if not path.is_file():
            raise FileError("no such recording" if not path.exists() else "not a file", where=str(path))
        try:
            with path.open("rb") as file:
                return cls(path, hashlib.file_digest(file, "sha256").hexdigest())
        except OSError as error:
            raise FileError("cannot be read", where=str(path), value=error.strerror) from error


@dataclass(frozen=True)
class Named:
    """A file that was named beside the recordings: what it was called, and its text."""

    name: str
    text: str

    @classmethod
    def of(cls, path: str | Path | None) -> Self | None:
        """Return the text file at ``path``, None where none is named; raise FileError."""
        return None if path is None else cls(str(path), read_text(Path(path)))


@dataclass(frozen=True)
class Question:
    """What is asked of recordings; where no ``rig`` or ``calibration`` is named, they carry their own.

    ``borders`` and ``knots`` are those of ``rig identify``.
    """

    job: Job
    recordings: tuple[Source, ...] = ()
    held_out: tuple[Source, ...] = ()
    rig: Named | None = None
    calibration: Named | None = None
    borders: Literal["straight", "curved"] | None = None
    knots: int | None = None

    def of(self, recordings: Sequence[Path], held_out: Sequence[Path] = ()) -> Self:
        """Return the same question about the recordings as they are now; raise FileError."""
        here, kept_back = (tuple(Source.of(path) for path in paths) for paths in (recordings, held_out))
        return replace(self, recordings=here, held_out=kept_back)

    def told(self) -> dict[str, object]:
        """Return what an answer says it was made from, as the key it says it under."""
        return {KEY: self.to_dict()}

    def to_dict(self) -> dict[str, object]:
        """Return what an answer that this program computed says under ``made_from``."""
        sources = {
            key: [{"path": str(source.path.absolute()), "sha256": source.sha256} for source in sources]
            for key, sources in (("recordings", self.recordings), ("held_out", self.held_out))
        }
        named = {
            key: file and {"name": file.name, "text": file.text}
            for key, file in (("rig", self.rig), ("calibration", self.calibration))
        }
        return {
            "job": self.job, **sources, **named, "borders": self.borders, "knots": self.knots,
            "program": program(),
        }  # fmt: skip


class SourceForm(Form):
    """A recording."""

    path: str
    sha256: str = Field(pattern="^[0-9a-f]{64}$")

    def source(self) -> Source:
        """Return it as the program has it."""
        return Source(Path(self.path), self.sha256)


class NamedForm(Form):
    """A file beside the recordings."""

    name: str
    text: str

    def named(self) -> Named:
        """Return it as the program has it."""
        return Named(self.name, self.text)


class QuestionForm(Form):
    """What stands under ``made_from``."""

    job: Job
    recordings: list[SourceForm] = Field(min_length=1)
    held_out: list[SourceForm]
    rig: NamedForm | None
    calibration: NamedForm | None
    borders: Literal["straight", "curved"] | None
    knots: int | None = Field(ge=3, le=60)
    program: dict[str, str]


@dataclass(frozen=True)
class Asked:
    """A question that was answered, and the program that did."""

    question: Question
    program: Mapping[str, str]

    @property
    def versions(self) -> dict[str, str]:
        """Return what the numbers depend on, wherever they are computed: versions and source, not the machine."""
        return versions(self.program)


def versions(of: Mapping[str, str]) -> dict[str, str]:
    """Return the part of a program that is the same on every machine that has it."""
    return {key: value for key, value in of.items() if key not in PLACE}


def asked(document: Document) -> Asked:
    """Return what the answer in ``document`` was made from; raise FileError."""
    if not isinstance(document.data, dict) or KEY not in document.data:
        raise FileError("does not say what it was made from", where=document.where, value=f"no {KEY!r} in it",
                        do="make the answer again")  # fmt: skip
    form = QuestionForm.read(document, KEY)
    question = Question(
        form.job, tuple(s.source() for s in form.recordings), tuple(s.source() for s in form.held_out),
        form.rig.named() if form.rig else None, form.calibration.named() if form.calibration else None,
        form.borders, form.knots,
    )  # fmt: skip
    return Asked(question, form.program)
