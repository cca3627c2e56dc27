"""How does a study of hours survive being cut, and how is it kept? A line of JSON for all that happens.

What is missing is done when the study is asked for again. Answers that are kept lie compressed beside this file, seals
and all, so that a later round adds to the tables and whoever doubts a figure can count again.
"""

import json
import lzma
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from tests.proof.trial import Key

Entry = dict[str, Any]
KEPT = Path(__file__).with_name("answers")


def append(out: Path, entry: Entry) -> None:
    """Write one line at once, so that processes that share the file do not cut into each other's."""
    with out.open("ab", buffering=0) as file:
        file.write(json.dumps(entry).encode() + b"\n")


def answered(out: Path, mark: str) -> dict[str, Entry]:
    """Return the entries that have ``mark``, by trial; a line that was cut is skipped."""
    found = {}
    for line in _text(out).splitlines() if out.exists() else ():
        try:
            entry = json.loads(line)
        except json.JSONDecodeError:
            continue
        if mark in entry:
            found[entry["trial"]] = entry
    return found


def _text(out: Path) -> str:
    """Return what a study wrote, compressed or not."""
    told = out.read_bytes()
    return (lzma.decompress(told) if out.suffix == ".xz" else told).decode()


def keep(out: Path, mark: str, into: Path = KEPT) -> Path:
    """Add the entries of a study that have ``mark`` to the compressed file of its name; return that file."""
    into.mkdir(exist_ok=True)
    file = into / f"{out.name}.xz"
    lines = "".join(f"{json.dumps(entry)}\n" for entry in (answered(file, mark) | answered(out, mark)).values())
    file.write_bytes(lzma.compress(lines.encode(), preset=9))
    return file


def kept(mark: str, among: Path = KEPT) -> dict[str, Entry]:
    """Return all entries with ``mark`` that are kept, by trial."""
    return {trial: e for file in sorted(among.glob("*.xz")) for trial, e in answered(file, mark).items()}


def worked(work: Callable[[Key], str], todo: Sequence[Key], jobs: int) -> Iterator[str]:
    """Work through trials, several at a time if asked, and yield what each returns as it ends."""
    if jobs == 1:
        yield from map(work, todo)
        return
    with ProcessPoolExecutor(jobs) as pool:
        running = [pool.submit(work, key) for key in todo]
        yield from (trial.result() for trial in as_completed(running))
