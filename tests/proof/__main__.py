"""How good is the explainer? ``python -m tests.proof --cases 1700 --seed 1 --jobs 2``: sealed trials, then the tables.

Every trial is appended to ``--out`` as it ends, two lines each: its seal before the tool is asked, its truth and the
answer after. A study that was cut goes on where it stopped when the same command is given again. ``--keep`` puts its
answers beside this file, ``--told`` runs nothing and tells of all that are kept there. ``--write`` puts the tables into
the README files.
"""

import argparse
import subprocess
from collections.abc import Iterator
from dataclasses import asdict, replace
from functools import partial
from itertools import islice
from pathlib import Path

from tests.proof.ask import asked, exact_twins, known_effects
from tests.proof.in_short import shortest
from tests.proof.kinds import LIBRARY, UNHEARD
from tests.proof.narration import shown
from tests.proof.outcome import opened
from tests.proof.seal import sealed
from tests.proof.study import Entry, answered, append, keep, kept, worked
from tests.proof.tables import between_marks, report
from tests.proof.trial import STRATA, Key, drawn, plan

NAMED, UNNAMED = (frozenset(kind.id for kind in kinds) for kinds in (LIBRARY, UNHEARD))
REPLY = "reply"  # what an answered trial has and a sealed one has not
LONG = Path(__file__).with_name("README.md")
README = LONG.parents[2] / "README.md"


def main(words: list[str] | None = None) -> None:
    """Run the trials that are wanted and not yet answered, then print what they show."""
    wanted = arguments(words)
    effects = known_effects()
    if wanted.told:
        told(list(kept(REPLY).values()), wanted.write)
        return
    keys = [replace(key, z=wanted.z and tuple(wanted.z)) for key in islice(selected(wanted, effects), wanted.cases)]
    done = answered(wanted.out, REPLY)
    todo = [key for key in keys if key.text not in done]
    print(f"{len(keys)} trials, {len(keys) - len(todo)} of them answered before, into {wanted.out}", flush=True)
    work = partial(tried, effects=effects, out=wanted.out, at=commit())
    for number, line in enumerate(worked(work, todo, wanted.jobs), 1):
        print(f"{number}/{len(todo)} {line}", flush=True)
    done = answered(wanted.out, REPLY)
    told([done[key.text] for key in keys if key.text in done], wanted.write)
    if wanted.keep:
        print(f"kept in {keep(wanted.out, REPLY)}")


def told(entries: list[Entry], written: bool) -> None:
    """Print the tables of answered trials, and write them where they belong if that was asked for too."""
    outcomes = [opened(entry) for entry in entries]
    twins = exact_twins()
    print(report(outcomes, twins))
    if written:
        for page, text in ((README, shortest(outcomes, twins)), (LONG, report(outcomes, twins))):
            page.write_text(between_marks(page.read_text(encoding="utf-8"), text), encoding="utf-8")


def arguments(words: list[str] | None = None) -> argparse.Namespace:
    """Return what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.proof", description=__doc__)
    parser.add_argument("--cases", type=int, default=85, help="how many trials; 85 are a round of the whole")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--stratum", action="append", choices=STRATA, help="only this; may be given again")
    parser.add_argument("--z", type=float, nargs=2, metavar=("LEAST", "MOST"),
                        help="how clearly what is concealed shows, instead of as in the stratum")
    parser.add_argument("--effect", action="append", help="only trials about this id; may be given again",
                        choices=sorted(NAMED | UNNAMED), metavar="ID")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("proof.jsonl"))
    parser.add_argument("--keep", action="store_true", help="keep what --out has with the project")
    parser.add_argument("--told", action="store_true", help="run nothing: the tables of all answers that are kept")
    parser.add_argument("--write", action="store_true", help="write the tables into the README files")
    wanted = parser.parse_args(words)
    if wanted.effect and set(wanted.stratum or ()) & {"null", "pair"}:
        parser.error("--effect: trials of the strata null and pair are about no single id")
    return wanted


def selected(wanted: argparse.Namespace, effects: frozenset[str]) -> Iterator[Key]:
    """Yield the trials asked for, without end."""
    about = frozenset(wanted.effect or ())
    if not about:
        return plan(wanted.seed, wanted.stratum or STRATA, effects)
    strata = wanted.stratum or [s for s, ids in (("single", NAMED), ("outside", UNNAMED)) if about & ids]
    return (key for key in plan(wanted.seed, strata, effects | (about & NAMED)) if key.about in about)


def tried(key: Key, effects: frozenset[str], out: Path, at: str) -> str:
    """Draw, seal, ask and open one trial; return it in one line."""
    trial = drawn(key, effects)
    truth = sealed(trial)
    append(out, {"trial": key.text, "seal": truth.seal})
    reply = asdict(asked(trial))
    opened = {"seal": truth.seal, "salt": truth.salt, "truth": truth.text}
    entry = {"trial": key.text, "commit": at, **opened, "reply": reply}
    append(out, entry)
    return shown(entry)


def commit() -> str:
    """Return the commit the trials are run at, with a mark when files differ from it."""
    describe = ["git", "describe", "--always", "--dirty", "--abbrev=9"]
    told = subprocess.run(describe, capture_output=True, text=True, check=False)
    return told.stdout.strip() or "unknown"


if __name__ == "__main__":
    main()
