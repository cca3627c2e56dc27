"""Which recordings are in a folder: what, when, from which device, whole or not, and what is known of each?

Every recording is read whole, so that a damaged one is told as such and never listed as if it were fine.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from rig.answers_beside import Answer, Answers
from rig.errors import FileError, RigError
from rig.question import Source
from rig.recorded import Entry, Recording
from rig.recording import read

SCHEMA = "rig.list/1"
ENDINGS = (".h5", ".hdf5")
Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class Facts:
    """What is listed of a recording that can be read."""

    title: str
    started: str
    device: str
    rate_hz: float
    samples: int
    lost: int
    complete: bool
    reason: str

    @classmethod
    def of(cls, recording: Recording) -> "Facts":
        """Return the facts about a recording."""
        equipment = recording.origin.equipment
        device = " ".join(part for part in (equipment.model, equipment.serial) if part) or equipment.address
        return cls(
            recording.title, recording.origin.started, device, recording.rate_hz, recording.u.size,
            recording.u.size - recording.count(Entry.RECORDED), recording.complete, recording.reason,
        )  # fmt: skip

    @property
    def length_s(self) -> float:
        """Return how long the run is, s."""
        return self.samples / self.rate_hz

    def to_dict(self) -> dict[str, object]:
        """Return the form of ``rig list --json``."""
        return {
            "title": self.title, "started": self.started or None, "device": self.device, "rate_hz": self.rate_hz,
            "samples": self.samples, "length_s": self.length_s, "not_recorded": self.lost, "complete": self.complete,
            "reason": self.reason or None,
        }  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One file: its facts, or why it cannot be read; the answers about it, and those about what it held before."""

    path: Path
    facts: Facts | None
    problem: str = ""
    answers: tuple[Answer, ...] = ()
    outdated: tuple[Answer, ...] = ()

    def to_dict(self) -> dict[str, object]:
        """Return the form of ``rig list --json``."""
        told = self.facts.to_dict() if self.facts else {}
        return {
            "path": str(self.path), **told, "problem": self.problem or None,
            "answers": [answer.to_dict() for answer in self.answers],
            "outdated_answers": [answer.to_dict() for answer in self.outdated],
        }  # fmt: skip


@dataclass(frozen=True)
class Listing:
    """The recordings of a folder and of the folders in it, the earliest first; what cannot be read stands last."""

    folder: Path
    rows: tuple[Row, ...]

    def to_dict(self) -> dict[str, object]:
        """Return the answer of ``rig list --json``."""
        return {"schema": SCHEMA, "folder": str(self.folder), "recordings": [row.to_dict() for row in self.rows]}


def listed(folder: str | Path, progress: Progress | None = None) -> Listing:
    """Return what is in a folder; raise FileError when there is none."""
    folder = Path(folder)
    if not folder.is_dir():
        raise FileError("no such folder" if not folder.exists() else "not a folder", where=str(folder))
    answers = Answers.among(sorted(_files(folder, (".json",))))
    paths = sorted(_files(folder, ENDINGS))
    rows = []
    for number, path in enumerate(paths):
        if progress:
            progress(path.name, number / len(paths))
        rows.append(_row(path, answers))
    return Listing(folder, tuple(sorted(rows, key=_earliest_first)))


def _files(folder: Path, endings: tuple[str, ...]) -> Iterator[Path]:
    """Yield the files with one of the endings, in folders of the folder, too."""
    return (path for path in folder.rglob("*") if path.suffix.lower() in endings and path.is_file())


def _row(path: Path, answers: Answers) -> Row:
    """Return what is listed of one file."""
    try:
        facts = Facts.of(read(path))
        sha256 = Source.of(path).sha256 if answers else ""
    except RigError as error:
        return Row(path, None, str(error))
    return Row(path, facts, "", answers.by_content.get(sha256, ()), answers.outdated(path, sha256))


def _earliest_first(row: Row) -> tuple[bool, str, str]:
    return row.facts is None, row.facts.started if row.facts else "", str(row.path)
