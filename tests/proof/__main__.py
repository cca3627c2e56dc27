"""How good is the explainer? ``python -m tests.proof --cases 1320 --seed 1 --jobs 2``: sealed trials, then the tables.

Every trial is appended to ``--out`` as it ends, two lines each: its seal before the tool is asked, its truth and the
answer after. A study that was cut goes on where it stopped when the same command is given again.
"""

import argparse
import json
import subprocess
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict
from itertools import islice
from pathlib import Path

from tests.proof.ask import asked, known_effects
from tests.proof.seal import sealed
from tests.proof.trial import STRATA, Key, drawn, plan


def main() -> None:
    """Run the trials that are wanted and not yet answered, then print what they show."""
    wanted = arguments()
    effects = known_effects()
    keys = list(islice(selected(wanted, effects), wanted.cases))
    done = answered(wanted.out)
    todo = [key for key in keys if key.text not in done]
    print(f"{len(keys)} trials, {len(keys) - len(todo)} of them answered before, into {wanted.out}", flush=True)
    with ProcessPoolExecutor(wanted.jobs) as pool:
        running = [pool.submit(tried, key, effects, wanted.out, commit()) for key in todo]
        for number, trial in enumerate(as_completed(running), 1):
            print(f"{number}/{len(todo)} {trial.result()}", flush=True)


def arguments() -> argparse.Namespace:
    """Return what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.proof", description=__doc__)
    parser.add_argument("--cases", type=int, default=66, help="how many trials; 66 are a round of the whole")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--stratum", action="append", choices=STRATA, help="only this; may be given again")
    parser.add_argument("--effect", action="append", help="only trials about this id; may be given again")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("proof.jsonl"))
    return parser.parse_args()


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


def shown(entry: dict[str, object]) -> str:
    """Return an answered trial in one line."""
    truth, reply = json.loads(entry["truth"]), entry["reply"]
    laws = zip(truth["laws"], truth["z"], strict=True)
    values = "; ".join(f"{c['name']} {_short(c['values'])} z {z:.0f}" for c, z in laws)
    if not reply["said"]:
        return f"{entry['trial']} [{values}] FAILED {reply['failure'].splitlines()[-1]}"
    said = reply["said"]
    found = "; ".join(_told(effect) for effect in said["effects"])
    held = said["fit"]["held_out"]
    return (
        f"{entry['trial']} [{values}] {said['verdict']} [{found}] held {held['before'] / held['noise']:.3f} -> "
        f"{held['after'] / held['noise']:.3f} x noise, {reply['seconds']:.0f} s"
    )


def _told(effect: dict[str, object]) -> str:
    intervals = ((name, i["value"], *i["ci95"]) for name, i in effect["parameters"].items())
    values = ", ".join(f"{name} {value:.4g} ({low:.4g}..{high:.4g})" for name, value, low, high in intervals)
    others = "".join(f" | {o['id']}@{o['stage']} {o['probability']:.2f}" for o in effect["could_also_be"])
    return f"{effect['id']}@{effect['stage']} {effect['probability']:.2f} {values}{others}"


def _short(values: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.4g}" for name, value in values.items())


def commit() -> str:
    """Return the commit the trials are run at, with a mark when files differ from it."""
    describe = ["git", "describe", "--always", "--dirty", "--abbrev=9"]
    told = subprocess.run(describe, capture_output=True, text=True, check=False)
    return told.stdout.strip() or "unknown"


if __name__ == "__main__":
    main()
