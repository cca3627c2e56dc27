"""How does a study of hours survive being cut? A line of JSON for all that happens; what is missing is done."""

import json
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from tests.proof.trial import Key

Entry = dict[str, Any]


def append(out: Path, entry: Entry) -> None:
    """Write one line at once, so that processes that share the file do not cut into each other's."""
    with out.open("ab", buffering=0) as file:
        file.write(json.dumps(entry).encode() + b"\n")


def answered(out: Path, mark: str) -> dict[str, Entry]:
    """Return the entries that have ``mark``, by trial; a line that was cut is skipped."""
    found = {}
    for line in out.read_text(encoding="utf-8").splitlines() if out.exists() else ():
        try:
            entry = json.loads(line)
        except json.JSONDecodeError:
            continue
        if mark in entry:
            found[entry["trial"]] = entry
    return found


def worked(work: Callable[[Key], str], todo: Sequence[Key], jobs: int) -> Iterator[str]:
    """Work through trials, several at a time if asked, and yield what each returns as it ends."""
    if jobs == 1:
        yield from map(work, todo)
        return
    with ProcessPoolExecutor(jobs) as pool:
        running = [pool.submit(work, key) for key in todo]
        yield from (trial.result() for trial in as_completed(running))
