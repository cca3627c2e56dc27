"""Does a stored answer come out again: bit for bit of the same program, and to 1e-9 of another?

The recordings are sought by name and taken by SHA-256; no path that stands in the answer is followed.
"""

import json
import math
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path
from typing import Any

from rig.errors import FileError
from rig.provenance import program
from rig.question import KEY, Asked, Source, asked
from rig.reanalysis import FAILURE, answered
from rig.references import is_file
from rig.workflow import Progress
from rig.yamlfile import parse_json, read_text

OTHERWISE = 1e-9
"""How far a number of another program may be off, relative."""
NOT_OF_THE_RECORDINGS = (KEY, "separation", "follow_up", "would_separate")
"""Keys under which an answer tells of itself, or of files written beside it."""
ROUNDED, LAST_DIGIT = 15, 1.5
"""A number of so many significant digits or more is as it was computed. Others were rounded, where a difference however
small may tip the last digit, which has so many units of room."""
IN_JSON, IN_WORDS = 6, 1
"""Digits that a rounded number has at least."""
SHOWN = 80
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Difference:
    """One thing of an answer that came out otherwise; ``relative`` is infinite where no numbers are compared.

    ``last_digit`` says that numbers were rounded and differ in no more than their last digit.
    """

    where: str
    stored: object
    now: object
    relative: float
    last_digit: bool = False


@dataclass(frozen=True)
class Reproduced:
    """An answer made again: how many numbers and words it has, what came out otherwise, how the program differs."""

    path: Path
    asked: Asked
    numbers: int
    differences: tuple[Difference, ...]
    changes: Mapping[str, tuple[str, str]]

    @property
    def intact(self) -> bool:
        """Return whether the answer came out again."""
        return not self.beyond

    @property
    def findings(self) -> tuple[str, ...]:
        """Return what came out otherwise, the largest difference first."""
        return tuple(f"{d.where}: {_shown(d.stored)} is stored, {_shown(d.now)} comes out now" for d in self.beyond)

    @property
    def refusal(self) -> tuple[str, str]:
        """Return what is wrong where something is, and what to do."""
        return "the answer comes out otherwise", "take it for changed, or make it again"

    def to_dict(self) -> dict[str, object]:
        """Return this as it stands in the JSON of ``rig verify``."""
        worst = max((d.relative for d in self.differences if math.isfinite(d.relative)), default=0.0)
        return {
            "file": str(self.path), "verdict": "reproduced" if self.intact else "different",
            "findings": list(self.findings), "job": self.asked.question.job, "compared": self.numbers,
            "different": len(self.differences), "largest_relative_difference": worst,
            "allowed_relative_difference": self.allowed,
            "program": {key: {"then": then, "now": now} for key, (then, now) in self.changes.items()},
        }  # fmt: skip

    @property
    def allowed(self) -> float:
        """Return how far a number may be off, relative: not at all where the same program computed it."""
        return OTHERWISE if self.changes else 0.0

    @property
    def beyond(self) -> tuple[Difference, ...]:
        """Return the differences that are too large, the largest first."""
        too_large = (d for d in self.differences if d.relative > self.allowed and not (self.changes and d.last_digit))
        return tuple(sorted(too_large, key=lambda d: -d.relative))


def reproduced(path: str | Path, folders: Sequence[str | Path] = (), progress: Progress | None = None) -> Reproduced:
    """Return how an answer comes out again from its recordings, in its folder or those given, or below these.

    Raises FileError for what is no such answer, or where a recording of it is not found.
    """
    path = Path(path)
    document = parse_json(read_text(path), str(path))
    made = asked(document)
    stored: Any = document.data
    if stored.get("schema") == FAILURE:
        raise FileError("it is a failure, and no answer", where=str(path), value=str(stored.get("message")))
    found = {source.path: _sought(source, path, folders) for source in _sources(made)}
    question = replace(
        made.question, recordings=tuple(found[s.path] for s in made.question.recordings),
        held_out=tuple(found[s.path] for s in made.question.held_out),
    )  # fmt: skip
    now = json.loads(answered(question, progress))
    leaves = list(_compared(stored, now, ""))
    here = program()
    changes = {
        key: (made.program.get(key, "none"), here.get(key, "none"))
        for key in sorted({*made.program, *here} - {"git_commit"})
        if made.program.get(key) != here.get(key)
    }
    return Reproduced(path, made, len(leaves), tuple(d for d in leaves if d.relative != 0.0), changes)


def is_answer(path: str | Path) -> bool:
    """Return whether the file is an answer in JSON, by its first character: a recording never begins so."""
    try:
        with Path(path).open("rb") as file:
            return file.read(64).lstrip().startswith(b"{")
    except OSError:
        return False


def _sources(made: Asked) -> tuple[Source, ...]:
    return (*made.question.recordings, *made.question.held_out)


def _sought(source: Source, answer: Path, folders: Sequence[str | Path]) -> Source:
    """Return the recording of these bytes, where it is now; raise FileError."""
    name = source.path.name
    below = [path for folder in folders for path in sorted(Path(folder).rglob("*")) if path.name == name]
    seen = [path for path in (answer.parent / name, *below) if is_file(path)]
    for path in seen:
        if Source.of(path).sha256 == source.sha256:
            return Source(path, source.sha256)
    if seen:
        raise FileError("the recording is no longer the one the answer was made from", where=str(seen[0]),
                        allowed=f"SHA-256 {source.sha256}", do="find that one, or make the answer again")  # fmt: skip
    raise FileError("the recording of this answer is not found", where=str(answer), value=name,
                    do="name the folder it is in with --recordings")  # fmt: skip


def _compared(stored: Any, now: Any, where: str) -> Iterator[Difference]:
    """Yield every number and word of both answers, ``relative`` 0 where they are the same."""
    if isinstance(stored, dict) and isinstance(now, dict):
        for key in sorted({*stored, *now} - set(NOT_OF_THE_RECORDINGS)):
            yield from _compared(stored.get(key), now.get(key), f"{where}.{key}".lstrip("."))
    elif isinstance(stored, list) and isinstance(now, list) and len(stored) == len(now):
        for at, (one, other) in enumerate(zip(stored, now, strict=True)):
            yield from _compared(one, other, f"{where}[{at}]")
    else:
        yield _difference(where, stored, now)


def _difference(where: str, stored: Any, now: Any) -> Difference:
    """Return how far two leaves differ, numbers and those in words in parts of the larger one."""
    if type(stored) is type(now) and stored == now:
        return Difference(where, stored, now, 0.0)
    pairs, least = [(stored, now)], IN_JSON
    if isinstance(stored, str) and isinstance(now, str) and NUMBER.sub("", stored) == NUMBER.sub("", now):
        said = [map(float, NUMBER.findall(text)) for text in (stored, now)]
        pairs, least = list(zip(*said, strict=True)), IN_WORDS
    if not all(_is_number(value) for pair in pairs for value in pair):
        return Difference(where, stored, now, math.inf)
    off = [abs(one - other) / max(abs(one), abs(other)) for one, other in pairs if one != other]
    tipped = all(_in_last_digit(one, other, least) for one, other in pairs)
    return Difference(where, stored, now, max(off, default=math.inf), tipped)


def _is_number(value: object) -> bool:
    """Return whether a value is a number that JSON has a form for and a float takes."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.float_info.max


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 3]}..."


def _in_last_digit(one: float, other: float, least: int) -> bool:
    """Return whether two numbers are rounded and differ by no more than their last digit."""
    digits = max(least, *(len(Decimal(repr(float(x))).normalize().as_tuple().digits) for x in (one, other)))
    largest = max(abs(one), abs(other))
    if digits >= ROUNDED or largest == 0.0:
        return largest == 0.0
    return abs(one - other) <= LAST_DIGIT * 10.0 ** (math.floor(math.log10(largest)) - digits + 1)
