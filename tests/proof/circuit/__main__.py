"""What does the tool say of changed circuits? ``python -m tests.proof.circuit --jobs 2``: all, then the table.

Recordings are kept (``$RIG_CIRCUITS``, else a folder of the system's for temporary files), answers are not: each is
asked for anew, and its JSON put into ``--out`` where that is given.
"""

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

from tests.proof.__main__ import commit
from tests.proof.circuit.changes import ALL, Change
from tests.proof.circuit.table import report, row
from tests.proof.circuit.told import answer
from tests.proof.circuit.verdict import Answer, judged
from tests.proof.tables import between_marks

README = Path(__file__).with_name("README.md")


def main(words: list[str] | None = None) -> None:
    """Play every circuit asked for, explain the recordings, and print what that was worth."""
    wanted = arguments(words)
    changes = [change for change in ALL if not wanted.only or any(word in change.name for word in wanted.only)]
    told: list[tuple[Change, Answer]] = []
    with ProcessPoolExecutor(wanted.jobs) as pool:
        answers = pool.map(partial(asked, seed=wanted.seed, out=wanted.out), changes)
        for change, said in zip(changes, answers, strict=True):
            told.append((change, said))
            print(row(change, said, judged(change, said)), flush=True)
    text = report(told, commit())
    print("\n" + text)
    if wanted.write:
        README.write_text(between_marks(README.read_text(encoding="utf-8"), text), encoding="utf-8")


def arguments(words: list[str] | None = None) -> argparse.Namespace:
    """Return what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.proof.circuit", description=__doc__)
    parser.add_argument("--only", action="append", metavar="WORD", help="circuits whose name holds it; may be repeated")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0, help="of the noise")
    parser.add_argument("--out", type=Path, help="folder for the JSON of every answer")
    parser.add_argument("--write", action="store_true", help="write the table into the README beside this file")
    return parser.parse_args(words)


def asked(change: Change, seed: int, out: Path | None) -> Answer:
    """Return what the tool said of a circuit."""
    said = answer(change, seed)
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        (out / f"{change.name.replace(' ', '_')}.json").write_text(json.dumps(said, indent=1), encoding="utf-8")
    return said


if __name__ == "__main__":
    main()
