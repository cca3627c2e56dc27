"""What does the tool say of changed circuits? ``python -m tests.proof.circuit --jobs 2``: all, then the table.

Recordings are kept (``$RIG_CIRCUITS``, else a folder of the system's for temporary files), and every answer with the
commit it was given at in ``--out``. ``--told`` asks nothing and tells of all that are there.
"""

import argparse
import json
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

from tests.proof.__main__ import commit
from tests.proof.circuit.changes import PAIRS, SINGLE, Circuit
from tests.proof.circuit.table import report, report_of_pairs, row
from tests.proof.circuit.told import answer
from tests.proof.circuit.verdict import judged
from tests.proof.tables import between_marks

README = Path(__file__).with_name("README.md")


def main(words: list[str] | None = None) -> None:
    """Play every circuit asked for, explain the recordings, and print what that was worth."""
    wanted = arguments(words)
    asked_for = PAIRS[: wanted.first] if wanted.pairs else SINGLE
    circuits = [c for c in asked_for if not wanted.only or any(word in c.name for word in wanted.only)]
    if not wanted.told:
        wanted.out.mkdir(parents=True, exist_ok=True)
        with ProcessPoolExecutor(wanted.jobs) as pool:
            work = partial(asked, seed=wanted.seed, out=wanted.out, at=commit())
            for line in pool.map(work, circuits):
                print(line, flush=True)
    there = [(circuit, kept(wanted.out, circuit)) for circuit in circuits]
    entries = [(circuit, json.loads(path.read_text())) for circuit, path in there if path.exists()]
    commits = sorted({entry["commit"] for _, entry in entries})
    told = [(circuit, entry["answer"]) for circuit, entry in entries]
    text = (report_of_pairs if wanted.pairs else report)(told, ", ".join(commits))
    print("\n" + text)
    if wanted.write:
        marks = "pairs" if wanted.pairs else "proof"
        README.write_text(between_marks(README.read_text(encoding="utf-8"), text, marks), encoding="utf-8")


def arguments(words: list[str] | None = None) -> argparse.Namespace:
    """Return what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.proof.circuit", description=__doc__)
    parser.add_argument("--pairs", action="store_true", help="circuits with two changes, in place of those with one")
    parser.add_argument("--first", type=int, default=len(PAIRS), help="how many of these, of %(default)s")
    parser.add_argument("--only", action="append", metavar="WORD", help="circuits whose name holds it; may be repeated")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=0, help="of the noise")
    parser.add_argument("--out", type=Path, default=Path("circuit-answers"), help="folder for the JSON of every answer")
    parser.add_argument("--told", action="store_true", help="ask nothing: the table of what is in --out")
    parser.add_argument("--write", action="store_true", help="write the table into the README beside this file")
    return parser.parse_args(words)


def asked(circuit: Circuit, seed: int, out: Path, at: str) -> str:
    """Ask about a circuit and keep the answer; return its line of the table."""
    said = answer(circuit, seed)
    kept(out, circuit).write_text(json.dumps({"commit": at, "answer": said}, indent=1), encoding="utf-8")
    return row(circuit, said, judged(circuit, said))


def kept(out: Path, circuit: Circuit) -> Path:
    """Return where the answer about a circuit is kept."""
    return out / f"{circuit.name.replace(' ', '_')}.json"


if __name__ == "__main__":
    main()
