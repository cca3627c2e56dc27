"""How do many recordings become one answer each, none of them twice, whatever happens on the way?

An answer stands in a file of its own, written in one move, and says what it was made from. A recording is left out
when the answer that stands there was made from the same bytes, by the same question and the same program; so a batch
that was stopped goes on where it was, and a recording that changed is done again.
"""

import glob
import os
from collections import Counter
from collections.abc import Callable, Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, field, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from rig.errors import FileError, UsageError
from rig.outputs import make_folder, write_text
from rig.provenance import program
from rig.question import Asked, Question, asked, versions
from rig.reanalysis import FAILURE
from rig.work import Order, Outcome
from rig.yamlfile import parse_json, read_text

Spread = Callable[[Sequence[Order]], Generator[Outcome]]
"""Does orders somewhere: `crew.outcomes` or `cluster.outcomes`."""


@dataclass(frozen=True)
class Piece:
    """A recording, where its answer goes, and why it is to be done.

    ``known`` is the SHA-256 of what the answer there was made from, where only that is left to compare; ``failure`` is
    its message where it is none. ``refused`` says why nothing may be put there.
    """

    recording: Path
    result: Path
    reason: str
    known: str | None = None
    failure: str = ""
    refused: str = ""


@dataclass(frozen=True)
class Batch:
    """What there is to do: the question, the recordings, and the folder of the answers."""

    question: Question
    folder: Path
    pieces: tuple[Piece, ...]


@dataclass(frozen=True)
class State:
    """How far a batch is.

    ``answered`` were answered now, ``unchanged`` before; ``reasons`` counts what was ``worked`` on, answered or failed,
    by why; ``new`` are those left of which no answer of this question and program stands. ``seconds`` have passed.
    """

    total: int
    answered: int = 0
    unchanged: int = 0
    worked: int = 0
    new: int = 0
    failures: tuple[tuple[Path, str], ...] = ()
    reasons: Counter[str] = field(default_factory=Counter)
    seconds: float = 0.0

    @property
    def done(self) -> int:
        """Return how many recordings are dealt with."""
        return self.answered + self.unchanged + len(self.failures)

    @property
    def left_s(self) -> float | None:
        """Return how long the rest will take at the pace so far, s; None before anything was worked on."""
        return self.seconds * self.new / self.worked if self.worked else None


def found(patterns: Sequence[str]) -> tuple[list[Path], Path]:
    """Return the files that paths and patterns name, each once and in order, and the folder that holds them all.

    Of a pattern that folder is its part before the first wildcard, whatever is found: answers stay where they were
    put. Raises UsageError for a pattern that nothing matches.
    """
    paths: dict[Path, Path] = {}
    roots = []
    for pattern in patterns:
        matches = _matches(pattern)
        if not matches:
            raise UsageError("no recording is found", where=pattern, do="name files, or a pattern as 'runs/**/*.h5'")
        paths |= {path.resolve(): path for path in matches}
        roots.append(_root(pattern) if glob.has_magic(pattern) else _absolute(matches[0]).parent)
    return sorted(paths.values()), Path(os.path.commonpath(roots))


def _matches(pattern: str) -> list[Path]:
    """Return the file of this name, or else the files that match."""
    if Path(pattern).is_file():
        return [Path(pattern)]
    return [path for path in map(Path, glob.glob(pattern, recursive=True)) if path.is_file()]


def _root(pattern: str) -> Path:
    """Return the folder of a pattern before its first wildcard."""
    parts = _absolute(Path(pattern)).parts
    return Path(*parts[: next(at for at, part in enumerate(parts) if glob.has_magic(part))])


def _absolute(path: Path) -> Path:
    """Return the path without ``..``, which would lead answers out of their folder."""
    return Path(os.path.abspath(path))


def planned(patterns: Sequence[str], question: Question, out: str | Path | None = None) -> Batch:
    """Return what is to be done, answers in ``out`` or else beside their recordings; raise UsageError."""
    paths, root = found(patterns)
    folder = root if out is None else Path(out)
    here = versions(program())
    pieces = [_piece(path, folder / _absolute(path).relative_to(root), question, here) for path in paths]
    _check_distinct(pieces)
    return Batch(question, folder, tuple(pieces))


def _piece(recording: Path, place: Path, question: Question, here: dict[str, str]) -> Piece:
    """Return what is to be done with a recording, seen from what stands where its answer goes."""
    result = place.with_name(f"{place.stem}.{question.job}.json")
    if not result.exists() or (result.is_file() and result.stat().st_size == 0):
        return Piece(recording, result, "new")
    stood, failure = _stood(result)
    if stood is None or not _of_this_place(stood.question, recording, question):
        return Piece(recording, result, "refused", refused=(
            f"{result}: a file that is no answer of rig batch to this recording stands where the answer goes; "
            "remove it, or name another folder with --out"))  # fmt: skip
    if _as_asked(stood.question) != _as_asked(question):
        return Piece(recording, result, "asked otherwise before")
    if stood.versions != here:
        return Piece(recording, result, "answered by other versions before")
    return Piece(recording, result, "the recording changed", stood.question.recordings[0].sha256, failure)


def _stood(result: Path) -> tuple[Asked | None, str]:
    """Return what the answer at ``result`` was made from, None where it is none; and the message of a failure."""
    try:
        document = parse_json(read_text(result), str(result))
        held: Any = document.data
        return asked(document), str(held.get("message", "")) if held.get("schema") == FAILURE else ""
    except FileError:
        return None, ""


def _of_this_place(stood: Question, recording: Path, question: Question) -> bool:
    """Return whether an answer is to this kind of question about one recording of this name."""
    return (
        stood.job == question.job and not stood.held_out and [s.path.name for s in stood.recordings] == [recording.name]
    )


def _as_asked(question: Question) -> tuple[object, ...]:
    """Return what distinguishes questions about one recording; what a named file is called does not."""
    rig, calibration = question.rig, question.calibration
    return rig and rig.text, calibration and calibration.text, question.borders, question.knots


def _check_distinct(pieces: Sequence[Piece]) -> None:
    """Raise UsageError where two answers would go to one file."""
    seen: dict[Path, Path] = {}
    for piece in pieces:
        other = seen.setdefault(piece.result, piece.recording)
        if other != piece.recording:
            raise UsageError("two recordings whose answers have one name", where=f"{other}, {piece.recording}",
                             value=str(piece.result), do="rename one of them, or do them in two batches")  # fmt: skip


def run(
    batch: Batch, spread: Spread, progress: Callable[[State], None], limit_s: float | None = None
) -> State:
    """Do all that is to be done, none of it for longer than ``limit_s``, and return how it ended.

    Raises what ``spread`` raises, FileError when an answer cannot be written; answers written before are kept.
    """
    refused = tuple((piece.recording, piece.refused) for piece in batch.pieces if piece.refused)
    to_do = {piece.recording.absolute(): piece for piece in batch.pieces if not piece.refused}
    here = program()
    orders = [Order(path, batch.question, here, piece.known, limit_s) for path, piece in to_do.items()]
    state, began = State(len(batch.pieces), failures=refused, new=sum(not o.known for o in orders)), perf_counter()
    progress(state)
    with closing(spread(orders)) as outcomes:
        for outcome in outcomes:
            state = replace(_after(state, outcome, to_do[outcome.path]), seconds=perf_counter() - began)
            progress(state)
    return state


def _after(state: State, outcome: Outcome, piece: Piece) -> State:
    """Keep what came back, and return the state with it."""
    if outcome.text:
        make_folder(piece.result.parent)
        write_text(piece.result, outcome.text)
    new = state.new - (not piece.known)
    message = outcome.message or (piece.failure if outcome.kind == "unchanged" else "")
    failures = (*state.failures, (piece.recording, message)) if message else state.failures
    if outcome.kind == "unchanged":
        return replace(state, unchanged=state.unchanged + (not message), failures=failures, new=new)
    worked, reasons = state.worked + 1, state.reasons + Counter([piece.reason])
    answered = state.answered + (not message)
    return replace(state, worked=worked, answered=answered, reasons=reasons, failures=failures, new=new)
