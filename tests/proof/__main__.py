"""How good is the explainer? ``python -m tests.proof --cases 1320 --seed 1 --jobs 2``: sealed trials, then the tables.

Every trial is appended to ``--out`` as it ends, two lines each: its seal before the tool is asked, its truth and the
answer after. A study that was cut goes on where it stopped when the same command is given again. ``--write`` puts the
tables of all trials in the file into the README files.
"""

import argparse
import json
import subprocess
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from itertools import islice
from pathlib import Path

from tests.proof.ask import asked, exact_twins, known_effects
from tests.proof.narration import shown
from tests.proof.outcome import opened
from tests.proof.seal import sealed
from tests.proof.tables import between_marks, report, short
from tests.proof.trial import STRATA, Key, drawn, plan

LONG = Path(__file__).with_name("README.md")
README = LONG.parents[2] / "README.md"


def main(words: list[str] | None = None) -> None:
    """Run the trials that are wanted and not yet answered, then print what they show."""
    wanted = arguments(words)
    effects = known_effects()
    keys = list(islice(selected(wanted, effects), wanted.cases))
    done = answered(wanted.out)
    todo = [key for key in keys if key.text not in done]
    print(f"{len(keys)} trials, {len(keys) - len(todo)} of them answered before, into {wanted.out}", flush=True)
    for number, line in enumerate(lines(todo, wanted, effects), 1):
        print(f"{number}/{len(todo)} {line}", flush=True)
    told(wanted, [key.text for key in keys])


def lines(todo: list[Key], wanted: argparse.Namespace, effects: frozenset[str]) -> Iterator[str]:
    """Try the trials, several at a time if asked, and yield each in one line as it ends."""
    at = commit()
    if wanted.jobs == 1:
        yield from (tried(key, effects, wanted.out, at) for key in todo)
        return
    with ProcessPoolExecutor(wanted.jobs) as pool:
        running = [pool.submit(tried, key, effects, wanted.out, at) for key in todo]
        yield from (trial.result() for trial in as_completed(running))


def told(wanted: argparse.Namespace, trials: list[str]) -> None:
    """Print the tables of the trials asked for, and write them where they belong if that was asked for too."""
    done = answered(wanted.out)
    outcomes = [opened(done[trial]) for trial in trials if trial in done]
    print(report(outcomes, exact_twins()))
    if wanted.write:
        for page, text in ((README, short(outcomes)), (LONG, report(outcomes, exact_twins()))):
            page.write_text(between_marks(page.read_text(encoding="utf-8"), text), encoding="utf-8")


def arguments(words: list[str] | None = None) -> argparse.Namespace:
    """Return what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.proof", description=__doc__)
    parser.add_argument("--cases", type=int, default=66, help="how many trials; 66 are a round of the whole")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--stratum", action="append", choices=STRATA, help="only this; may be given again")
    parser.add_argument("--effect", action="append", help="only trials about this id; may be given again")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("proof.jsonl"))
    parser.add_argument("--write", action="store_true", help="write the tables into the README files")
    return parser.parse_args(words)


def selected(wanted: argparse.Namespace, effects: frozenset[str]) -> Iterator[Key]:
    """Yield the trials asked for, without end."""
    about = frozenset(wanted.effect or ())
    strata = wanted.stratum or (["single", "outside"] if about else STRATA)
    keys = plan(wanted.seed, strata, effects | about)
    return (key for key in keys if not about or key.about in about)


def answered(out: Path) -> dict[str, dict[str, object]]:
    """Return the answered trials of a file by key; a line that was cut is skipped."""
    found = {}
    for line in out.read_text(encoding="utf-8").splitlines() if out.exists() else ():
        try:
            entry = json.loads(line)
        except json.JSONDecodeError:
            continue
        if "reply" in entry:
            found[entry["trial"]] = entry
    return found


def tried(key: Key, effects: frozenset[str], out: Path, at: str) -> str:
    """Draw, seal, ask and open one trial; return it in one line."""
    trial = drawn(key, effects)
    truth = sealed(trial)
    _append(out, {"trial": key.text, "seal": truth.seal})
    reply = asdict(asked(trial))
    opened = {"seal": truth.seal, "salt": truth.salt, "truth": truth.text}
    entry = {"trial": key.text, "commit": at, **opened, "reply": reply}
    _append(out, entry)
    return shown(entry)


def _append(out: Path, entry: dict[str, object]) -> None:
    """Write one line at once, so that processes that share the file do not cut into each other's."""
    with out.open("ab", buffering=0) as file:
        file.write(json.dumps(entry).encode() + b"\n")


def commit() -> str:
    """Return the commit the trials are run at, with a mark when files differ from it."""
    describe = ["git", "describe", "--always", "--dirty", "--abbrev=9"]
    told = subprocess.run(describe, capture_output=True, text=True, check=False)
    return told.stdout.strip() or "unknown"


if __name__ == "__main__":
    main()
