"""What was already found out about a recording: which answers lie beside it, and are they of what it holds now?

An answer in JSON says under ``made_from`` which recordings it is of, by their SHA-256: names and places may change.
"""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rig.errors import FileError
from rig.question import KEY
from rig.yamlfile import parse_json, read_text

FITS = 1.1  # residual over noise up to which an identified model counts as following a recording


@dataclass(frozen=True)
class Answer:
    """One answer about a recording: where it is, what kind it is, its verdict in words, and of which bytes it is.

    ``of_path`` is where the recording lay; it is only compared, never opened: a file names nothing that is read.
    """

    path: Path
    kind: str
    verdict: str
    sha256: str
    of_path: str

    def to_dict(self) -> dict[str, object]:
        """Return the form of ``rig list --json``."""
        return {"path": str(self.path), "kind": self.kind, "verdict": self.verdict}


@dataclass(frozen=True)
class Answers:
    """All answers of a folder, by the SHA-256 of a recording and by its path."""

    by_content: Mapping[str, tuple[Answer, ...]]
    by_path: Mapping[str, tuple[Answer, ...]]

    @classmethod
    def among(cls, paths: Iterable[Path]) -> "Answers":
        """Return the answers among some JSON files; files that are no answers are passed over."""
        by_content, by_path = defaultdict(list), defaultdict(list)
        for answer in (answer for path in paths for answer in _read(path)):
            by_content[answer.sha256].append(answer)
            by_path[answer.of_path].append(answer)
        return cls({key: tuple(found) for key, found in by_content.items()},
                   {key: tuple(found) for key, found in by_path.items()})  # fmt: skip

    def __bool__(self) -> bool:
        """Return whether there is any."""
        return bool(self.by_content)

    def outdated(self, path: Path, sha256: str) -> tuple[Answer, ...]:
        """Return the answers about what stood at ``path`` before and is no longer there."""
        return tuple(a for a in self.by_path.get(str(path.absolute()), ()) if a.sha256 != sha256)


def _read(path: Path) -> Iterator[Answer]:
    """Yield what an answer says, once for every recording it is of; nothing for another file."""
    try:
        data = parse_json(read_text(path), str(path)).data
    except FileError:
        return
    made_from = data.get(KEY) if isinstance(data, dict) else None
    if not isinstance(data, dict) or not isinstance(made_from, dict):
        return
    kind, verdict = str(data.get("schema", "")), _verdict(data)
    if not (kind.startswith("rig.") and verdict):
        return
    for source in _sources(made_from):
        yield Answer(path, kind, verdict, source["sha256"], source["path"])


def _sources(made_from: Mapping[str, Any]) -> Iterator[dict[str, str]]:
    """Yield path and SHA-256 of the recordings an answer was fitted to."""
    recordings = made_from.get("recordings")
    for source in recordings if isinstance(recordings, list) else ():
        if isinstance(source, dict) and all(isinstance(source.get(key), str) for key in ("path", "sha256")):
            yield source


def _verdict(data: Mapping[str, Any]) -> str:
    """Return what an answer says in a few words; empty for what is none."""
    schema = data.get("schema")
    if schema == "rig.failure/1":
        return f"failed: {data.get('message')}"
    if schema == "rig.explain/1":
        effects = data.get("effects")
        named = [str(e.get("id")) for e in effects if isinstance(e, dict)] if isinstance(effects, list) else []
        return " ".join([str(data.get("verdict")), *([f"({', '.join(named)})"] if named else [])])
    return _followed(data.get("fit")) if schema == "rig.identify/1" else ""


def _followed(fit: object) -> str:
    """Return how well an identified model follows a recording."""
    rms, noise = (fit.get(key) if isinstance(fit, dict) else None for key in ("rms_V", "noise_rms_V"))
    if not (isinstance(rms, float) and isinstance(noise, float) and noise > 0.0):
        return "identified"
    over = rms / noise
    return "identified" if over <= FITS else f"identified, leaves {over:.3g} x noise"
