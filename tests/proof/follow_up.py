"""Does a follow-up decide what little data leave open? ``python -m tests.proof.follow_up --cases 40 --seed 1``.

Each case is a single-effect trial of the study (tests/proof/trial.py), of which the tool gets a staircase and one sine
only, so that many sets stay undecided. ``rig explain --follow-up`` then plays what it chose on a device behind which
the independent integrator stands. With ``--stratum outside`` the physics is in no catalogue, and what is undecided is
where it enters. Every case is appended to ``--out`` as it ends, its seal first; a study that was cut goes on where it
stopped. ``--write`` puts what it showed into README.md beside this file.
"""

import argparse
import json
import tempfile
import time
import traceback
from collections import Counter
from dataclasses import replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any

from identify.explain import Explanation
from identify.trace import Step
from rig import followup
from rig.recorded import Equipment, Origin, Recording, complete_ledger
from rig.recording import write
from rig.rigfile import model_to_yaml
from tests.proof.__main__ import LONG as README
from tests.proof.__main__ import commit
from tests.proof.ask import exact_twins, known_effects
from tests.proof.bench import Run, record
from tests.proof.device import stand
from tests.proof.seal import opened_as_sealed, sealed
from tests.proof.standard import SOURCE_V
from tests.proof.study import answered, append, worked
from tests.proof.tables import between_marks
from tests.proof.trial import Key, Trial, drawn, plan
from tests.trials import model_of

GIVEN = ("staircase", "sine_large")  # of the runs of a trial: what the tool is given before it asks for more
Named = tuple[str, str]


def main(words: list[str] | None = None) -> None:
    """Run the cases that are wanted and not yet answered, then print what they show."""
    wanted = arguments(words)
    effects = known_effects()
    asked = effects & frozenset(wanted.effect) if wanted.effect else effects
    keys = list(islice(plan(wanted.seed, [wanted.stratum], asked), wanted.cases))
    done = answered(wanted.out, "outcome")
    todo = [key for key in keys if key.text not in done]
    print(f"{len(keys)} cases, {len(keys) - len(todo)} of them answered before, into {wanted.out}", flush=True)
    for line in worked(partial(tried, out=wanted.out, at=commit()), todo, wanted.jobs):
        print(line, flush=True)
    done = answered(wanted.out, "outcome")
    text = summary([done[key.text] for key in keys if key.text in done])
    print(text)
    if wanted.write:
        marks = "follow-up" if wanted.stratum == "single" else f"follow-up-{wanted.stratum}"
        README.write_text(between_marks(README.read_text(encoding="utf-8"), text, marks), encoding="utf-8")


def arguments(words: list[str] | None = None) -> argparse.Namespace:
    """Return what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.proof.follow_up", description=__doc__)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--stratum", choices=("single", "outside"), default="single")
    parser.add_argument("--effect", action="append", help="only trials about this id; may be given again")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("follow_up.jsonl"))
    parser.add_argument("--write", action="store_true", help="write what they show into the README of the study")
    return parser.parse_args(words)


def tried(key: Key, out: Path, at: str) -> str:
    """Draw, seal, ask and open one case; return it in one line."""
    trial = limited(drawn(key))
    truth = sealed(trial)
    append(out, {"trial": key.text, "seal": truth.seal})
    began = time.process_time()
    try:
        reply = followed(trial)
    except Exception:  # a study reports every failure and goes on
        reply = {"failure": traceback.format_exc(limit=-4)}
    reply["processor_s"] = round(time.process_time() - began, 1)
    (true,) = trial.expected or trial.unheard
    opened = {"seal": truth.seal, "salt": truth.salt, "truth": truth.text}
    entry = {"trial": key.text, "commit": at, **opened, **reply}
    if trial.expected:
        entry["outcome"] = outcome((true.id, true.stage), reply, exact_twins().get(true.id, ()))
    else:
        entry["outcome"] = place_outcome(true.stage, reply)
    append(out, entry)
    sets = f"{said(reply.get('first'))} -> {said(reply.get('last'))}"
    return f"{entry['outcome']:<20} {key.text} ({true.stage}): {sets} {reply['processor_s']} s"


def limited(trial: Trial) -> Trial:
    """Return the trial with the few runs the tool is given."""
    return replace(trial, training=tuple(s for s in trial.training if s.name in GIVEN), held_out=())


def followed(trial: Trial) -> dict[str, Any]:
    """Return what the tool says before and after it followed up, and what it played for that."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        address = stand(folder / "bench.json", trial.rig, trial.physics, trial.seed)
        rig_text = model_to_yaml(model_of(trial.nominal))
        runs = [kept(run, folder, rig_text) for run in record(trial)]
        asked = followup.Asked(tuple(runs), None, (), folder, address)
        done = followup.explain(asked, lambda sentence, share: None)
        answer = done.to_dict()
        return {
            "verdicts": [done.first.verdict, done.told.verdict], "first": sets_of(done.first),
            "last": sets_of(done.told), "separation": answer["separation"], "follow_up": answer["follow_up"],
            "places": [places_of(done.first), places_of(done.told)],
        }  # fmt: skip


def kept(run: Run, folder: Path, rig_text: str) -> str:
    """Put a recording of the bench on the disk as the tool keeps its own; return its path."""
    steps = tuple(Step(s.label, s.kind, s.start, s.stop, s.repeat) for s in run.steps)
    path = folder / f"{run.name}.h5"
    write(path, Recording(
        run.name, run.rate_hz, run.u, run.y, complete_ledger(run.u.size), Origin(Equipment("trial bench")),
        start_s=run.start_s, protocol_text=f"limits: {{level: {SOURCE_V} V}}\n", rig_text=rig_text, steps=steps,
    ))  # fmt: skip
    return str(path)


def sets_of(told: Explanation) -> list[list[list[str | float]]]:
    """Return every finding's set: id, stage and probability of its members, the named one first."""
    return [
        [[f.id, f.stage, round(f.probability, 4)], *([o.id, o.stage, round(o.probability, 4)] for o in f.could_also_be)]
        for f in told.effects
    ]  # fmt: skip


def places_of(told: Explanation) -> list[list[str | bool]]:
    """Return the stages at which the mismatch may enter, the one that is told first, and which give the same data."""
    exact = {c.stage for c in told.entered if c.exact}
    stages = [told.location.stage, *told.location.alternatives] if told.location else []
    return [[stage, stage in exact] for stage in stages]


def place_outcome(true: str, reply: dict[str, Any]) -> str:
    """Return how a case of physics in no catalogue ended: by the stages told and listed before and after.

    ``missed``: the first answer did not list the right stage. ``decided at once``: it told that alone, or with one that
    gives exactly the same data. Where more was open: ``decided``: it is told alone now; ``undecided``: it is told or
    listed beside others; ``decided wrongly``: it is neither.
    """
    if "failure" in reply:
        return "failure"
    first, last = reply["places"]
    if true not in [stage for stage, _ in first]:
        return "missed"
    if _alone(true, first):
        return "decided at once"
    if _alone(true, last):
        return "decided"
    return "undecided" if true in [stage for stage, _ in last] else "decided wrongly"


def _alone(true: str, places: list[list[Any]]) -> bool:
    """Return whether a stage is told, and no other than one that gives the same data is listed beside it."""
    return bool(places) and places[0][0] == true and all(exact for _, exact in places[1:])


def outcome(true: Named, reply: dict[str, Any], twins: tuple[str, ...]) -> str:
    """Return how a case ended in one word or three.

    ``decided at once`` and ``wrong at once``: the first set had one member. ``missed``: no set had the truth in it.
    Of the sets that were undecided with the truth in it: ``decided``: only the truth is left; ``inseparable``: the
    truth and what is exactly equal to it are left; ``undecided``: more is left; ``decided wrongly``: the truth is out.
    """
    if "failure" in reply:
        return "failure"
    alike = {true[0], *twins}
    first = next((s for s in reply["first"] if any(id_ == true[0] and stage == true[1] for id_, stage, _ in s)), None)
    if first is None:
        alone = [s for s in reply["first"] if s[0][0] != "unnamed"]
        return "missed" if not alone else "wrong at once"
    if len(first) == 1:
        return "decided at once"
    last = next((s for s in reply["last"] if any(id_ in alike for id_, _, _ in s)), None)
    if last is None or not any(id_ == true[0] for id_, _, _ in last):
        return "decided wrongly"
    members = {(id_, stage) for id_, stage, _ in last}
    if members == {true}:
        return "decided"
    return "inseparable" if {id_ for id_, _ in members} <= alike else "undecided"


def said(sets: list[Any] | None) -> str:
    """Return the sets of an answer in short."""
    if sets is None:
        return "failure"
    return ", ".join("|".join(f"{i}@{stage} {p:.2f}" for i, stage, p in members) for members in sets) or "nothing"


def summary(cases: list[dict[str, Any]]) -> str:
    """Return how the cases ended, the share of undecided sets that shrank to the truth, and every other one.

    Raise ValueError where a truth is not the one that was sealed.
    """
    for case in cases:
        opened_as_sealed(case)
    ends = Counter(case["outcome"] for case in cases)
    shrunk = ends["decided"] + ends["inseparable"]
    open_at_first = shrunk + ends["undecided"] + ends["decided wrongly"]
    share = f"{shrunk} of {open_at_first}" + (f" ({100.0 * shrunk / open_at_first:.0f} %)" if open_at_first else "")
    failed = [c for c in cases if c["outcome"] in ("undecided", "decided wrongly", "wrong at once", "failure")]
    stages = _stages(cases)
    commits = ", ".join(f"`{at}`" for at in sorted({case["commit"] for case in cases}))
    return "\n".join([
        f"{len(cases)} sealed cases at commit {commits}. Of the undecided sets that had the truth in them, those that",
        f"shrank to it, or to it and what gives exactly the same data (asked: 90 %): **{share}**.", "",
        "| how it ended | cases |", "|---|---|", *(f"| {name} | {count} |" for name, count in sorted(ends.items())), "",
        *([stages, ""] if stages else []),
        *(f"- {c['outcome']}: `{c['trial']}` {_told(c, 0)} → {_told(c, 1)}" for c in failed),
    ])  # fmt: skip


def _told(case: dict[str, Any], at: int) -> str:
    """Return what was said before or after, in short: the sets of names, or the stages of what is in no catalogue."""
    if not json.loads(case["truth"]).get("unheard"):
        return said(case.get(("first", "last")[at]))
    return "|".join(stage for stage, _ in _places(case, at)) or "nothing"


def _stages(cases: list[dict[str, Any]]) -> str:
    """Return how often the right stage was told before and after, of physics in no catalogue; empty for other cases."""
    asked = [c for c in cases if json.loads(c["truth"]).get("unheard")]
    told = [sum(_stage(c) == places[0][0] for c in asked if (places := _places(c, at))) for at in (0, 1)]
    return f"The right stage was told in {told[0]} of {len(asked)} before, in {told[1]} after." if asked else ""


def _stage(case: dict[str, Any]) -> str:
    (true,) = json.loads(case["truth"])["unheard"]
    return str(true["stage"])


def _places(case: dict[str, Any], at: int) -> list[list[Any]]:
    return list(case["places"][at]) if "places" in case else []


if __name__ == "__main__":
    main()
