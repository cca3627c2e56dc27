"""How is a question the recordings leave open put to the rig itself: played, recorded, explained again, decided?"""

from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from identify.trace import Trace
from rig import registry, session, workflow
from rig.errors import UsageError
from rig.separating import Written, with_protocols, write
from rig.workflow import Progress, Runs, part

if TYPE_CHECKING:
    from identify.explain.explanation import Explanation

ROUNDS = 2  # follow-ups at most: a second one where the first brought up other physics


@dataclass(frozen=True)
class Asked:
    """What the operator asked to have explained: files as typed, where protocols go, and the device to follow up on."""

    runs: tuple[str, ...]
    rig: str | None
    hold_out: tuple[str, ...]
    folder: Path | None
    device: str | None = None
    calibration: str | None = None


@dataclass(frozen=True)
class Round:
    """One follow-up: the sets it was played for, and the recordings it made."""

    written: tuple[Written, ...]
    recordings: tuple[Path, ...]


@dataclass(frozen=True)
class Followed:
    """The first and the last explanation, the recordings the last is of, the follow-ups between, what is still open."""

    first: "Explanation"
    told: "Explanation"
    runs: Runs
    rounds: tuple[Round, ...]
    open: tuple[Written, ...]
    folder: Path | None
    device: str | None

    @property
    def sets(self) -> tuple[tuple[Written, str], ...]:
        """Return every set that was followed up, and how it ended: decided, inseparable or undecided."""
        asked = [w for each in self.rounds for w in each.written]
        return tuple((w, self._status(w)) for w in {(w.separation.id, w.separation.stage): w for w in asked}.values())

    def _status(self, asked: Written) -> str:
        """Return how one set ended: a set whose members nothing played tells apart is never called decided."""
        members = {(m.id, m.stage) for m in asked.separation.members}
        left = [w for w in self.open if members & set(w.members)]
        if any(not m.exact for w in left for m in w.separation.members[1:]):
            return "undecided"
        found = {(f.id, f.stage) for f in self.told.effects} | {(c.id, c.stage) for c in self.told.entered[:1]}
        return "inseparable" if left else "decided" if found & members else "ruled out"

    def to_dict(self) -> dict[str, object]:
        """Return the keys that the JSON answer gets on top: ``separation``, and ``follow_up`` where one was asked."""
        answer: dict[str, object] = {"separation": [w.to_dict() for w in self.open]}
        if self.device is not None:
            answer["follow_up"] = {
                "device": self.device,
                "rounds": [
                    {"recordings": [str(r) for r in each.recordings], "sets": [w.to_dict() for w in each.written]}
                    for each in self.rounds
                ],
                "sets": [
                    {"set": [{"id": m.id, "stage": m.stage} for m in w.separation.members], "status": status}
                    for w, status in self.sets
                ],
            }
        return answer


def folder(separate: str | None, json_to: str | None, report: str | None, device: str | None) -> Path | None:
    """Return where protocols go: the folder named, else beside the answer, else here where one is to be played."""
    from rig.outputs import check_folder

    if separate is not None:
        return check_folder(separate)
    beside = next((Path(path).parent for path in (json_to, report) if path and path != "-"), None)
    return beside or (Path() if device else None)


def explain(asked: Asked, progress: Progress) -> Followed:
    """Explain recordings; write what would decide open questions; where a device is named, ask it and explain again.

    Raises what loading, explaining and playing raise.
    """
    runs = workflow.load(asked.runs, asked.rig, asked.hold_out, asked.calibration)
    _held(asked, runs.traces)
    if asked.device:
        asked = replace(asked, device=session.at_rig(asked.device, runs.rig))
    stretch = 1.0 / (1 + ROUNDS) if asked.device else 1.0
    told = first = workflow.explain_runs(runs, part(progress, 0.0, 0.9 * stretch))
    sets = written = _written(asked, runs, told, part(progress, 0.9 * stretch, stretch))
    rounds: list[Round] = []
    while asked.device and len(rounds) < ROUNDS and any(w.path for w in sets):
        start = (1 + len(rounds)) * stretch
        rounds.append(Round(sets, _recorded(sets, asked.device, part(progress, start, start + 0.1 * stretch))))
        new = [str(path) for each in rounds for path in each.recordings]
        runs = workflow.load([*asked.runs, *new], asked.rig, asked.hold_out, asked.calibration)
        told = workflow.explain_runs(runs, part(progress, start + 0.1 * stretch, start + 0.9 * stretch))
        told = workflow.revised(told, [w.separation.members for each in rounds for w in each.written])
        written = _written(asked, runs, told, part(progress, start + 0.9 * stretch, start + stretch))
        sets = _unasked(written, rounds)
    return Followed(first, with_protocols(told, written), runs, tuple(rounds), written, asked.folder, asked.device)


def _held(asked: Asked, traces: Sequence[Trace]) -> None:
    """Raise UsageError where a recording of a device could not be explained together with what was given."""
    if asked.device and any(t.intersample != "held" for t in traces):
        raise UsageError("--follow-up needs recordings of a DAC that holds its level", value=traces[0].intersample,
                         do="explain without it")


def _unasked(written: Sequence[Written], rounds: Sequence[Round]) -> tuple[Written, ...]:
    """Return the sets that one more round may decide: not that of places again.

    What was played for it were stimuli of every kind, and others of the same kinds tell no more.
    """
    once = any(w.separation.of_places for each in rounds for w in each.written)
    return tuple(w for w in written if not (once and w.separation.of_places))


def _written(asked: Asked, runs: Runs, told: "Explanation", progress: Progress) -> tuple[Written, ...]:
    """Write the protocols where there is a folder for them."""
    if asked.folder is None:
        return ()
    with ExitStack() as stack:
        device = stack.enter_context(registry.connect(asked.device)) if asked.device else None
        return write(runs, told, asked.folder, device, asked.device, progress)


def _recorded(written: Sequence[Written], address: str, progress: Progress) -> tuple[Path, ...]:
    """Play every protocol that was written; raise the failure of a run that did not end well."""
    paths: list[Path] = []
    for path in (w.path for w in written if w.path is not None):
        out = path.with_suffix(".h5")
        progress(f"recording {out.name}", 0.5)
        done = session.record(path, address, out, lambda done, total: None)
        if done.outcome.failure is not None:
            raise done.outcome.failure
        paths.extend(done.paths)
    return tuple(paths)


def words(followed: Followed) -> Iterator[str]:
    """Tell what was played to decide, how it ended, and what is still open."""
    for each in followed.rounds:
        yield from (f"  followed up by {path} on {followed.device}" for path in each.recordings)
    for written, status in followed.sets:
        yield f"  {status:<8} {' or '.join(m.label for m in written.separation.members)}"
    told_of = {(f.id, f.stage) for f in followed.told.effects}
    for written in followed.open:
        if (written.separation.id, written.separation.stage) not in told_of:
            yield f"  next     {written.sentence}"
    if followed.folder is None and followed.told.is_open:
        yield "  next     `--separate FOLDER` writes a protocol that would decide; `--follow-up DEVICE` plays it, too"
    if followed.device and not followed.rounds and not followed.open:
        yield "  nothing is undecided: there was nothing to follow up"
