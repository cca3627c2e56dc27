"""What stands in a README that can be tried: its fenced blocks, in order, with their language."""

import re
from dataclasses import dataclass
from pathlib import Path

from tests.architecture.house import ROOT

FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
NAMED = re.compile(r"# (?P<name>[\w.-]+\.(?:py|yaml|toml))\n")


@dataclass(frozen=True)
class Example:
    """One fenced block of a page."""

    page: str
    line: int
    language: str
    text: str

    @property
    def file(self) -> str:
        """Return the name of the file it stands for: its first line, where that is one."""
        named = NAMED.match(self.text)
        return named["name"] if named else ""

    def __str__(self) -> str:
        return f"{self.page}:{self.line}"


def pages() -> list[Path]:
    """Return every README of the tree."""
    return [path for path in sorted(ROOT.rglob("README.md"))
            if not {part for part in path.relative_to(ROOT).parts if part.startswith(".")}]


def examples(*languages: str, page: str = "") -> list[Example]:
    """Return the blocks in some languages of all pages, or of one."""
    found = []
    for path in pages():
        text, name = path.read_text(encoding="utf-8"), str(path.relative_to(ROOT))
        fences = FENCE.finditer(text) if name.startswith(page) else ()
        found += [Example(name, text[: m.start()].count("\n") + 1, m[1], m[2]) for m in fences]
    return [example for example in found if example.language in languages]


def example(page: str, file: str) -> str:
    """Return the text of the file that a page shows."""
    (found,) = [each for each in examples("python", "yaml", "toml", page=page) if each.file == file]
    return found.text
