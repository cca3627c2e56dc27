"""What does a YAML or JSON file say, and on which line does it say it?

Built from the parser's events, so that nothing is guessed: no tags, no aliases, no duplicate keys, no dates, no octal
numbers, ``yes`` is text; 1e-4 is a number (YAML 1.2 core schema). Every value knows its line.
"""

import json
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Never

import yaml

from rig.errors import FileError, cut_short
from rig.references import is_file

Keys = tuple[str | int, ...]

MAX_BYTES = 4_000_000
MAX_YAML = 500_000
"""Characters, as the parser takes seconds for them."""
MAX_DEPTH = 20

MAX_DIGITS = 40

_INT = re.compile(r"[+-]?\d+", re.ASCII)
_FLOAT = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_WORDS: dict[str, object] = {"": None, "~": None, "null": None, "true": True, "false": False}


@dataclass(frozen=True)
class Document:
    """A file read into plain dicts, lists and scalars, with the line of every key path (JSON has none)."""

    where: str
    text: str
    data: object
    lines: dict[Keys, int] = field(default_factory=dict)

    def at(self, *keys: str | int) -> str:
        """Return ``file:line: a.b[2].c`` for a path, or for its nearest parent that stands in the file."""
        line = next((self.lines[keys[:end]] for end in range(len(keys), -1, -1) if keys[:end] in self.lines), None)
        place = self.where if line is None else f"{self.where}:{line}"
        return f"{place}: {dotted(keys)}" if keys else place

    def error(self, what: str, *keys: str | int, value: str | None = None, allowed: str | None = None,
              do: str | None = None) -> FileError:
        """Return the error that names the file, the line and the key."""
        return FileError(what, where=self.at(*keys), value=value, allowed=allowed, do=do)


def dotted(keys: Keys) -> str:
    """Return ``steps[0].sine.frequency`` for ``("steps", 0, "sine", "frequency")``."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys).lstrip(".")


def read_text(path: Path) -> str:
    """Return the text of a small UTF-8 file; raise FileError when there is none, or it is no such file."""
    if not is_file(path):
        raise FileError("no such file" if not path.exists() else "not a file", where=str(path))
    if path.stat().st_size > MAX_BYTES:
        raise FileError("file too large for a description", where=str(path), value=f"{path.stat().st_size} bytes",
                        allowed=f"up to {MAX_BYTES} bytes", do="put long tables into a CSV file of their own")
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileError("not UTF-8 text", where=str(path), value=f"byte {error.start}") from error
    except OSError as error:
        raise FileError("cannot be read", where=str(path), value=error.strerror) from error



def parse_yaml(text: str, where: str) -> Document:
    """Return the YAML ``text`` as a Document; ``where`` names it in messages; raise FileError."""
    if len(text) > MAX_YAML:
        raise FileError("too much text for a description", where=where, value=f"{len(text)} characters",
                        allowed=f"up to {MAX_YAML} characters", do="put long tables into a CSV file of their own")
    return _parsed(text, where)


@lru_cache(maxsize=4)
def _parsed(text: str, where: str) -> Document:
    """Return the Document, parsed once for all who ask where something stands in it."""
    lines: dict[Keys, int] = {}
    try:
        events = yaml.parse(text, Loader=yaml.SafeLoader)
        data = _Builder(where, events, lines).document()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"{where}:{mark.line + 1}" if mark else where
        raise FileError("not valid YAML", where=place, value=error.problem, do=_advice(error.problem or "")) from error
    except yaml.YAMLError as error:
        raise FileError("not valid YAML", where=where, value=str(error).splitlines()[0]) from error
    return Document(where, text, data, lines)


def parse_json(text: str, where: str) -> Document:
    """Return the JSON ``text`` as a Document without lines; raise FileError."""
    if len(text) > MAX_BYTES:
        raise FileError("too much text for a description", where=where, value=f"{len(text)} characters",
                        allowed=f"up to {MAX_BYTES} characters")
    try:
        read = json.JSONDecoder(object_pairs_hook=lambda pairs: _unique(pairs, where), parse_int=_integer,
                                parse_constant=lambda word: _not_a_number(word, where))
        return Document(where, text, read.decode(text))
    except json.JSONDecodeError as error:
        raise FileError("not valid JSON", where=f"{where}:{error.lineno}", value=error.msg) from error
    except RecursionError as error:
        raise FileError("nested too deeply", where=where) from error


def scalar(text: str) -> object:
    """Return what an unquoted YAML scalar stands for: None, bool, int, float, else the text itself."""
    if text.lower() in _WORDS:
        return _WORDS[text.lower()]
    if _INT.fullmatch(text) and len(text) < MAX_DIGITS:
        return int(text)
    return float(text) if _FLOAT.fullmatch(text) else text


def _unique(pairs: list[tuple[str, object]], where: str) -> dict[str, object]:
    built = dict(pairs)
    if len(built) < len(pairs):
        name, _ = Counter(name for name, _ in pairs).most_common(1)[0]
        raise FileError("the same key twice", where=where, value=cut_short(name))
    return built


def _integer(digits: str) -> int | float:
    """Return an integer of JSON, in floating point where it has more digits than any number of ours."""
    return int(digits) if len(digits) < MAX_DIGITS else float(digits)


def _not_a_number(word: str, where: str) -> Never:
    raise FileError("not a number of JSON", where=where, value=word, allowed="finite numbers, or null")


def _line(event: yaml.Event) -> int:
    return event.start_mark.line + 1 if event.start_mark else 1


def _advice(problem: str) -> str | None:
    if "\\t" in problem:
        return "indent with spaces, not tabs"
    return "quote text that contains ': ' or starts with a sign" if "mapping values" in problem else None


class _Builder:
    """Turns parser events into plain values and notes the line of each."""

    def __init__(self, where: str, events: Iterator[yaml.Event], lines: dict[Keys, int]) -> None:
        self._where = where
        self._events = events
        self._lines = lines

    def document(self) -> object:
        """Return the only document of the stream; None when the stream is empty."""
        found: list[object] = []
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                if found:
                    raise self._error("a second document", event, do="keep one document in a file")
                found.append(self._node(next(self._events), ()))
        return found[0] if found else None

    def _node(self, event: yaml.Event, keys: Keys) -> object:
        self._refuse_magic(event)
        if len(keys) > MAX_DEPTH:
            raise self._error("nested too deeply", event)
        self._lines.setdefault(keys, _line(event))
        if isinstance(event, yaml.SequenceStartEvent):
            return self._sequence(keys)
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(keys)
        assert isinstance(event, yaml.ScalarEvent)
        return scalar(event.value) if event.style is None else event.value

    def _sequence(self, keys: Keys) -> list[object]:
        built: list[object] = []
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            built.append(self._node(event, (*keys, len(built))))
        return built

    def _mapping(self, keys: Keys) -> dict[str, object]:
        built: dict[str, object] = {}
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            key = self._key(event)
            if key in built:
                raise self._error(f"the key {cut_short(repr(key))} twice", event, do="keep one of them")
            self._lines[*keys, key] = _line(event)
            built[key] = self._node(next(self._events), (*keys, key))
        return built

    def _key(self, event: yaml.Event) -> str:
        self._refuse_magic(event)
        if not isinstance(event, yaml.ScalarEvent):
            raise self._error("a key must be plain text", event)
        return str(event.value)

    def _refuse_magic(self, event: yaml.Event) -> None:
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise self._error("anchors and aliases are not read here", event, do="write the value out")
        if getattr(event, "tag", None):
            raise self._error("tags are not read here", event, value=cut_short(str(event.tag)), do="remove the tag")  # type: ignore[attr-defined]

    def _error(self, what: str, event: yaml.Event, value: str | None = None, do: str | None = None) -> FileError:
        return FileError(what, where=f"{self._where}:{_line(event)}", value=value, do=do)
