"""What does the tool say of recordings whose truth nobody here knows? ``python -m tests.proof.sealed FOLDER --jobs 2``

FOLDER holds the sealed cases as they were handed over: a folder of gzipped CSVs for each, and the rig files. The
answers are those of ``rig import`` and ``rig explain --json`` as a user types them, put beside this file as they come.
A case that has its answer is left out: each is asked once.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.proof.__main__ import commit
from tests.proof.tables import between_marks

HERE = Path(__file__).parent
ASKED_AT = HERE / "asked_at.tsv"
"""Each answer and the commit of the tool that gave it."""
KEPT_BACK = ("multisine", "staircase_repeat")
"""Of the circuit's cases; all other runs of theirs are fitted."""


@dataclass(frozen=True)
class Asked:
    """One question: its name, the folder of its recordings, the rig file, what is fitted and what is kept back."""

    name: str
    folder: Path
    rig: Path
    fitted: tuple[str, ...]
    kept_back: tuple[str, ...]


def questions(folder: Path) -> list[Asked]:
    """Return what is asked of every case, in order."""
    found = []
    for case in sorted(folder.glob("case-*")):
        runs = tuple(sorted(path.name.removesuffix(".csv.gz") for path in case.glob("*.csv.gz")))
        if case.name == "case-p":
            for number in (1, 2):
                fitted = tuple(f"recording_{i + 1}" for i in range(number))
                found.append(Asked(f"{case.name}-{number}", case, folder / "rig-p.yaml", fitted, ("recording_3",)))
        else:
            fitted = tuple(run for run in runs if run not in KEPT_BACK)
            found.append(Asked(case.name, case, folder / "rig.yaml", fitted, KEPT_BACK))
    return found


def answered(asked: Asked) -> Path:
    """Import the recordings of a case, explain them, and return where the answer stands."""
    out = HERE / f"{asked.name}.json"
    if out.exists():
        return out
    with tempfile.TemporaryDirectory() as folder:
        runs = {name: Path(folder) / f"{name}.h5" for name in (*asked.fitted, *asked.kept_back)}
        for name, run in runs.items():
            columns = ["--time", "time", "--input", "u", "--output", "y"]
            typed("import", str(asked.folder / f"{name}.csv.gz"), *columns, "--out", str(run))
        words = [str(runs[name]) for name in asked.fitted]
        words += [word for name in asked.kept_back for word in ("--hold-out", str(runs[name]))]
        said = Path(folder) / "said.json"
        typed("explain", *words, "--rig", str(asked.rig), "--json", str(said))
        out.write_bytes(said.read_bytes())
    with ASKED_AT.open("a", encoding="utf-8") as kept:
        kept.write(f"{asked.name}\t{commit()}\n")
    return out


def typed(*words: str) -> None:
    """Run a command of the tool; raise RuntimeError with what it said where it fails."""
    done = subprocess.run([sys.executable, "-m", "rig.cli", *words], capture_output=True, text=True, check=False)
    if done.returncode not in (0, 1):
        raise RuntimeError(f"rig {' '.join(words)}: {done.stderr}")


def table(folder: Path = HERE) -> str:
    """Return the table of verdicts: case, verdict, names with their odds and values, held-out residual."""
    asked_at = dict(line.split("\t") for line in (folder / ASKED_AT.name).read_text(encoding="utf-8").splitlines())
    rows = ["| case | commit | verdict | what | held-out residual, x noise | left |", "|---|---|---|---|---|---|"]
    rows += [
        _row(path.stem, asked_at[path.stem], json.loads(path.read_text(encoding="utf-8")))
        for path in sorted(folder.glob("*.json"))
    ]
    return "\n".join(rows)


def _row(case: str, asked_at: str, said: dict[str, Any]) -> str:
    names = "; ".join(_named(effect) for effect in said["effects"]) or "no name"
    held, noise_v = said["fit"]["held_out"], said["noise"]["rms"]
    fell = f"{held['before'] / noise_v:.3g} → {held['after'] / noise_v:.3g}"
    return f"| {case} | `{asked_at}` | {said['verdict']} | {names} | {fell} | {said['remaining']['stage'] or ''} |"


def _named(effect: dict[str, Any]) -> str:
    values = ", ".join(f"{name} {value['value']:.4g} {value['unit']}" for name, value in effect["parameters"].items())
    others = ", ".join(f"`{o['id']}` at {o['stage']} {o['probability']:.2f}" for o in effect["could_also_be"])
    also = f" (or {others})" if others else ""
    return f"`{effect['id']}` at {effect['stage']} {effect['probability']:.2f}{': ' + values if values else ''}{also}"


def main(words: list[str] | None = None) -> None:
    """Ask every question that has no answer yet, and print the table."""
    parser = argparse.ArgumentParser(prog="python -m tests.proof.sealed", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--write", action="store_true", help="write the table into the README beside this file")
    wanted = parser.parse_args(words)
    with ThreadPoolExecutor(wanted.jobs) as pool:
        for out in pool.map(answered, questions(wanted.folder)):
            print(out.name, flush=True)
    text = table()
    print(text)
    if wanted.write:
        readme = HERE / "README.md"
        readme.write_text(between_marks(readme.read_text(encoding="utf-8"), text), encoding="utf-8")


if __name__ == "__main__":
    main()
